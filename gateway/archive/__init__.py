"""Reprocesses a fleet's archive of logs: every vehicle's drives become one data set of verified estimates.

Logs in local folders or object stores and a manifest go in; Parquet tables and their receipts come out. Only this
package imports obstore and Dask, and with the fleet's report polars: a vehicle has none of them.
"""

from gateway.archive.dataset import SCHEMA_VERSION, columns, rows_of
from gateway.archive.places import Location, PlaceError, place_of
from gateway.archive.receipts import Slot, failures, receipts, slots_done, trusted_tables

__all__ = [
    "SCHEMA_VERSION",
    "Location",
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
