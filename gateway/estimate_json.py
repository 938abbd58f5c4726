"""The one JSON object of an estimate, in both directions: command line, store and HTTP all show this.

``FIELDS`` is the one place that knows its names, its schema and its columns in a CSV file.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from enum import Enum
from typing import Any, Final

import numpy as np

from gateway.estimate import UNKNOWN_INTERVAL, Correction, Epoch, Estimate, Quantity
from gateway.records import F64, Spectra, Why, iso_utc

NS_PER_US: Final = 1000
_START: Final = datetime(1970, 1, 1, tzinfo=UTC)
_FOLLOWS: Final = ("id", "t_end")  # from other fields: not read back
_INTERVAL95: Final = "95 % interval [low, high]"


class Presence(Enum):
    """Whether a field stands in every object."""

    ALWAYS = "always"
    SINCE_LATER = "since_later"  # always now; not in what early versions stored
    WHERE_KNOWN = "where_known"


@dataclass(frozen=True, slots=True)
class Kind:
    """How fields of one kind are written, read back and typed. ``read`` never sees null: unknown stays unknown."""

    shape: Any  # for the schema
    write: Callable[[Any], Any]
    read: Callable[[Any], Any]


@dataclass(frozen=True, slots=True)
class EstimateField:
    """One field: its JSON name; where in Estimate it is (attributes joined by dots); how it is described.

    ``columns`` are its names in a CSV file; none: not there.
    """

    name: str
    path: str
    kind: Kind
    description: str | None = None
    example: Any = None
    presence: Presence = Presence.ALWAYS
    columns: tuple[str, ...] = ()


def estimate_to_json(estimate: Estimate) -> dict[str, Any]:
    """The JSON object of an estimate."""
    record = {}
    for one in FIELDS:
        known = _at(estimate, one.path)
        if one.presence is not Presence.WHERE_KNOWN or (known is not None and known is not False):
            record[one.name] = one.kind.write(known)
    return record


def estimate_from_json(told: Mapping[str, Any]) -> Estimate:
    """The inverse of :func:`estimate_to_json`, as exact as that rounds; the instants and the id are exact."""
    known = {
        one.path: one.kind.read(told[one.name])
        for one in FIELDS
        if one.name not in _FOLLOWS and told.get(one.name) is not None
    }
    whole = {path: x for path, x in known.items() if "." not in path}
    estimate = Estimate(
        **whole,
        payload=_quantity(known, "payload"),
        front_share=_quantity(known, "front_share"),
        epoch=_epoch(known),
        tare=_correction(known),
    )
    return _with_its_nanoseconds(estimate, told["id"])


def _with_its_nanoseconds(estimate: Estimate, told_id: str) -> Estimate:
    """``t_start`` leaves out the nanoseconds below a microsecond; the id, a hash, tells which of the 1000 they are.

    Whole microseconds where none fits: the object was not written by this program.
    """
    within_us = (replace(estimate, t_start_ns=estimate.t_start_ns + ns) for ns in range(NS_PER_US))
    return next((one for one in within_us if one.id == told_id), estimate)


def _quantity(known: Mapping[str, Any], path: str) -> Quantity:
    return Quantity(
        known.get(f"{path}.number", math.nan),
        known.get(f"{path}.std", math.nan),
        known.get(f"{path}.interval95", UNKNOWN_INTERVAL),
    )


def _epoch(known: Mapping[str, Any]) -> Epoch | None:
    if "epoch.n_batches" not in known:
        return None
    return Epoch(_quantity(known, "epoch.payload"), _quantity(known, "epoch.front_share"), known["epoch.n_batches"])


def _correction(known: Mapping[str, Any]) -> Correction | None:
    if "tare.tare_id" not in known:
        return None
    names = ("payload", "front_share", "raw_payload", "raw_front_share")
    return Correction(known["tare.tare_id"], *(_quantity(known, f"tare.{name}") for name in names))


def spectra_to_json(spectra: Spectra) -> dict[str, list[float | None]]:
    """The JSON object of spectra: names with units, unknown is None."""
    return {
        "freq_hz": _numbers(spectra.freq_hz, 6),
        "vertical_acceleration_mps2_rthz": _numbers(spectra.vertical_acceleration, 5),
        "pitch_rate_radps_rthz": _numbers(spectra.pitch_rate, 5),
        "coherence": _numbers(spectra.coherence, 5),
        "phase_rad": _numbers(spectra.phase_rad, 5),
    }


def spectra_from_json(told: Mapping[str, Sequence[float | None]]) -> Spectra:
    """The inverse of :func:`spectra_to_json`, as exact as that rounds."""
    names = spectra_to_json(Spectra(*[np.empty(0)] * 5))
    return Spectra(*(np.array([math.nan if x is None else x for x in told[name]]) for name in names))


def csv_cells(told: Mapping[str, Any]) -> dict[str, Any]:
    """The object of :func:`estimate_to_json` as one line of a CSV file: a cell for each column that it fills."""
    cells: dict[str, Any] = {}
    for one in FIELDS:
        if one.columns and (shown := told.get(one.name)) is not None:
            is_split = len(one.columns) > 1
            cells.update(zip(one.columns, shown if is_split else [_joined(shown)], strict=True))
    return cells


def table_row(estimate: Estimate) -> dict[str, Any]:
    """The columns of a CSV file, all of them, for a table of estimates such as pandas makes; None where unknown."""
    return {**dict.fromkeys(COLUMNS), **csv_cells(estimate_to_json(estimate))}


def _joined(shown: Any) -> Any:
    return " ".join(shown) if isinstance(shown, list) else shown


def _at(estimate: Estimate, path: str) -> Any:
    """What stands at the path; None where a part of it is None."""
    known: Any = estimate
    for name in path.split("."):
        if known is not None:
            known = getattr(known, name)
    return known


def _number(x: float, digits: int) -> float | None:
    return float(f"{x:.{digits}g}") if math.isfinite(x) else None


def _numbers(x: F64, digits: int) -> list[float | None]:
    return [_number(float(v), digits) for v in x]


def _interval(bounds: tuple[float, float]) -> list[float] | None:
    low, high = (_number(b, 9) for b in bounds)
    return None if low is None or high is None else [low, high]


def _ns_of(stamp: str) -> int:
    return (datetime.fromisoformat(stamp) - _START) // timedelta(microseconds=1) * NS_PER_US


def _as_is(x: Any) -> Any:
    return x


TEXT: Final = Kind(str | None, _as_is, _as_is)
FLAG: Final = Kind(bool | None, _as_is, _as_is)
WHOLE: Final = Kind(int | None, _as_is, _as_is)
COUNT: Final = Kind(float | None, float, int)
INSTANT: Final = Kind(str | None, iso_utc, _ns_of)
NUMBER: Final = Kind(float | None, lambda x: _number(x, 9), float)
ROUGH_NUMBER: Final = Kind(float | None, lambda x: _number(x, 6), float)
INTERVAL: Final = Kind(list[float] | None, _interval, tuple)
BY_NAME: Final = Kind(
    dict[str, float | None],
    lambda numbers: {name: _number(x, 6) for name, x in numbers.items()},
    lambda told: {name: math.nan if x is None else x for name, x in told.items()},
)
REASONS: Final = Kind(list[str], lambda whys: [str(why) for why in whys], lambda told: tuple(map(Why, told)))
SPECTRA: Final = Kind(dict[str, list[float | None]] | None, spectra_to_json, spectra_from_json)


def _field(
    name: str, path: str, kind: Kind, description: str | None = None, example: Any = None, **more: Any
) -> EstimateField:
    """A field that is also a column of the CSV file, by the same name."""
    return EstimateField(name, path, kind, description, example, **{"columns": (name,), **more})


_LATER: Final = Presence.SINCE_LATER
_KNOWN: Final = Presence.WHERE_KNOWN
_ID: Final = "1795233300000000000-0f3a9c2b11de"
_SHARE: Final = "share of the sprung mass on the front axle"
_POINTS: Final = "its standard deviation, in percentage points"
_STD: Final = "its standard deviation"
_RAW: Final = "as the calibration alone has it"

FIELDS: Final = (
    _field("id", "id", TEXT, "the same for the same batch, whenever it is computed", _ID),
    _field("vehicle_id", "vehicle_id", TEXT, "as the settings name it", "van-17"),
    _field("t_start", "t_start_ns", INSTANT, "beginning of the batch, UTC", "2026-11-21T03:50:00.000000Z"),
    _field("t_end", "t_end_ns", INSTANT, "its end, UTC", "2026-11-21T03:55:00.000000Z"),
    _field("t_end_ns", "t_end_ns", WHOLE, "the same end, since 1970 UTC", 1795233300000000000),
    _field("estimator", "estimator", TEXT, "who weighed: cross_spectrum or ratio_index", "ratio_index"),
    _field("calibration_id", "calibration_id", TEXT, "hash of the calibration used", "sha256:9f86d081"),
    _field("payload_kg", "payload.number", NUMBER, "what is aboard besides the empty vehicle", 271.3),
    _field("payload_std_kg", "payload.std", NUMBER, _STD, 6.1),
    _field(
        "payload_interval95_kg",
        "payload.interval95",
        INTERVAL,
        _INTERVAL95,
        [259.3, 283.3],
        columns=("payload_low95_kg", "payload_high95_kg"),
    ),
    _field("front_share_pct", "front_share.number", NUMBER, _SHARE, 50.4),
    _field("front_share_std_pct", "front_share.std", NUMBER, _POINTS, 0.1),
    _field(
        "front_share_interval95_pct",
        "front_share.interval95",
        INTERVAL,
        _INTERVAL95,
        [50.2, 50.6],
        columns=("front_share_low95_pct", "front_share_high95_pct"),
    ),
    EstimateField("payload_front_share_correlation", "correlation", NUMBER, "of both errors, -1 to 1", 0.62, _LATER),
    _field("ratio_index_acceleration", "ratio_index_acceleration", NUMBER, "R_a of the paper", 0.97),
    _field("ratio_index_pitch_rate", "ratio_index_pitch_rate", NUMBER, "R_g of the paper", 1.21),
    _field("mean_speed_mps", "mean_speed_mps", NUMBER, "over what every gate let through", 13.9),
    _field("gap_share", "gap_share", NUMBER, "share of the batch without samples", 0.001),
    _field("usable_share", "usable_share", NUMBER, "share of the batch that every gate let through", 0.93),
    EstimateField(
        "roughness_mps2",
        "roughness_mps2",
        ROUGH_NUMBER,
        "of the road: rms vertical acceleration, 1 to 15 Hz, brought to 80 km/h",
        1.1,
        _LATER,
    ),
    EstimateField("shares", "shares", BY_NAME, "part of the batch that each cause masked", {}),
    _field("rejected", "rejected", REASONS, "why there is no answer; empty: this batch counted", []),
    EstimateField("diagnostics", "diagnostics", BY_NAME, "the estimator's own figures", {}, _LATER),
    EstimateField(
        "epoch_payload_kg", "epoch.payload.number", NUMBER, "all batches of this load together", 270.4, _KNOWN
    ),
    EstimateField("epoch_payload_std_kg", "epoch.payload.std", NUMBER, _STD, 4.9, _KNOWN),
    EstimateField("epoch_front_share_pct", "epoch.front_share.number", NUMBER, _SHARE, 50.3, _KNOWN),
    EstimateField("epoch_front_share_std_pct", "epoch.front_share.std", NUMBER, _POINTS, 0.1, _KNOWN),
    EstimateField("epoch_n_batches", "epoch.n_batches", COUNT, "batches since the load last changed", 3.0, _KNOWN),
    _field(
        "tare_id",
        "tare.tare_id",
        TEXT,
        "the zero taken off this answer; absent: the factory zero",
        presence=_KNOWN,
    ),
    _field("tare_payload_kg", "tare.payload.number", NUMBER, "taken off the raw payload", 12.4, presence=_KNOWN),
    EstimateField("tare_payload_std_kg", "tare.payload.std", NUMBER, _STD, presence=_KNOWN),
    _field(
        "tare_front_share_pct",
        "tare.front_share.number",
        NUMBER,
        "percentage points taken off the raw front share",
        presence=_KNOWN,
    ),
    EstimateField("tare_front_share_std_pct", "tare.front_share.std", NUMBER, _POINTS, presence=_KNOWN),
    EstimateField("raw_payload_kg", "tare.raw_payload.number", NUMBER, _RAW, 283.7, _KNOWN),
    EstimateField("raw_payload_std_kg", "tare.raw_payload.std", NUMBER, _STD, presence=_KNOWN),
    EstimateField("raw_front_share_pct", "tare.raw_front_share.number", NUMBER, _RAW, presence=_KNOWN),
    EstimateField("raw_front_share_std_pct", "tare.raw_front_share.std", NUMBER, _POINTS, presence=_KNOWN),
    EstimateField("vin", "vin", TEXT, "vehicle identification number", presence=_KNOWN),
    EstimateField(
        "provisional",
        "is_provisional",
        FLAG,
        "true: an early look at a batch that is still growing",
        presence=_KNOWN,
    ),
    EstimateField("spectra", "spectra", SPECTRA, "of both sensors, for people to look at", presence=_KNOWN),
)
COLUMNS: Final = tuple(column for one in FIELDS for column in one.columns)
