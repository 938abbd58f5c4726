"""The distance of a load beyond those that taught the vehicle.

A load is a point of front and rear axle load. Among known loads the model interpolates and its neighbours limit its
error; beyond them the error grows with the distance.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np

from gateway.core.vehicle import Load
from gateway.records import F64

_TOUCHING: Final = 1e-3  # chosen: a smaller distance counts as inside; a kilogram or two


def beyond(load: Load, seen: Sequence[Load], empty_mass_kg: float) -> float:
    """Distance of ``load`` from the convex hull of ``seen`` in the plane of axle loads.

    In parts of the empty sprung mass; 0 inside, or if no load is known.
    """
    if not seen:
        return 0.0
    corners = np.array([_axle_loads(one, empty_mass_kg) for one in seen])
    wanted = _axle_loads(load, empty_mass_kg)
    distance = 0.0 if _is_surrounded(corners - wanted) else _nearest(corners - wanted)
    return distance if distance > _TOUCHING else 0.0


def _is_surrounded(corners: F64) -> bool:
    """Whether the origin is inside corners (n, 2): seen from it, no gap between directions is half a turn wide."""
    seen_at = np.sort(np.arctan2(corners[:, 1], corners[:, 0]))
    return bool(np.max(np.diff(seen_at, append=seen_at[0] + 2.0 * np.pi)) < np.pi)


def _nearest(corners: F64) -> float:
    """Least distance from the origin to the lines between any two corners (n, 2), or to the corners."""
    start, along = corners[:, None], corners[None] - corners[:, None]
    length2 = np.sum(along**2, axis=-1)
    part = np.clip(-np.sum(start * along, axis=-1) / np.where(length2 > 0.0, length2, 1.0), 0.0, 1.0)
    return float(np.min(np.linalg.norm(start + part[..., None] * along, axis=-1)))


def _axle_loads(load: Load, empty_mass_kg: float) -> F64:
    """Front and rear load (2,) in parts of the empty sprung mass."""
    whole = 1.0 + load.payload_kg / empty_mass_kg
    front = whole * load.front_share_pct / 100.0
    return np.array([front, whole - front], dtype=float)
