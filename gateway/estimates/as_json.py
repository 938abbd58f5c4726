"""The JSON object of an estimate: the table of its fields, the object as an estimate, and either as a line of CSV.

The table has names, order, kinds, descriptions and columns of CSV files.
"""

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final

from gateway.estimates.batch_estimate import UNKNOWN_INTERVAL, Epoch, Estimate, Quantity, Weight, Weights
from gateway.estimates.field_kinds import (
    BUDGET,
    COUNT,
    EXAMPLE,
    FLAG,
    INSTANT,
    INTERVAL,
    NUMBER,
    NUMBERS_BY_NAME,
    POSTERIOR,
    REASONS,
    ROUGH_NUMBER,
    SPECTRA,
    TEXT,
    WAY,
    WEIGHT_COLUMNS,
    WEIGHTS,
    WHOLE,
    FieldKind,
    without_dates,
)
from gateway.estimates.quantities import BY_NAME

_INTERVAL95: Final = "95 % interval [low, high]"


class Presence(Enum):
    """Whether a field is in every object."""

    ALWAYS = "always"
    WHERE_KNOWN = "where_known"


@dataclass(frozen=True, slots=True)
class EstimateField:
    """One field: its JSON name; where in Estimate it is (attributes joined by dots); how it is described.

    ``columns`` are its names in a CSV file; none: not there.
    """

    name: str
    path: str
    kind: FieldKind
    description: str | None = None
    example: Any = None
    presence: Presence = Presence.ALWAYS
    columns: tuple[str, ...] = ()


def _row(
    name: str,
    kind: FieldKind,
    description: str | None = None,
    example: Any = None,
    *,
    path: str | None = None,
    presence: Presence = Presence.ALWAYS,
    columns: tuple[str, ...] = (),
) -> EstimateField:
    """A field that the attribute of its own name gives, unless ``path`` names another; no column of the CSV file."""
    return EstimateField(name, path or name, kind, description, example, presence, columns)


def _column(name: str, kind: FieldKind, description: str, example: Any = None, **more: Any) -> EstimateField:
    """A field that is also a column of the CSV file, by the same name."""
    return _row(name, kind, description, example, **{"columns": (name,), **more})


def _found(name: str, number: float, std: float, interval95: list[float]) -> Iterator[EstimateField]:
    """A quantity's number, standard deviation and interval, with examples of them."""
    one = BY_NAME[name]
    unit = one.suffix
    yield _column(one.json_name, NUMBER, one.words, number, path=f"{name}.number")
    yield _column(f"{name}_std_{unit}", NUMBER, _POINTS if unit == "pct" else _STD, std, path=f"{name}.std")
    ends = (f"{name}_low95_{unit}", f"{name}_high95_{unit}")
    yield _row(f"{name}_interval95_{unit}", INTERVAL, _INTERVAL95, interval95, path=f"{name}.interval95", columns=ends)


def _known(name: str, path: str, description: str, example: Any = None, kind: FieldKind = NUMBER) -> EstimateField:
    """A field that is absent where it is unknown."""
    return _row(name, kind, description, example, path=path, presence=Presence.WHERE_KNOWN)


_ID: Final = "1795233300000000000-0f3a9c2b11de"
_SHARE: Final = BY_NAME["front_share"].words
_CG_LEFT: Final = BY_NAME["cg_left"].words
_ROLL_SHARE: Final = "part of a sideways load's moment that the front axle takes, 0 to 1"
_POINTS: Final = "its standard deviation, in percentage points"
_STD: Final = "its standard deviation"

_WEIGHTS: Final = Weights(
    Weight(1711.3, 6.1, 2000.0, None),
    Weight(856.1, 5.4, 1000.0, None),
    Weight(855.2, 5.6, 1100.0, None),
    Weight(442.0, 4.0, 500.0, None),
    Weight(414.1, 4.0, 500.0, None),
    Weight(434.0, 3.8, None, None),
    Weight(421.2, 3.8, None, None),
)

