"""The parts of the reference pages made from the code: tables of settings, fields and reasons.

``PARTS`` names them by page and mark; the prose is in the pages (docs/make.py fills the marks).
"""

import json
from collections.abc import Callable, Mapping
from typing import Any, Final

from made import default_of, table
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic.json_schema import GenerateJsonSchema

from gateway.archive.dataset import DIAGNOSTICS
from gateway.calibration.file import CalibrationFile
from gateway.config import Settings
from gateway.estimates.as_json import FIELDS, EstimateField
from gateway.estimates.batch_estimate import Lack
from gateway.estimates.field_kinds import INSTANT, NUMBERS_BY_NAME, REASONS, SPECTRA, WEIGHTS
from gateway.estimates.reasons import EXPLANATIONS, REMEDIES, SOURCES, Cause

# -- an estimate --

UNITS: Final = (
    ("_kg", "kg"),
    ("_pct", "%"),
    ("_left_m", "m"),
    ("_mps2", "m/s²"),
    ("_mps", "m/s"),
    ("_ns", "ns"),
)
SHARES: Final = ("gap_share", "usable_share", "roll_usable_share", "shares")

NULL: Final = {
    "id": "",
    "vehicle_id": "null if no configuration names the vehicle",
    "vin": "absent unless `[vehicle] vin` states it",
    "t_start_ns": "null in a log without a date",
    "t_end_ns": "null in a log without a date",
    "estimator": "",
    "calibration_id": "null without a calibration",
    "payload": "null if rejected, or if the ratio index has no model of it",
    "front_share": "null if rejected, or if the ratio index has no model of it",
    "payload_front_share_correlation": "null where rejected",
    "cg_left": "null if rejected, by the ratio index, and without a roll rate",
    "left_share": "null if rejected, by the ratio index, and without a roll rate",
    "payload_cg_left_correlation": "null if rejected, by the ratio index, and without a roll rate",
    "front_share_cg_left_correlation": "null if rejected, by the ratio index, and without a roll rate",
    "roll_share_front": "null if rejected, by the ratio index, and without a roll rate",
    "roll_share_front_std": "null if rejected, by the ratio index, and without a roll rate",
    "weights": "unknown weights are null and say what they lack; see below",
    "ratio_index_acceleration": "null if rejected before it was computed, and without a calibrated ratio index",
    "ratio_index_pitch_rate": "null if rejected before it was computed, and without a calibrated ratio index",
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
    "way": "null in a provisional estimate; unknown parts are null",
    "error_budget": "empty where rejected",
    "posterior": "absent where rejected",
}
"""When a field is unknown, by the part of Estimate that it shows. Empty: never."""

LACKS: Final = {
    Lack.CALIBRATION: "the empty vehicle's weight is unknown: no calibration is in use",
    Lack.ESTIMATE: "the batch was rejected, or the estimator does not give the front share",
    Lack.UNSPRUNG_MASS: "neither it nor the axle's kerb weight is stated, and no cross_spectrum calibration found it",
    Lack.TRACK_WIDTH: "`[vehicle]` of the campaign states no `track_width_m`",
    Lack.ROLL_RATE: "the lateral position of the load is unknown: no roll rate, or a calibration without one",
}
"""What a weight may lack, in words."""

GROUPS: Final = {
    "batch": ("",),
    "epoch": ("epoch",),
    "errors": ("error_budget", "posterior"),
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
    """The fields of one of GROUPS; a number's standard deviation and interval are in its row."""
    elsewhere = {part for parts in GROUPS.values() for part in parts}
    named = [one for one in FIELDS if (part_of(one) if part_of(one) in elsewhere else "") in GROUPS[group]]
    rows: dict[str, list[EstimateField]] = {}
    for one in named:
        rows.setdefault(one.name.replace("_std", "").replace("_interval95", ""), []).append(one)
    lines, before = [], ""
    for first, *others in rows.values():
        unknown = NULL[part_of(first)]
        told = "as above" if unknown and unknown == before else unknown
        fields, columns = [first, *others], [c for one in (first, *others) for c in one.columns]
        names = {one.name for one in fields}
        other = ", ".join(f"`{c}`" for c in columns if c not in names) or ("" if columns else "none")
        name = ", ".join(f"`{one.name}`" for one in fields)
        lines.append((name, unit_of(first), first.description or "", told, other))
        before = unknown
    return table("field | unit | meaning | unknown | other columns in CSV", lines)


# -- reasons --


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


def _named(heading: str, words: Mapping[Any, str]) -> str:
    return table(heading, ((f"`{name}`", text) for name, text in words.items()))


# -- settings --


def settings_tables() -> str:
    """Every key, a table a section."""
    top = {name: field for name, field in Settings.model_fields.items() if _section_of(field) is None}
    parts = [_settings_table("Top of the file", top)]
    for name, field in Settings.model_fields.items():
        section = _section_of(field)
        if section is not None:
            words = (section.__doc__ or "").strip().splitlines()[0].rstrip(".")
            title = f"[{name}]: {words[0].lower()}{words[1:]}"
            parts.append(_settings_table(title, section.model_fields))
    return "\n".join(parts)


def _section_of(field: FieldInfo) -> type[BaseModel] | None:
    """The model behind a table of the file; None for a plain key."""
    kind: Any = field.annotation
    return kind if isinstance(kind, type) and issubclass(kind, BaseModel) else None


def _settings_table(title: str, fields: Mapping[str, FieldInfo]) -> str:
    rows = ((f"`{name}`", _default(field), field.description or "") for name, field in fields.items())
    return f"## {title}\n\n{table('key | default | meaning', rows)}"


def _default(field: FieldInfo) -> str:
    return "required" if field.is_required() else default_of(field.get_default(call_default_factory=True))


# -- the schema of a calibration file --

DIALECT: Final = "https://json-schema.org/draft/2020-12/schema"


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
        "description": "What drives taught of one vehicle. Units stand at the end of a name, "
        "unknown is null. Written by the tool, never by hand; its id is the sha256 of the file's bytes.",
    }


def schema_text() -> str:
    """The text of docs/calibration.schema.json."""
    return json.dumps(calibration_schema(), indent=1, ensure_ascii=False) + "\n"


PARTS: Final[Mapping[str, Mapping[str, Callable[[], str]]]] = {
    "estimate.md": {
        "batch": lambda: fields_table("batch"),
        "epoch": lambda: fields_table("epoch"),
        "errors": lambda: fields_table("errors"),
        "lacks": lambda: _named("`lacks` | meaning", LACKS),
        "diagnostics": lambda: _named("name | meaning", DIAGNOSTICS),
    },
    "reasons.md": {
        "reasons": reasons_tables,
        "sources": lambda: f"{_named('source | what it is', SOURCES)}\n{_named('remedy | what to do', REMEDIES)}",
    },
    "settings.md": {"keys": settings_tables},
}
"""What stands between the marks of a page: each part is computed when it is asked for."""
