"""The table of a reprocessed archive: one row per batch, as `springscale estimate --json` prints it, with its vehicle.

Every column is a field of an estimate's JSON object (gateway.estimates.as_json), rounded as there, or gives the row's
origin. A change of columns raises ``SCHEMA_VERSION``; columns are added at the end, none is removed or changes its
kind.
"""

import io
from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import TYPE_CHECKING, Any, Final

from gateway.archive.places import MISSING, Location
from gateway.archive.receipts import Slot
from gateway.errors import ConfigurationError
from gateway.estimates.as_json import FIELDS, INSTANT, NUMBERS_BY_NAME, REASONS, WEIGHTS, EstimateField, FieldKind
from gateway.estimates.as_json.kinds import COUNT, INTERVAL, OVER_LIMIT, TEXT, WHOLE, places_over_limit
from gateway.estimates.budget import OWN

if TYPE_CHECKING:
    import pyarrow as pa

SCHEMA_VERSION: Final = 1  # of the columns

DIAGNOSTICS: Final[Mapping[str, str]] = {
    "reach": "distance of the load beyond the known ones, in parts of the empty sprung mass; 0 among them",
    "misfit": "likelihood ratio against free matrices, over what chance gives: about 1 if the model fits",
    "n_segments": "segments that were averaged",
    "amplitude_ratio": "movement of the vehicle, relative to the usual one in calibration",
    "damper_front_ratio": "front dampers' rate over the calibrated",
    "damper_rear_ratio": "rear dampers' rate over the calibrated",
    "delay_scale": "relative delay of the rear axle beyond wheelbase and speed",
    "tension": "deviation of the vehicle from its calibration: chi-squared of its parameters; refused above 60",
    "sensor_position_deviation": "of the sensor's place from the calibrated one, in standard deviations; refused "
    "beyond 6",
    "sensor_noise_deviation": "of the accelerometer's noise, as roll makes it, in the same unit; refused above 6",
    "noise_acceleration_ratio": "noise of the accelerometer from 16.5 to 20 Hz relative to the greatest expected: "
    "from 2 on the model includes it",
    "noise_pitch_rate_ratio": "the same for the pitch rate",
    "noise_roll_rate_ratio": "the same for the roll rate",
    "gyro_gain_ratio": "gain of the gyro over that in calibration, measured in bends; refused beyond 3.5 standard "
    "deviations from 1",
    "gyro_gain_ratio_std": "its standard deviation",
    "payload_gyration_m2": "squared radius of gyration in pitch of the load",
    "payload_mode_hz": "frequency at which the payload rings on its floor",
    "payload_damping_ratio": "damping of its floor or mount, relative to critical",
    "delay_s": "mean time from axle to axle",
    "delay_std_s": "its standard deviation over the segments",
}
"""What cross_spectrum says of its own: a column each, null where it says nothing. The ratio index says nothing."""

PROVENANCE: Final[Mapping[str, str]] = {
    "log": "the log in which the batch ended: its path in the archive",
    "log_sha256": "hash of that file as stored",
    "signals_id": "hash of the signal map, its databases resolved",
    "software": "the version of springscale and the hash of its code",
    "job": "hash of all inputs of the row; also the name of its file and receipt",
}
"""Columns that no estimate has; `calibration_id` is among the estimate's own."""

_LEFT_OUT: Final = frozenset({"spectra", "provisional", "way", "posterior", "measured_posterior", "epoch_posterior"})
"""Not in the table: large, never true of a whole batch, or of many parts."""

OWN_STD: Final[Mapping[str, tuple[str, str]]] = {
    "payload_own_std_kg": ("payload_kg", "part of `payload_std_kg` that this batch shares with no other"),
    "front_share_own_std_pct": ("front_share_pct", "the same of `front_share_std_pct`"),
    "cg_left_own_std_m": ("cg_left_m", "the same of `cg_left_std_m`"),
}
"""Columns of `error_budget`: its line of the batch's own error, and what it means."""


def columns() -> dict[str, str]:
    """Name and kind of every column, in order: text, whole, number, instant, texts, numbers by name."""
    found: dict[str, str] = {}
    for one in FIELDS:
        if one.name not in _LEFT_OUT:
            found |= _columns_of(one)
    return found | dict.fromkeys(PROVENANCE, "text")


