"""Load events and trips as rows of a table."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

from gateway.core.events.entry import EntryKind

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
