"""The parts of the reference pages made from the code: tables of keys, fields, reasons and findings.

``PARTS`` names them by page and mark; the prose is in the pages (docs/make.py fills the marks).
"""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

from made import default_of, key_table, table
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic.json_schema import GenerateJsonSchema

from gateway.archive.dataset import DIAGNOSTICS, OVER_LIMIT, OWN_STD, PROVENANCE, columns
from gateway.archive.manifest import ManifestFile, VehicleEntry
from gateway.bus.signals import SignalMapFile, shipped_map
from gateway.bus.signals.signal_map import QUANTITIES, SignalEntry, shipped_maps
from gateway.calibration.axle_weights import (
    DIVISION_KG,
    ESTIMATED_UNSPRUNG_STD,
    UNSPRUNG_SHARE,
    WEIGHED_STD,
    AxleWeights,
    sprung_of,
)
from gateway.calibration.campaign import CampaignTable, RunTable
from gateway.calibration.file.calibration_file import CalibrationFile
from gateway.calibration.inspection.finding import Kind, Topic
from gateway.cli.calibration import vehicle_block
from gateway.config import Settings
from gateway.core.vehicle import Vehicle
from gateway.estimate import Lack
from gateway.estimate_json import FIELDS, INSTANT, NUMBERS_BY_NAME, REASONS, SPECTRA, WEIGHTS, EstimateField
from gateway.reasons import EXPLANATIONS, REMEDIES, SOURCES, Cause
from gateway.records import Signal
from gateway.units import TO_SI

# -- the signal map --

MEANINGS: Final = {
    Signal.VERTICAL_ACCELERATION: "needed; z up, about +9.81 m/s² at rest (gravity is removed later)",
    Signal.PITCH_RATE: "needed; about y, positive **nose down**",
    Signal.SPEED: "needed; over ground, from GNSS",
    Signal.ROLL_RATE: "about x, positive **left side up**; gives the load's lateral position, never refuses a batch",
    Signal.LONGITUDINAL_ACCELERATION: "x forward; inspection names swapped axes with it",
    Signal.LATERAL_ACCELERATION: "y left; with `yaw_rate` and `roll_rate` it watches the gyro's gain in bends",
    Signal.YAW_RATE: "about z, positive **nose left**; likewise",
    Signal.WHEEL_SPEED: "stands in for `speed` where that is missing",
    Signal.IGNITION: "of the journey; 1 while it is on",
    Signal.AMBIENT_TEMPERATURE: "decoded and counted, nothing uses it yet",
    Signal.AXLE_WEIGHT: "of the vehicle's own load sensors; shown beside, see below",
    Signal.LATITUDE: "of the journey; WGS 84, north positive",
    Signal.LONGITUDE: "of the journey; WGS 84, east positive",
    Signal.ODOMETER: "of the journey; only differences count, so a trip's counter will do",
    Signal.DOOR: "of the journey; above 0 while any door of the load room is open",
    Signal.AIR_SPRING_PRESSURE: "of the vehicle's own load sensors; shown beside, see below",
    Signal.RIDE_HEIGHT: "likewise; its zero is the sensor's own",
    Signal.TRAILER: "above 0 while a trailer is drawn, at least once a window; nothing is weighed then",
}
SI_UNITS: Final = {
    "acceleration": "m/s²", "angular_rate": "rad/s", "speed": "m/s", "angle": "°",
    "distance": "m", "pressure": "Pa", "mass": "kg", "temperature": "°C", "state": "none"
}  # fmt: skip


def signals_table() -> str:
    """Every signal: its quantity and its use."""
    rows = ((f"`{signal}`", QUANTITIES[signal].replace("_", " "), meaning) for signal, meaning in MEANINGS.items())
    return table("NAME | quantity | meaning", rows)


def units_table() -> str:
    """Every quantity: its SI unit, and the accepted unit names."""
    rows = (
        (
            quantity.replace("_", " "),
            SI_UNITS[quantity],
            ", ".join(f"`{name}`" if name else "none at all" for name in units),
        )
        for quantity, units in TO_SI.items()
    )
    return table("quantity | becomes | accepted names", rows)


def maps_table() -> str:
    """Every shipped map and its device."""
    return table("map | device", ((f"`springscale:{name}`", _first_line(shipped_map(name))) for name in shipped_maps()))