_BUDGET: Final = [
    {
        "source": "load_length",
        "payload_kg": 5.2,
        "front_share_pct": 0.08,
        "cg_left_m": None,
        "remedy": "say_what_is_carried",
        "payload_with_remedy_kg": 4.2,
    }
]
_POSTERIOR: Final = {
    "mean": [271.3, 50.4],
    "own": [[10.2, 0.1], [0.1, 0.004]],
    "sources": {"load_length": [[5.2, 0.08]]},
    "tails": [1.96, 1.96],
    "leans": [1.0, 1.1],
}

FIELDS: Final = (
    _column("id", TEXT, "the same for the same batch, whenever it is computed", _ID),
    _column("vehicle_id", TEXT, "as the settings name it", "van-17"),
    _column("t_start", INSTANT, "beginning of the batch, UTC", "2026-11-21T03:50:00.000000Z", path="t_start_ns"),
    _column("t_end", INSTANT, "its end, UTC", "2026-11-21T03:55:00.000000Z", path="t_end_ns"),
    _column("t_end_ns", WHOLE, "the same end, since 1970 UTC", 1795233300000000000),
    _row("t_start_ns", WHOLE, "its beginning, likewise", 1795233000000000000),
    _column("estimator", TEXT, "the estimator: cross_spectrum or ratio_index", "ratio_index"),
    _column("calibration_id", TEXT, "hash of the calibration used", "sha256:9f86d081"),
    *_found("payload", 271.3, 6.1, [259.3, 283.3]),
    *_found("front_share", 50.4, 0.1, [50.2, 50.6]),
    _row("payload_front_share_correlation", NUMBER, "of both errors, -1 to 1", 0.62),
    _column("ratio_index_acceleration", NUMBER, "R_a of the paper", 0.97),
    _column("ratio_index_pitch_rate", NUMBER, "R_g of the paper", 1.21),
    _column("mean_speed_mps", NUMBER, "over the samples that every gate accepted", 13.9),
    _column("gap_share", NUMBER, "share of the batch without samples", 0.001),
    _column("usable_share", NUMBER, "share of the batch that every gate accepted", 0.93),
    _row("roughness_mps2", ROUGH_NUMBER, "of the road: rms vertical acceleration, 1 to 15 Hz, scaled to 80 km/h", 1.1),
    _row("shares", NUMBERS_BY_NAME, "part of the batch that each cause masked", {}),
    _column("rejected", REASONS, "why there is no estimate; empty: this batch counted", []),
    _row("diagnostics", NUMBERS_BY_NAME, "the estimator's own figures", {}),
    _known("epoch_payload_kg", "epoch.payload.number", "all batches of this load together", 270.4),
    _known("epoch_payload_std_kg", "epoch.payload.std", _STD, 4.9),
    _known("epoch_front_share_pct", "epoch.front_share.number", _SHARE, 50.3),
    _known("epoch_front_share_std_pct", "epoch.front_share.std", _POINTS, 0.1),
    _known("epoch_cg_left_m", "epoch.cg_left.number", _CG_LEFT, 0.02),
    _known("epoch_cg_left_std_m", "epoch.cg_left.std", _STD, 0.003),
    _known("epoch_n_batches", "epoch.n_batches", "batches since the load last changed", 3.0, COUNT),
    *_found("cg_left", 0.021, 0.004, [0.013, 0.029]),
    *_found("left_share", 51.2, 0.2, [50.8, 51.7]),
    _row("payload_cg_left_correlation", NUMBER, "of the errors of payload and `cg_left_m`, -1 to 1", 0.11),
    _row("front_share_cg_left_correlation", NUMBER, "of the errors of front share and `cg_left_m`, -1 to 1", -0.06),
    _row("roll_share_front", NUMBER, _ROLL_SHARE, 0.58),
    _row("roll_share_front_std", NUMBER, _STD, 0.07),
    _row(
        "weights",
        WEIGHTS,
        "on the road, standing on level ground, unsprung masses included",
        WEIGHTS.write(_WEIGHTS),
        columns=WEIGHT_COLUMNS,
    ),
    _column("roll_usable_share", NUMBER, "share of `usable_share` with a known roll rate", 0.99),
    _row("way", WAY, "distance, standstills, door and ignition", EXAMPLE),
    _row(
        "epoch_payload_interval95_kg",
        INTERVAL,
        _INTERVAL95,
        path="epoch.payload.interval95",
        presence=Presence.WHERE_KNOWN,
        columns=("epoch_payload_low95_kg", "epoch_payload_high95_kg"),
    ),
    _row(
        "error_budget",
        BUDGET,
        "contribution of each source to the error, largest payload first: one standard deviation each",
        _BUDGET,
    ),
    _known(
        "posterior",
        "posterior",
        "mean, own covariance and columns by source, in kg, % and m; null: no answer",
        _POSTERIOR,
        POSTERIOR,
    ),
    _known("epoch_posterior", "epoch.posterior", "of all batches of this load together", kind=POSTERIOR),
    _known("vin", "vin", "vehicle identification number", kind=TEXT),
    _known("provisional", "is_provisional", "true: an early look at a batch that is still growing", kind=FLAG),
    _known("spectra", "spectra", "of both sensors, for display", kind=SPECTRA),
)
COLUMNS: Final = tuple(column for one in FIELDS for column in one.columns)


