"""The lateral place of the load: estimated from roll, or without a roll rate a part of the interval.

A load off the centre line makes the body roll as it heaves, and heave as it rolls. Once payload and front share are
known, the likelihood of all three sensors has one maximum over the place. Parameters that also affect roll are free:
the difference of the tracks, the spread of the payload, the day's roll inertia. The half-car's parameters are fixed:
errors of the roll model must not change the weight (docs/architecture.md).

A sensor off the centre line reads the roll of such a load as heave. Without a roll rate the interval includes this: the
load may be anywhere across the floor, and the sensor where it was stated, or anywhere plausible.
"""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway.core.vehicle import Load
from gateway.estimates.quantity import Quantity
from gateway.model import fit
from gateway.model.car import has_roll, roll_share_front
from gateway.model.table import INDEX, LOG, ROLL, N, prior_of_size
from gateway.model.vehicle_model import VehicleModel
from gateway.model.whittle import Point, Whittle
from gateway.records import F64

ROLL_BAND_HZ: Final = (1.1, 5.0)
"""Chosen: the band in which the body rolls on its springs; above it wheels, axles and seats are not modelled."""
CG_LEFT_STD_M: Final = 0.1
"""Chosen: of the whole sprung mass; a payload of a third of the empty mass, 0.3 m off the line, gives 0.075."""
FREE_STD: Final = {
    "twist_level": 0.3,
    "tracks_apart_m": 0.2,
    "payload_roll_gyration_m2": 0.5,
    "roll_inertia_kgm2": 0.06,  # over the rate against roll: a day's springs and tyres, who sits where, the tank
}
"""Chosen: standard deviations of logarithms, from changes of road, load and day and from calibration."""
MOST_MOUNT_CHANGE: Final = {"sensor_left_m": 0.1, "gyro_yaw_rad": 0.09}
"""Chosen: a sensor that was moved, or turned by five degrees. Roll shows this to a few millimetres and tenths of a
degree, but a load far to one side on another road can look like a part of it.
"""
FREE: Final = [INDEX[name] for name in FREE_STD]
PAYLOAD_LEFT_PER_TRACK: Final = 0.95 / 3.0 / 1.96
"""Chosen, over the track's width: load centres uniform over its middle two thirds. A Gaussian of this standard
deviation has the same 95 % interval.
"""
TRACK_PER_WHEELBASE: Final = 0.54  # chosen: for vans and cars, if not stated
_SILENT: Final = -30.0  # logarithm of slack and noise for an absent sensor: practically zero
_STIFFNESSES: Final = [
    INDEX[f"{kind}_{end}_npm"] for kind in ("spring", "anti_roll", "tyre") for end in ("front", "rear")
]
_STEP: Final = 1e-3  # chosen: of a logarithm, for a difference quotient


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """Centre of gravity (m) of the sprung mass left of the centre line, given the load, with its own variance (m2).

    moves (n,) is its derivative by each parameter of the vehicle, moves_with_load (2,) by payload (m/kg) and front
    share (m per 0..1). is_mount_changed: the sensor is not where, or not turned as, it was at calibration.
    """

    cg_left_m: float
    own_variance: float
    moves: F64
    moves_with_load: F64
    is_mount_changed: bool
    is_converged: bool


@dataclass(frozen=True, slots=True)
class _Rolling:
    """All three sensors, as a function of FREE and the place; payload, front share and all else as ``point`` has it."""

    whittle: Whittle
    point: Point

    def at(self, own: F64) -> Point:
        theta = self.point.theta.copy()
        theta[FREE] = own[:-1]
        return Point(theta, self.point.payload_kg, self.point.front_share, float(own[-1]))

    def cost(self, common: F64, own: F64) -> float:
        return self.whittle.cost(self.at(own))

    def curvature(self, common: F64, own: F64) -> tuple[F64, F64]:
        found = self.whittle.curvature(self.at(own), [*FREE, len(self.point.theta) + 2])
        return found.gradient, found.information


