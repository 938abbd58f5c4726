"""A load event or a trip as reported: a JSON object with a fixed id and a growing revision, and a row of a table."""

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from types import MappingProxyType
from typing import Any, Final

from gateway.estimates.batch_estimate import Quantity
from gateway.records import rounded

NEWS_STD_SHARE: Final = 0.25  # chosen: of its standard deviation; a smaller change is not reported
NEWS_PROBABILITY: Final = 0.05  # chosen: a smaller change of a probability is not reported
NEWS_SHRINK: Final = 0.1  # chosen: a smaller relative change of a standard deviation is not reported


class EntryKind(StrEnum):
    """The kind of a record."""

    EVENT = "event"
    TRIP = "trip"


@dataclass(frozen=True, slots=True)
class Entry:
    """One event or trip in one revision. ``record`` is its JSON object; ``t_end_ns`` is its time by the ``clock`` of
    its batches (see halts).
    """

    kind: EntryKind
    id: str
    t_end_ns: int
    record: dict[str, Any]
    clock: int = field(default=0, compare=False)

    @property
    def revision(self) -> int:
        revision: int = self.record["revision"]
        return revision

    def revised(self, revision: int) -> "Entry":
        return replace(self, record={**self.record, "revision": revision})


def entry_id(kind: EntryKind, vehicle_id: str | None, t_ns: int) -> str:
    """The id, the same for the same vehicle and time whenever it is computed."""
    digest = hashlib.sha256(f"{kind}|{vehicle_id}|{t_ns}".encode()).hexdigest()
    return f"{kind}-{t_ns}-{digest[:12]}"


def is_news(before: Entry, after: Entry) -> bool:
    """Whether ``after`` says something new: a change by a quarter of a standard deviation, by 0.05 in probability, by a
    tenth in a standard deviation, or in anything that is not a number.
    """
    return _differs(before.record, after.record)


def quantity_json(quantity: Quantity, name: str, unit: str, digits: int) -> dict[str, Any]:
    """The keys of a quantity: name_unit, its standard deviation and 95 % interval; None where unknown."""
    low, high = quantity.interval95
    interval = None if not math.isfinite(low) else [round(low, digits), round(high, digits)]
    return {
        f"{name}_{unit}": rounded(quantity.number, digits),
        f"{name}_std_{unit}": rounded(quantity.std, digits),
        f"{name}_interval95_{unit}": interval,
    }


def _differs(before: Any, after: Any) -> bool:
    if isinstance(before, dict) and isinstance(after, dict):
        if before.keys() != after.keys():
            return True
        return any(_field_differs(name, before, after) for name in before if name not in _UNTOLD)
    if isinstance(before, list) and isinstance(after, list):
        return len(before) != len(after) or any(_differs(*pair) for pair in zip(before, after, strict=True))
    return bool(before != after)


_UNTOLD: Final = frozenset({"revision", "n_batches", "n_weighed"})


def _field_differs(name: str, before: dict[str, Any], after: dict[str, Any]) -> bool:
    one, other = before[name], after[name]
    if one is None or other is None or "interval95" in name:
        return (one is None) is not (other is None)
    if name == "probability":
        return bool(abs(one - other) > NEWS_PROBABILITY)
    if "_std_" in name:
        return bool(abs(one - other) > NEWS_SHRINK * max(one, other))
    stem, _, unit = name.rpartition("_")
    std = before.get(f"{stem}_std_{unit}")
    if isinstance(std, float):
        return bool(abs(one - other) > NEWS_STD_SHARE * std)
    return _differs(one, other)


_HEAD: Final = ("id", "revision", "vehicle_id", "t_start", "t_end")
_LOAD: Final = ("payload_kg", "payload_std_kg", "front_share_pct", "cg_left_m", "n_batches")
_PLACE: Final = ("latitude_deg", "longitude_deg")

COLUMNS: Final[Mapping[EntryKind, tuple[str, ...]]] = MappingProxyType(
    {
        EntryKind.EVENT: (
            *_HEAD,
            *("change_kg", "change_std_kg", "change_low95_kg", "change_high95_kg", "probability", "is_withdrawn"),
            *_PLACE,
            "n_stops",
            *(f"before_{name}" for name in _LOAD),
            *(f"after_{name}" for name in _LOAD),
        ),
        EntryKind.TRIP: (
            *_HEAD,
            *("is_over", "distance_m", "distance_by", "unknown_s", "moving_s", "mean_speed_mps"),
            *("payload_kg", "payload_std_kg", "payload_low95_kg", "payload_high95_kg"),
            *("carried_tkm", "carried_std_tkm", "carried_low95_tkm", "carried_high95_tkm"),
            *("weighed_share", "empty_share", "overloaded_share", "n_weighed"),
            *(f"from_{name}" for name in _PLACE),
            *(f"to_{name}" for name in _PLACE),
        ),
    }
)


def cells_of(kind: EntryKind, record: Mapping[str, Any]) -> dict[str, Any]:
    """One row: a cell for each known column."""
    cells: dict[str, Any] = {name: record[name] for name in COLUMNS[kind] if record.get(name) is not None}
    for name, x in record.items():
        if "_interval95_" in name and x is not None:
            stem, _, unit = name.partition("_interval95_")
            cells |= {f"{stem}_low95_{unit}": x[0], f"{stem}_high95_{unit}": x[1]}
    if kind is EntryKind.EVENT:
        cells["n_stops"] = len(record["stops"])
        parts = {"before_": record["before"], "after_": record["after"], "": record["place"]}
    else:
        parts = {"from_": record["from"], "to_": record["to"]}
    for prefix, part in parts.items():
        cells |= {f"{prefix}{name}": x for name, x in (part or {}).items() if f"{prefix}{name}" in COLUMNS[kind]}
    return cells
