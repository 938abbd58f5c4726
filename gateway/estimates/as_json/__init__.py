"""The JSON object of an estimate, written and read: the same on the command line, in the store and over HTTP.

``FIELDS`` is the one place that knows its names, its schema and its columns in a CSV file.
"""

from gateway.estimates.as_json.fields import (
    COLUMNS,
    FIELDS,
    EstimateField,
    Presence,
    csv_cells,
    estimate_from_json,
    estimate_to_json,
    read_estimate,
    table_row,
)
from gateway.estimates.as_json.kinds import (
    INSTANT,
    NUMBERS_BY_NAME,
    REASONS,
    SPECTRA,
    WEIGHTS,
    FieldKind,
    without_dates,
    without_places,
)

__all__ = [
    "COLUMNS",
    "FIELDS",
    "INSTANT",
    "NUMBERS_BY_NAME",
    "REASONS",
    "SPECTRA",
    "WEIGHTS",
    "EstimateField",
    "FieldKind",
    "Presence",
    "csv_cells",
    "estimate_from_json",
    "estimate_to_json",
    "read_estimate",
    "table_row",
    "without_dates",
    "without_places",
]
