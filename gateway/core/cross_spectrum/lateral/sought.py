"""The lateral place of the load, estimated from roll once payload and front share are known.

A load off the centre line makes the body roll as it heaves, and heave as it rolls. The likelihood of all three sensors,
with everything else as found from the two others, has one maximum. Parameters that also affect roll are free: the
difference of the tracks, the spread of the payload, the day's roll inertia. The half-car's parameters are fixed: errors
of the roll model must not change the weight.
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
"""Chosen: the band in which the body rolls on its springs; above it wheels, axles and seats are not modelled."""

CG_LEFT_STD_M: Final = (
    0.1  # chosen: of the whole sprung mass; a payload of a third of the empty mass, 0.3 m off the line, gives 0.075
)
FREE_STD: Final = {
    "twist_level": 0.3,
    "tracks_apart_m": 0.2,
    "payload_roll_gyration_m2": 0.5,
    "roll_inertia_kgm2": 0.06,  # over the rate against roll: a day's springs and tyres, who sits where, the tank
}
"""Chosen: standard deviations of logarithms, from changes of road, load and day and from calibration."""

MOST_MOUNT_CHANGE: Final = {"sensor_left_m": 0.1, "gyro_yaw_rad": 0.09}
"""Chosen: a sensor that was moved, or turned by five degrees, since calibration. Roll shows this to a few millimetres
and tenths of a degree, but a load far to one side on another road can look like a part of it.
"""

FREE: Final = [INDEX[name] for name in FREE_STD]


@dataclass(frozen=True, slots=True)
class Sideways:
    """Centre of gravity (m) of the sprung mass, left of the centre line, given the load.

    own_variance (m2) is the error from the batch's length and road. moves (n,) is its derivative by each parameter of
    the vehicle, moves_with_load (2,) by payload (m/kg) and front share (m per 0..1). is_mount_changed: the sensor is
    not where, or not turned as, it was at calibration.
    """

    cg_left_m: float
    own_variance: float
    moves: F64
    moves_with_load: F64
    is_mount_changed: bool


@dataclass(frozen=True, slots=True)
class Place:
    """The result of the search over FREE and the place, with its covariance; the place is the last entry."""

    found: Found

    @property
    def cg_left_m(self) -> float:
        """Metres left of the centre line."""
        return float(self.found.x[-1])


def sought_sideways(rolling: Whittle, point: Point) -> Place:
    """The most probable place given the payload and front share of ``point``, starting from its place.

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
    """The place with its variance and derivatives."""
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
    """Deviation of a parameter of the mount by one Newton step, with the free parameters following; 0 without
    information.
    """
    slope, information = whole.towards(entry, free, found.covariance, whole.gradient[free])
    return -slope / information if information > 0.0 else 0.0


def _at(point: Point, x: F64) -> Point:
    theta = point.theta.copy()
    theta[FREE] = x[:-1]
    return Point(theta, point.payload_kg, point.front_share, float(x[-1]))


def _free(point: Point) -> list[int]:
    return [*FREE, len(point.theta) + 2]
