"""The table of a reprocessed archive: one row per batch, as `springscale estimate --json` prints it, with its vehicle.

Every column is a field of an estimate's JSON object (gateway.estimates.as_json), rounded as there, or gives the row's
origin. A change of columns raises ``SCHEMA_VERSION``; columns are added at the end, none is removed or changes its
kind.
"""

import io
from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any, Final

import polars as pl

from gateway.archive.places import Location
from gateway.archive.receipts import Slot
from gateway.estimates.as_json import FIELDS, EstimateField
from gateway.estimates.budget import OWN
from gateway.estimates.field_kinds import (
    COUNT,
    INSTANT,
    INTERVAL,
    NUMBERS_BY_NAME,
    OVER_LIMIT,
    REASONS,
    TEXT,
    WEIGHTS,
    WHOLE,
    FieldKind,
    places_over_limit,
)

SCHEMA_VERSION: Final = 1  # of the columns
SCHEMA_KEY: Final = "springscale_schema"  # its name in the metadata of every file

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


ColumnType = pl.DataType | type[pl.DataType]


def columns() -> dict[str, ColumnType]:
    """Name and type of every column, in order."""
    found: dict[str, ColumnType] = {}
    for one in FIELDS:
        if one.name not in _LEFT_OUT:
            found |= _columns_of(one)
    return found | dict.fromkeys(PROVENANCE, pl.String)


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
    table, sink = pl.DataFrame(rows, schema=columns()), io.BytesIO()
    table.write_parquet(sink, compression="zstd", metadata={SCHEMA_KEY: str(SCHEMA_VERSION)})
    return sink.getvalue()


def rows_of(dataset: Location, slot: Slot, wanted: list[str] | None = None) -> list[dict[str, Any]]:
    """The rows of one receipt, with these columns or all; instants are aware datetimes, UTC."""
    return pl.read_parquet(dataset.read(slot.table), columns=wanted).to_dicts()


_TEXTS: Final = pl.List(pl.String)
_TYPES: Final[Sequence[tuple[FieldKind, ColumnType]]] = (
    (TEXT, pl.String),
    (WHOLE, pl.Int64),
    (COUNT, pl.Int64),
    (INSTANT, pl.Datetime("us", "UTC")),
    (REASONS, _TEXTS),
    (NUMBERS_BY_NAME, pl.List(pl.Struct({"key": pl.String, "value": pl.Float64}))),
)


def _columns_of(one: EstimateField) -> dict[str, ColumnType]:
    if one.name == "diagnostics":
        return dict.fromkeys(DIAGNOSTICS, pl.Float64)
    if one.name == "error_budget":
        return dict.fromkeys(OWN_STD, pl.Float64)
    if one.kind is WEIGHTS:
        return {**dict.fromkeys(one.columns, pl.Float64), OVER_LIMIT: _TEXTS}
    kept = next((kept for kind, kept in _TYPES if one.kind is kind), pl.Float64)
    return dict.fromkeys(one.columns or (one.name,), kept)


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
    return [{"key": name, "value": x} for name, x in told.items()] if kind is NUMBERS_BY_NAME else told
