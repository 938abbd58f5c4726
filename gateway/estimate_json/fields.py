"""The table of an estimate's fields in JSON: names, order, kinds, descriptions and columns of CSV files."""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final

from gateway.estimate import Weight, Weights
from gateway.estimate_json.errors import BUDGET, POSTERIOR
from gateway.estimate_json.kinds import (
    COUNT,
    FLAG,
    INSTANT,
    INTERVAL,
    NUMBER,
    NUMBERS_BY_NAME,
    REASONS,
    ROUGH_NUMBER,
    SPECTRA,
    TEXT,
    WEIGHT_COLUMNS,
    WEIGHTS,
    WHOLE,
    FieldKind,
    weights_to_json,
)
from gateway.estimate_json.way import EXAMPLE, WAY
from gateway.quantities import BY_NAME

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


def _field(
    name: str, path: str, kind: FieldKind, description: str | None = None, example: Any = None, **more: Any
) -> EstimateField:
    """A field that is also a column of the CSV file, by the same name."""
    return EstimateField(name, path, kind, description, example, **{"columns": (name,), **more})


def _found(name: str, number: float, std: float, interval95: list[float]) -> Iterator[EstimateField]:
    """A quantity's number, standard deviation and interval, with examples of them."""
    one = BY_NAME[name]
    unit = one.suffix
    yield _field(one.json_name, f"{name}.number", NUMBER, one.words, number)
    yield _field(f"{name}_std_{unit}", f"{name}.std", NUMBER, _POINTS if unit == "pct" else _STD, std)
    yield _field(
        f"{name}_interval95_{unit}",
        f"{name}.interval95",
        INTERVAL,
        _INTERVAL95,
        interval95,
        columns=(f"{name}_low95_{unit}", f"{name}_high95_{unit}"),
    )


_KNOWN: Final = Presence.WHERE_KNOWN
_ID: Final = "1795233300000000000-0f3a9c2b11de"
_SHARE: Final = BY_NAME["front_share"].words
_CG_LEFT: Final = BY_NAME["cg_left"].words
_ROLL_SHARE: Final = "part of a sideways load's moment that the front axle takes, 0 to 1"
_POINTS: Final = "its standard deviation, in percentage points"
_STD: Final = "its standard deviation"
_RAW: Final = "by the calibration alone, without known weights"

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
}

