"""An estimate as its JSON object, the object as an estimate, and either as a line of a CSV file."""

import math
from collections.abc import Mapping
from typing import Any, Final

from gateway.estimate import UNKNOWN_INTERVAL, Epoch, Estimate, Quantity
from gateway.estimate_json.fields import COLUMNS, FIELDS, Presence

_FOLLOWS: Final = frozenset(one.name for one in FIELDS if one.name.startswith("raw_") or "correlation" in one.name) | {
    "id",
    "t_end",
}
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
    """The columns of a CSV file, all of them, for a table of estimates such as pandas makes; None if unknown."""
    return {**dict.fromkeys(COLUMNS), **csv_cells(estimate_to_json(estimate))}


def _at(estimate: Estimate, path: str) -> Any:
    """The attribute at the path; None if a part of it is None."""
    known: Any = estimate
    for name in path.split("."):
        if known is not None:
            known = getattr(known, name)
    return known