def _first_line(path: Path) -> str:
    return path.read_text(encoding="utf-8").splitlines()[0].removeprefix("# ").split(". ")[0].rstrip(".")


# -- the campaign file --

WEIGHED = AxleWeights(front_kg=760.0, rear_kg=640.0)
MEASURED = {"Ford Escort": (75.0, 4.5, 4.5), "VW Vanagon": (90.21635, 5.56015, 5.56015)}  # sprung, unsprung, in slugs
GOLDEN_CAR: float = 0.15  # unsprung over sprung mass of a quarter-car, both axles together


def sprung_printed() -> str:
    """The command that computes sprung mass and front share from the example's axle weights, and its output."""
    command = f"springscale calibration sprung --front-axle-kg {WEIGHED.front_kg:g} --rear-axle-kg {WEIGHED.rear_kg:g}"
    return f"```console\n$ {command}\n{vehicle_block(sprung_of(WEIGHED))}\n```\n"


def sprung_assumed() -> str:
    """What the command assumes, with its sources, and the standard deviations of the example."""
    body = sprung_of(WEIGHED)
    cars = {car: 100.0 * (front + rear) / 2.0 / sprung for car, (sprung, front, rear) in MEASURED.items()}
    source = ", ".join(f"{pct:.1f} % ({car})" for car, pct in cars.items())
    rows = (
        ("unsprung mass of an axle, k", f"{100 * UNSPRUNG_SHARE:.1f} % of the sprung mass"),
        ("that of the paper's van (Table 1)", f"{100 * 80 / 1240:.1f} %"),
        ("of two real vehicles (CommonRoad vehicle models)", source),
        ("of the quarter-car of the roughness index (Sayers, Karamihas 1998)", f"{100 * GOLDEN_CAR / 2:.1f} %"),
        ("standard deviation of an unsprung mass that is estimated", f"{100 * ESTIMATED_UNSPRUNG_STD:.0f} %"),
        ("of one that is given", f"{100 * WEIGHED_STD:.0f} %"),
        ("standard deviation of a reading in steps of d (`--division-kg`)", f"d/√12 = {DIVISION_KG / 12**0.5:.1f} kg"),
        ("in the example: standard deviation of M", f"{body.mass_std_kg:.0f} kg"),
        ("in the example: standard deviation of s", f"{body.front_share_std_pct:.2f} percentage points"),
    )
    return table("quantity | figure", rows)


# -- an estimate --

UNITS: Final = (
    ("_kg", "kg"),
    ("_std_pct", "pp"),
    ("_pct", "%"),
    ("_left_m", "m"),
    ("_left_std_m", "m"),
    ("_left_interval95_m", "m"),
    ("_mps2", "m/s²"),
    ("_mps", "m/s"),
    ("_ns", "ns"),
)
SHARES: Final = ("gap_share", "usable_share", "roll_usable_share", "shares")

NULL: Final = {
    "id": "",
    "vehicle_id": "null if no configuration names the vehicle",
    "vin": "absent unless `[vehicle] vin` states it",
    "t_start_ns": "",
    "t_end_ns": "",
    "estimator": "",
    "calibration_id": "null without a calibration",
    "payload": "null if rejected, or if the ratio index has no model of it",
    "front_share": "null if rejected, or if the ratio index has no model of it",
    "payload_front_share_correlation": "null where rejected",
    "cg_left": "null if rejected, by the ratio index, and without a roll rate",
    "left_share": "as above",
    "payload_cg_left_correlation": "as above",
    "front_share_cg_left_correlation": "as above",
    "roll_share_front": "as above",
    "roll_share_front_std": "as above",
    "weights": "unknown weights are null and say what they lack; see below",
    "ratio_index_acceleration": "null if rejected before it was computed, and without a calibrated ratio index",
    "ratio_index_pitch_rate": "as above",
    "mean_speed_mps": "null if no speed is known",
    "gap_share": "",
    "usable_share": "",
    "roll_usable_share": "null without a roll rate in the signal map, and if nothing is usable",
    "roughness_mps2": "null without spectra or speed",
    "shares": "",
    "rejected": "",
    "is_provisional": "absent in the estimate of a whole batch",
    "spectra": "absent if nothing could be transformed, and if the request says `spectra=false`",
    "diagnostics": "empty if rejected before a fit",
    "epoch": "absent if rejected or provisional; the lateral position is null if no batch has one",
    "way": "null in records of early versions, and in a provisional estimate; unknown parts are null",
    "known_weights_id": "absent if no known weight is in use",
    "raw_payload": "absent if no known weight is in use",
    "raw_front_share": "as above",
    "error_budget": "empty where rejected",
    "posterior": "absent where rejected",
    "measured": "absent if no known weight is in use",
}
"""When a field is unknown, by the part of Estimate that it shows. Empty: never."""