def search_of_place(rolling: Whittle, point: Point, start: F64 | None = None) -> fit.Found:
    """The most probable FREE and place, given all else as ``point`` has it: from ``start``, or from there.

    ``rolling`` is the likelihood of all three sensors.
    """
    usual = point.theta[FREE]
    precision = np.diag(np.r_[list(FREE_STD.values()), CG_LEFT_STD_M] ** -2.0)
    start = np.r_[usual, point.cg_left_m] if start is None else start
    return fit.climb(_Rolling(rolling, point), fit.Gaussian(np.r_[usual, 0.0], precision), start, tolerance=0.01)


def place_of(rolling: Whittle, point: Point, found: fit.Found) -> Place:
    """The result of the search of the place, ``found``, with what moves it."""
    there, n = _Rolling(rolling, point).at(found.own[0]), len(point.theta)
    free, covariance = [*FREE, n + 2], found.own_covariances[0]
    whole = rolling.curvature(there, range(n + 3))
    moves = -covariance[-1] @ whole.information[free]
    moves[FREE] = 0.0

    def off(name: str) -> float:
        """Deviation of a parameter of the mount by one Newton step, with the free parameters following."""
        entry = INDEX[name]
        along = whole.information[entry, free] @ covariance
        information = float(whole.information[entry, entry] - along @ whole.information[free, entry])
        slope = float(whole.gradient[entry] - along @ whole.gradient[free])
        return -slope / information if information > 0.0 else 0.0

    return Place(
        cg_left_m=float(found.own[0][-1]),
        own_variance=float(covariance[-1, -1]),
        moves=moves[:n],
        moves_with_load=moves[n : n + 2],
        is_mount_changed=any(abs(off(name)) > most for name, most in MOST_MOUNT_CHANGE.items()),
        is_converged=found.is_converged,
    )


def roll_share_of(point: Point, model: VehicleModel) -> Quantity:
    """The part of a roll moment that the front axle takes, from springs, bars and tyres as calibrated."""
    load = np.array(point.loaded)

    def share(theta: F64) -> float:
        return roll_share_front(theta, load, model.ground)

    here = share(point.theta)
    slopes = np.array([share(point.theta + _STEP * one) for one in np.eye(len(point.theta))[_STIFFNESSES]]) - here
    covariance = model.covariance[np.ix_(_STIFFNESSES, _STIFFNESSES)]
    return Quantity(here, math.sqrt(float(slopes @ covariance @ slopes)) / _STEP)


def spectra_of_sides(whittle: Whittle, point: Point, model: VehicleModel) -> tuple[F64, ...]:
    """The model's spectra with the load one standard deviation to the left, to the right, and on the centre line.

    ``point`` is the answer to the spectra of ``whittle``, which lack a roll rate. Empty without a payload, which lies
    nowhere.
    """
    payload_kg = max(point.payload_kg, 0.0)
    if not payload_kg:
        return ()
    width_m = model.track_width_m or TRACK_PER_WHEELBASE * model.wheelbase_m
    off_m = payload_kg * PAYLOAD_LEFT_PER_TRACK * width_m / (model.empty_mass_kg + payload_kg)
    theta = _rolling(point.theta, model, width_m)
    wide = Whittle(whittle.spectra, replace(model.ground, track_width_m=width_m))
    load = Load(point.payload_kg, 100.0 * point.front_share)
    return tuple(wide.expected(Point.of(theta, load, side * off_m)) for side in (1.0, -1.0, 0.0))


def _rolling(theta: F64, model: VehicleModel, width_m: float) -> F64:
    """theta (n,) with roll parameters: as calibrated, else usual ones; the sensor as far off the line as it may be."""
    if has_roll(model.parameters):
        roll = model.parameters[N:]
    else:
        roll = prior_of_size(ROLL, model.empty_mass_kg, width_m)
        silent = [row.scale == LOG and row.name.startswith(("slack", "noise")) for row in ROLL]
        roll = np.where(silent, _SILENT, roll)
    whole = np.r_[theta[:N], roll]
    whole[INDEX["sensor_left_m"]] = math.hypot(model.sensor_left_m, model.sensor_left_std_m)
    return np.asarray(whole, float)