FIELDS: Final = (
    _field("id", "id", TEXT, "the same for the same batch, whenever it is computed", _ID),
    _field("vehicle_id", "vehicle_id", TEXT, "as the settings name it", "van-17"),
    _field("t_start", "t_start_ns", INSTANT, "beginning of the batch, UTC", "2026-11-21T03:50:00.000000Z"),
    _field("t_end", "t_end_ns", INSTANT, "its end, UTC", "2026-11-21T03:55:00.000000Z"),
    _field("t_end_ns", "t_end_ns", WHOLE, "the same end, since 1970 UTC", 1795233300000000000),
    _field(
        "t_start_ns",
        "t_start_ns",
        WHOLE,
        "its beginning, likewise",
        1795233000000000000,
        columns=(),
    ),
    _field("estimator", "estimator", TEXT, "the estimator: cross_spectrum or ratio_index", "ratio_index"),
    _field("calibration_id", "calibration_id", TEXT, "hash of the calibration used", "sha256:9f86d081"),
    *_found("payload", 271.3, 6.1, [259.3, 283.3]),
    *_found("front_share", 50.4, 0.1, [50.2, 50.6]),
    EstimateField(
        "payload_front_share_correlation",
        "payload_front_share_correlation",
        NUMBER,
        "of both errors, -1 to 1",
        0.62,
    ),
    _field("ratio_index_acceleration", "ratio_index_acceleration", NUMBER, "R_a of the paper", 0.97),
    _field("ratio_index_pitch_rate", "ratio_index_pitch_rate", NUMBER, "R_g of the paper", 1.21),
    _field("mean_speed_mps", "mean_speed_mps", NUMBER, "over the samples that every gate accepted", 13.9),
    _field("gap_share", "gap_share", NUMBER, "share of the batch without samples", 0.001),
    _field("usable_share", "usable_share", NUMBER, "share of the batch that every gate accepted", 0.93),
    EstimateField(
        "roughness_mps2",
        "roughness_mps2",
        ROUGH_NUMBER,
        "of the road: rms vertical acceleration, 1 to 15 Hz, scaled to 80 km/h",
        1.1,
    ),
    EstimateField("shares", "shares", NUMBERS_BY_NAME, "part of the batch that each cause masked", {}),
    _field("rejected", "rejected", REASONS, "why there is no estimate; empty: this batch counted", []),
    EstimateField("diagnostics", "diagnostics", NUMBERS_BY_NAME, "the estimator's own figures", {}),
    EstimateField(
        "epoch_payload_kg", "epoch.payload.number", NUMBER, "all batches of this load together", 270.4, _KNOWN
    ),
    EstimateField("epoch_payload_std_kg", "epoch.payload.std", NUMBER, _STD, 4.9, _KNOWN),
    EstimateField("epoch_front_share_pct", "epoch.front_share.number", NUMBER, _SHARE, 50.3, _KNOWN),
    EstimateField("epoch_front_share_std_pct", "epoch.front_share.std", NUMBER, _POINTS, 0.1, _KNOWN),
    EstimateField("epoch_cg_left_m", "epoch.cg_left.number", NUMBER, _CG_LEFT, 0.02, _KNOWN),
    EstimateField("epoch_cg_left_std_m", "epoch.cg_left.std", NUMBER, _STD, 0.003, _KNOWN),
    EstimateField("epoch_n_batches", "epoch.n_batches", COUNT, "batches since the load last changed", 3.0, _KNOWN),
    _field(
        "known_weights_id",
        "known_weights_id",
        TEXT,
        "hash of the known weights that this estimate takes into account; absent: none",
        presence=_KNOWN,
    ),
    EstimateField("raw_payload_kg", "raw_payload.number", NUMBER, _RAW, 283.7, _KNOWN),
    EstimateField("raw_payload_std_kg", "raw_payload.std", NUMBER, _STD, presence=_KNOWN),
    EstimateField("raw_front_share_pct", "raw_front_share.number", NUMBER, _RAW, presence=_KNOWN),
    EstimateField("raw_front_share_std_pct", "raw_front_share.std", NUMBER, _POINTS, presence=_KNOWN),
    *_found("cg_left", 0.021, 0.004, [0.013, 0.029]),
    *_found("left_share", 51.2, 0.2, [50.8, 51.7]),
    EstimateField(
        "payload_cg_left_correlation",
        "payload_cg_left_correlation",
        NUMBER,
        "of the errors of payload and `cg_left_m`, -1 to 1",
        0.11,
    ),
    EstimateField(
        "front_share_cg_left_correlation",
        "front_share_cg_left_correlation",
        NUMBER,
        "of the errors of front share and `cg_left_m`, -1 to 1",
        -0.06,
    ),
    EstimateField("roll_share_front", "roll_share_front", NUMBER, _ROLL_SHARE, 0.58),
    EstimateField("roll_share_front_std", "roll_share_front_std", NUMBER, _STD, 0.07),
    _field(
        "weights",
        "weights",
        WEIGHTS,
        "on the road, standing on level ground, unsprung masses included",
        weights_to_json(_WEIGHTS),
        columns=WEIGHT_COLUMNS,
    ),
    _field(
        "roll_usable_share",
        "roll_usable_share",
        NUMBER,
        "share of `usable_share` with a known roll rate",
        0.99,
    ),
    EstimateField("way", "way", WAY, "distance, standstills, door and ignition", EXAMPLE),
    _field(
        "epoch_payload_interval95_kg",
        "epoch.payload.interval95",
        INTERVAL,
        _INTERVAL95,
        presence=_KNOWN,
        columns=("epoch_payload_low95_kg", "epoch_payload_high95_kg"),
    ),
    EstimateField(
        "error_budget",
        "error_budget",
        BUDGET,
        "contribution of each source to the error, largest payload first: one standard deviation each",
        _BUDGET,
    ),
    EstimateField(
        "posterior",
        "posterior",
        POSTERIOR,
        "mean, own covariance and columns by source, in kg, % and m; null: no answer",
        _POSTERIOR,
        _KNOWN,
    ),
    EstimateField(
        "measured_posterior",
        "measured",
        POSTERIOR,
        "the same before known weights were taken into account; absent: there are none",
        presence=_KNOWN,
    ),
    EstimateField(
        "epoch_posterior",
        "epoch.posterior",
        POSTERIOR,
        "of all batches of this load together",
        presence=_KNOWN,
    ),
    EstimateField("vin", "vin", TEXT, "vehicle identification number", presence=_KNOWN),
    EstimateField(
        "provisional",
        "is_provisional",
        FLAG,
        "true: an early look at a batch that is still growing",
        presence=_KNOWN,
    ),
    EstimateField("spectra", "spectra", SPECTRA, "of both sensors, for display", presence=_KNOWN),
)
COLUMNS: Final = tuple(column for one in FIELDS for column in one.columns)