LACKS: Final = {
    Lack.CALIBRATION: "the empty vehicle's weight is unknown: no calibration is in use",
    Lack.ESTIMATE: "the batch was rejected, or the estimator does not give the front share",
    Lack.UNSPRUNG_MASS: "`[vehicle]` of the campaign states neither the axle's unsprung mass nor its kerb weight, and "
    "the calibration has no part for cross_spectrum, which would have found it",
    Lack.TRACK_WIDTH: "`[vehicle]` of the campaign states no `track_width_m`",
    Lack.ROLL_RATE: "the lateral position of the load is unknown: no roll rate, or a calibration without one",
}
"""What a weight may lack, in words."""

KNOWN: Final = ("known_weights_id", "raw_payload", "raw_front_share", "error_budget", "posterior", "measured")
GROUPS: Final = {
    "batch": ("",),
    "epoch": ("epoch",),
    "known": KNOWN,
}
"""Tables of the page, by the parts of Estimate that they show; the batch has all the others."""


def part_of(one: EstimateField) -> str:
    """The part of Estimate that a field shows: a key of NULL."""
    return "t_end_ns" if one.name == "t_end" else one.path.partition(".")[0]


def unit_of(one: EstimateField) -> str:
    """The unit of the field's number; empty for words and pure numbers."""
    if one.name in SHARES:
        return "0 to 1"
    if one.kind in (INSTANT, REASONS, SPECTRA, NUMBERS_BY_NAME, WEIGHTS):
        return ""
    return next((unit for ending, unit in UNITS if one.name.endswith(ending)), "")


def fields_table(group: str) -> str:
    """The fields of one of GROUPS."""
    elsewhere = {part for parts in GROUPS.values() for part in parts}
    named = [one for one in FIELDS if (part_of(one) if part_of(one) in elsewhere else "") in GROUPS[group]]
    rows = (
        (
            f"`{one.name}`",
            unit_of(one),
            one.description or "",
            NULL[part_of(one)],
            ", ".join(f"`{c}`" for c in one.columns),
        )
        for one in named
    )
    return table("field | unit | meaning | unknown | columns in CSV", rows)


# -- an archive's data set --

TYPES: Final = {
    "text": "string",
    "whole": "int64",
    "number": "double",
    "instant": "timestamp, µs, UTC",
    "texts": "list of strings",
    "numbers by name": "map string to double",
}
"""By the kinds of gateway.archive.dataset: as Parquet has them."""


def columns_table() -> str:
    """Every column of the data set."""
    rows = ((f"`{name}`", TYPES[kind], _meaning(name)) for name, kind in columns().items())
    return table("column | type | meaning", rows)


def _meaning(column: str) -> str:
    """The words of the estimate's own page."""
    others = {**PROVENANCE, **DIAGNOSTICS, **{name: words for name, (_, words) in OWN_STD.items()}}
    if column in others:
        return others[column]
    if column == OVER_LIMIT:
        return "places of `weights` over their limit; empty if none is known to be"
    one = next(field for field in FIELDS if column in (field.name, *field.columns))
    if column == one.name or len(one.columns) < 2:
        return one.description or ""
    if one.name == "weights":
        of_weights = {"_std_kg": "its standard deviation", "_limit_kg": "what it may be"}
        return next((words for end, words in of_weights.items() if column.endswith(end)), one.description or "")
    return f"{'lower' if '_low95' in column else 'upper'} end of its 95 % interval"


# -- reasons and findings --


def reasons_tables() -> str:
    """Every reason, by its cause."""
    return "\n".join(
        f"## {cause}\n\n"
        + table(
            "reason | what happened | what to do",
            ((f"`{why}`", one.happened, one.advice) for why, one in EXPLANATIONS.items() if one.cause is cause),
        )
        for cause in Cause
    )


def findings_tables() -> str:
    """Every finding of the inspection, by its topic."""
    return "\n".join(
        f"## {topic}\n\n"
        + table(
            "finding | weight | what it means | what to do",
            (
                (f"`{kind}`", " or ".join(kind.severities), kind.means, kind.advice)
                for kind in Kind
                if kind.topic is topic
            ),
        )
        for topic in Topic
    )