_FOLLOWS: Final = frozenset(one.name for one in FIELDS if "correlation" in one.name) | {"id", "t_end"}
"""Fields that follow from others and are not read back."""


def estimate_to_json(estimate: Estimate) -> dict[str, Any]:
    """The JSON object of an estimate."""
    record = {}
    for one in FIELDS:
        known = _at(estimate, one.path)
        if one.presence is not Presence.WHERE_KNOWN or (known is not None and known is not False):
            record[one.name] = one.kind.write(known)
    return record


def estimate_from_json(told: Mapping[str, Any]) -> Estimate:
    """The inverse of :func:`estimate_to_json`, as exact as that rounds; the instants and the id are exact.

    ``t_start_ns`` stands behind ``t_start``, which has whole microseconds, and so counts if it is there.
    """
    known = {
        one.path: one.kind.read(told[one.name])
        for one in FIELDS
        if one.name not in _FOLLOWS and told.get(one.name) is not None
    }
    whole = {path: x for path, x in known.items() if "." not in path}
    return Estimate(
        **whole,
        payload=_quantity(known, "payload"),
        front_share=_quantity(known, "front_share"),
        cg_left=_quantity(known, "cg_left"),
        left_share=_quantity(known, "left_share"),
        epoch=_epoch(known),
    )


def read_estimate(text: str) -> Estimate:
    """The estimate of a JSON text. Raises whatever another text provokes; ``Exception`` covers it."""
    return estimate_from_json(json.loads(text))


def _quantity(known: Mapping[str, Any], path: str) -> Quantity:
    return Quantity(
        known.get(f"{path}.number", math.nan),
        known.get(f"{path}.std", math.nan),
        known.get(f"{path}.interval95", UNKNOWN_INTERVAL),
    )


def _epoch(known: Mapping[str, Any]) -> Epoch | None:
    if "epoch.n_batches" not in known:
        return None
    payload, front_share, cg_left = (
        _quantity(known, f"epoch.{name}") for name in ("payload", "front_share", "cg_left")
    )
    return Epoch(payload, front_share, known["epoch.n_batches"], cg_left, known.get("epoch.posterior"))


def csv_cells(told: Mapping[str, Any]) -> dict[str, Any]:
    """The object of :func:`estimate_to_json` as one line of a CSV file: a cell for each column that it fills."""
    cells: dict[str, Any] = {}
    for one in FIELDS:
        if one.columns and (shown := told.get(one.name)) is not None:
            cells.update(zip(one.columns, one.kind.cells(shown), strict=True))
    return cells


def table_row(estimate: Estimate) -> dict[str, Any]:
    """The columns of a CSV file, all of them, for a table of estimates such as pandas makes; None if unknown.

    Of a log without a date ``t_start`` and ``t_end`` are unknown; ``t_end_ns`` counts from the zero of its stamps.
    """
    return {**dict.fromkeys(COLUMNS), **csv_cells(without_dates(estimate_to_json(estimate)))}


def _at(estimate: Estimate, path: str) -> Any:
    """The attribute at the path; None if a part of it is None."""
    known: Any = estimate
    for name in path.split("."):
        if known is not None:
            known = getattr(known, name)
    return known
