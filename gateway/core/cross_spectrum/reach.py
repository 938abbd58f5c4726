"""How far a load lies beyond those that calibration has seen.

    beyond(load, seen, empty_mass_kg)   0 among the known loads, else the distance to the nearest mixture of them

A load is where it presses: front and rear axle load. What lies among known loads is interpolated, and
there a model that errs is held by its neighbours; beyond them its error grows with the distance.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np
from scipy.optimize import nnls

from gateway.core.vehicle import Load
from gateway.records import F64

_SUM_WEIGHT: Final = 1e3  # holds the weights of a mixture to a sum of one
_TOUCHING: Final = 1e-3  # nearer than this is inside: a kilogram or two


def beyond(load: Load, seen: Sequence[Load], empty_mass_kg: float) -> float:
    """Distance of ``load`` from the convex hull of ``seen`` in the plane of axle loads.

    In parts of the empty sprung mass; 0 inside, and where nothing was seen to be compared with.
    """
    if not seen:
        return 0.0
    corners = np.array([_axle_loads(one, empty_mass_kg) for one in seen])
    wanted = _axle_loads(load, empty_mass_kg)
    mixing = np.vstack([corners.T, np.full(len(corners), _SUM_WEIGHT)])
    weights, _ = nnls(mixing, np.r_[wanted, _SUM_WEIGHT])
    distance = float(np.linalg.norm(corners.T @ weights - wanted))
    return distance if distance > _TOUCHING else 0.0


def _axle_loads(load: Load, empty_mass_kg: float) -> F64:
    """Front and rear load (2,) in parts of the empty sprung mass."""
    whole = 1.0 + load.payload_kg / empty_mass_kg
    front = whole * load.front_share_pct / 100.0
    return np.array([front, whole - front], dtype=float)