def _named(heading: str, words: Mapping[Any, str]) -> str:
    return table(heading, ((f"`{name}`", text) for name, text in words.items()))


# -- settings --


def settings_tables() -> str:
    """Every key, a table a section."""
    top = {name: field for name, field in Settings.model_fields.items() if _section_of(field) is None}
    parts = [_settings_table("Top of the file", top, prefix="SPRINGSCALE_")]
    for name, field in Settings.model_fields.items():
        section = _section_of(field)
        if section is not None:
            words = (section.__doc__ or "").strip().splitlines()[0].rstrip(".")
            title = f"[{name}]: {words[0].lower()}{words[1:]}"
            parts.append(_settings_table(title, section.model_fields, prefix=f"SPRINGSCALE_{name.upper()}__"))
    return "\n".join(parts)


def _section_of(field: FieldInfo) -> type[BaseModel] | None:
    """The model behind a table of the file; None for a plain key."""
    kind: Any = field.annotation
    return kind if isinstance(kind, type) and issubclass(kind, BaseModel) else None


def _settings_table(title: str, fields: Mapping[str, FieldInfo], *, prefix: str) -> str:
    rows = (
        (f"`{name}`", _default(field), field.description or "", f"`{prefix}{name.upper()}`")
        for name, field in fields.items()
    )
    return f"## {title}\n\n{table('key | default | meaning | variable', rows)}"


def _default(field: FieldInfo) -> str:
    return "required" if field.is_required() else default_of(field.get_default(call_default_factory=True))


# -- the schema of a calibration file --

DIALECT: Final = "https://json-schema.org/draft/2020-12/schema"
_ID: Final[dict[str, str]] = {
    "type": "string",
    "pattern": "^sha256:[0-9a-f]{64}$",
    "description": "sha256 of the canonical JSON (keys sorted, no spaces, ASCII) of everything but this id",
}


class _WithoutFieldTitles(GenerateJsonSchema):
    """Names say it already."""

    def field_title_should_be_set(self, schema: Any) -> bool:
        """Never."""
        return False


def calibration_schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of a file written by `springscale calibrate`: all keys, and no others."""
    model = CalibrationFile.model_json_schema(mode="serialization", schema_generator=_WithoutFieldTitles)
    return {
        "$schema": DIALECT,
        **model,
        "title": "Springscale calibration file",
        "description": "What known-load drives taught of one vehicle. Units stand at the end of a name, "
        "unknown is null. Written by the tool, never by hand: the id is the hash of the content.",
        "properties": {"id": _ID, **model["properties"]},
        "required": ["id", *model["required"]],
    }


def schema_text() -> str:
    """The text of docs/calibration.schema.json."""
    return json.dumps(calibration_schema(), indent=1, ensure_ascii=False) + "\n"


PARTS: Final[Mapping[str, Mapping[str, Callable[[], str]]]] = {
    "signal-map.md": {
        "top": lambda: key_table(SignalMapFile, "signals"),
        "keys": lambda: key_table(SignalEntry),
        "signals": signals_table,
        "units": units_table,
        "maps": maps_table,
    },
    "campaign.md": {
        "top": lambda: key_table(CampaignTable, "vehicle", "runs"),
        "vehicle": lambda: key_table(Vehicle),
        "runs": lambda: key_table(RunTable),
        "sprung": sprung_printed,
        "assumed": sprung_assumed,
    },
    "estimate.md": {
        "batch": lambda: fields_table("batch"),
        "epoch": lambda: fields_table("epoch"),
        "known": lambda: fields_table("known"),
        "lacks": lambda: _named("`lacks` | meaning", LACKS),
        "diagnostics": lambda: _named("name | meaning", DIAGNOSTICS),
    },
    "archive.md": {
        "manifest": lambda: key_table(ManifestFile, "vehicles", "batch", "trust"),
        "vehicles": lambda: key_table(VehicleEntry),
        "columns": columns_table,
    },
    "reasons.md": {
        "reasons": reasons_tables,
        "sources": lambda: f"{_named('source | what it is', SOURCES)}\n{_named('remedy | what to do', REMEDIES)}",
    },
    "findings.md": {"findings": findings_tables},
    "settings.md": {"keys": settings_tables},
}
"""What stands between the marks of a page: each part is computed when it is asked for."""