def row_of(record: Mapping[str, Any]) -> dict[str, Any]:
    """The JSON object of an estimate as a row, without its provenance; None where unknown."""
    row: dict[str, Any] = {}
    for one in FIELDS:
        if one.name not in _LEFT_OUT:
            names, told = _columns_of(one), record.get(one.name)
            row |= dict.fromkeys(names) if told is None else dict(zip(names, _cells(one, told), strict=True))
    return row


def parquet_of(rows: Sequence[Mapping[str, Any]]) -> bytes:
    """Rows as one Parquet file: the same rows give the same bytes on any computer."""
    pa, pq = pyarrow_and_parquet()
    table = pa.Table.from_pylist([dict(row) for row in rows], schema=schema())
    sink = io.BytesIO()
    pq.write_table(table, sink, compression="zstd")
    return sink.getvalue()


def rows_of(dataset: Location, slot: Slot, wanted: Sequence[str] | None = None) -> list[dict[str, Any]]:
    """The rows of one receipt, with these columns or all; instants are aware datetimes, UTC."""
    _, pq = pyarrow_and_parquet()
    table = pq.read_table(io.BytesIO(dataset.read(slot.table)), columns=None if wanted is None else list(wanted))
    rows: list[dict[str, Any]] = table.to_pylist()
    return rows


def schema() -> "pa.Schema":
    """The table's schema in Arrow's terms; its version is in the metadata."""
    pa, _ = pyarrow_and_parquet()
    kinds = {
        "text": pa.string(),
        "whole": pa.int64(),
        "number": pa.float64(),
        "instant": pa.timestamp("us", tz="UTC"),
        "texts": pa.list_(pa.string()),
        "numbers by name": pa.map_(pa.string(), pa.float64()),
    }
    fields = [pa.field(name, kinds[kind]) for name, kind in columns().items()]
    return pa.schema(fields, metadata={"springscale_schema": str(SCHEMA_VERSION)})


def _columns_of(one: EstimateField) -> dict[str, str]:
    if one.name == "diagnostics":
        return dict.fromkeys(DIAGNOSTICS, "number")
    if one.name == "error_budget":
        return dict.fromkeys(OWN_STD, "number")
    if one.kind is WEIGHTS:
        return dict.fromkeys(one.columns, "number") | {OVER_LIMIT: "texts"}
    kind = next((name for of, name in _KINDS if one.kind is of), "number")
    return dict.fromkeys(one.columns or (one.name,), kind)


_KINDS: Final = (
    (TEXT, "text"),
    (WHOLE, "whole"),
    (COUNT, "whole"),
    (INSTANT, "instant"),
    (REASONS, "texts"),
    (NUMBERS_BY_NAME, "numbers by name"),
)


def _cells(one: EstimateField, told: Any) -> Sequence[Any]:
    if one.name == "diagnostics":
        return [told.get(name) for name in DIAGNOSTICS]
    if one.name == "error_budget":
        own: Mapping[str, Any] = next((line for line in told if line["source"] == OWN), {})
        return [own.get(name) for name, _ in OWN_STD.values()]
    if one.kind is WEIGHTS:
        return [*one.kind.cells(told)[:-1], places_over_limit(told)]
    if one.kind is INTERVAL:
        return list(told)
    return [_cell(one.kind, told)]


def _cell(kind: FieldKind, told: Any) -> Any:
    if kind is INSTANT:
        return datetime.fromisoformat(told)
    if kind is COUNT:
        return int(told)
    return list(told.items()) if kind is NUMBERS_BY_NAME else told


def pyarrow_and_parquet() -> tuple[Any, Any]:
    """pyarrow and pyarrow.parquet, loaded when a table is made or read; a vehicle does not have them."""
    try:
        import pyarrow  # noqa: PLC0415 - an extra
        import pyarrow.parquet  # noqa: PLC0415 - likewise
    except ModuleNotFoundError:
        raise ConfigurationError(MISSING) from None
    return pyarrow, pyarrow.parquet
