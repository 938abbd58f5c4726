"""Estimates, events and calibrations in SQLite: one writer, read-only readers, bounded in age and size."""

from gateway.store.database import Retention
from gateway.store.reader import Event, Latest, StoreReader
from gateway.store.writer import Store

__all__ = ["Event", "Latest", "Retention", "Store", "StoreReader"]
