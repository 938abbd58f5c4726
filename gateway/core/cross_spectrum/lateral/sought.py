"""Where the load lies to the side: what roll tells once payload and front share are known.

A load off the centre line makes the body roll as it heaves, and heave as it rolls. Held against the likelihood of all
three sensors with all else as the two others have it, this has one answer. What of roll has other causes is left free:
the tracks' own difference, how the payload is spread, how fast the body rolls today. The half-car's parameters are not:
where the model of roll errs, it must not move the weight.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.core.cross_spectrum.drift import DRIFTING
from gateway.core.cross_spectrum.likelihood import Curvature, Point, Whittle
from gateway.core.cross_spectrum.model.parameters import INDEX
from gateway.core.cross_spectrum.search import Found, most_probable
from gateway.records import F64

ROLL_BAND_HZ: Final = (1.1, 5.0)
"""Where the body rolls on its springs; above it wheels, axles and seats do things that no model here knows. Chosen."""

CG_LEFT_STD_M: Final = 0.1  # of all that is sprung: a third of an empty mass 0.3 m off the centre line is 0.075
FREE_STD: Final = {
    "twist_level": 0.3,
    "tracks_apart_m": 0.2,
    "payload_roll_gyration_m2": 0.5,
    "roll_inertia_kgm2": 0.06,  # over the rate against roll: a day's springs and tyres, who sits where, the tank
}
"""What another road, another load and another day have of their own, and what calibration leaves open of it: standard
deviations of logarithms. Chosen.
"""

MOST_MOUNT_CHANGE: Final = {"sensor_left_m": 0.1, "gyro_yaw_rad": 0.09}
"""A sensor that sits elsewhere, or is turned by five degrees more, than when it was calibrated; roll tells to a few
millimetres and tenths of a degree, but a load far to one side, on another road, may pass for a part of it.
"""

FREE: Final = [INDEX[name] for name in FREE_STD]


@dataclass(frozen=True, slots=True)
class Sideways:
    """The place (m) of the centre of gravity of all that is sprung, left of the centre line, under a load that is
    known.

    own_variance (m2) is the error from the batch's length and road. moves (n,) is by how much the place moves with each
    parameter of the vehicle, moves_with_load (2,) with payload (m/kg) and front share (m per 0..1). is_mount_changed:
    the sensor is not where, or not turned as, it was calibrated.
    """

    cg_left_m: float
    own_variance: float
    moves: F64
    moves_with_load: F64
    is_mount_changed: bool


@dataclass(frozen=True, slots=True)
class Place:
    """What a search found of FREE and the place, with the covariance; the place is its last."""

    found: Found

    @property
    def cg_left_m(self) -> float:
        """Metres left of the centre line."""
        return float(self.found.x[-1])


def sought_sideways(rolling: Whittle, point: Point) -> Place:
    """The most probable place under the payload and front share of ``point``; its own place is where to begin.

    ``rolling`` is the likelihood of all three sensors.
    """

    def cost(x: F64) -> float:
        return rolling.cost(_at(point, x))

    def curvature(x: F64) -> Curvature:
        there = _at(point, x)
        return rolling.curvature(there, _free(there))

    usual = point.theta[FREE]
    precision = np.diag(np.r_[list(FREE_STD.values()), CG_LEFT_STD_M] ** -2.0)
    return Place(
        most_probable(np.r_[usual, point.cg_left_m], np.r_[usual, 0.0], precision, cost, curvature, tolerance=0.01)
    )


def told_sideways(rolling: Whittle, place: Place, point: Point) -> Sideways:
    """How sure the place is, and what it moves with."""
    there, n, found = _at(point, place.found.x), len(point.theta), place.found
    whole = rolling.curvature(there, range(n + 3))
    moves = -found.covariance[-1] @ whole.information[_free(there)]
    moves[[*FREE, *DRIFTING]] = 0.0
    return Sideways(
        cg_left_m=place.cg_left_m,
        own_variance=float(found.covariance[-1, -1]),
        moves=moves[:n],
        moves_with_load=moves[n : n + 2],
        is_mount_changed=any(
            abs(_off(INDEX[name], whole, found, _free(there))) > most for name, most in MOST_MOUNT_CHANGE.items()
        ),
    )


def _off(entry: int, whole: Curvature, found: Found, free: list[int]) -> float:
    """How far off a parameter of the mount is, by one Newton step, all that was free moving along; 0 where untold."""
    slope, information = whole.towards(entry, free, found.covariance, whole.gradient[free])
    return -slope / information if information > 0.0 else 0.0


def _at(point: Point, x: F64) -> Point:
    theta = point.theta.copy()
    theta[FREE] = x[:-1]
    return Point(theta, point.payload_kg, point.front_share, float(x[-1]))


def _free(point: Point) -> list[int]:
    return [*FREE, len(point.theta) + 2]
