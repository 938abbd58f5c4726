"""A fleet's archive of logs re-read: every vehicle's drives to one data set of estimates that readers can trust.

Logs in local folders or object stores and a manifest come in; Parquet tables and their receipts go out. pyarrow,
obstore and Dask are imported here alone, and only when they are needed: a vehicle has none of them.
"""

from gateway.archive.dataset import SCHEMA_VERSION, columns, rows_of
from gateway.archive.places import Place, PlaceError, place_of
from gateway.archive.receipts import Slot, failures, receipts, slots_done, trusted_tables

__all__ = [
    "SCHEMA_VERSION",
    "Place",
    "PlaceError",
    "Slot",
    "columns",
    "failures",
    "place_of",
    "receipts",
    "rows_of",
    "slots_done",
    "trusted_tables",
]
