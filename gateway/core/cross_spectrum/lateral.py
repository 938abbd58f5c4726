"""The lateral place of the load: estimated from roll, or without a roll rate a part of the interval.

A load off the centre line makes the body roll as it heaves, and heave as it rolls. Once payload and front share are
known, the likelihood of all three sensors has one maximum over the place. Parameters that also affect roll are free:
the difference of the tracks, the spread of the payload, the day's roll inertia. The half-car's parameters are fixed:
errors of the roll model must not change the weight.

A sensor off the centre line reads the roll of such a load as heave. Without a roll rate the interval includes this: the
load may be anywhere across the floor, and the sensor where it was stated, or anywhere plausible.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.drift import DAY_OF_STEADY, DRIFTING, STEADY
from gateway.core.cross_spectrum.likelihood import Curvature, Point, Whittle
from gateway.core.cross_spectrum.measured import CrossSpectra
from gateway.core.cross_spectrum.model.expected import expected_of_driven
from gateway.core.cross_spectrum.model.parameters import (
    INDEX,
    PARAMETERS,
    ROLL_PARAMETERS,
    has_roll,
    is_positive,
    rolling_car,
    upright,
)
from gateway.core.cross_spectrum.model.rolling_car import SidewaysLoad, roll_share_front
from gateway.core.cross_spectrum.model.slopes import solved_at
from gateway.core.cross_spectrum.model.usual_roll import TRACK_PER_WHEELBASE, usual_roll
from gateway.core.cross_spectrum.search import Found, most_probable
from gateway.estimate import Estimate, Quantity
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
PAYLOAD_LEFT_PER_TRACK: Final = 0.95 / 3.0 / 1.96
"""Chosen, over the track's width: load centres uniform over its middle two thirds. A Gaussian of this standard
deviation has the same 95 % interval; the uniform's own, 1 / (3 sqrt 3), would make it wider by a fifth.
"""
MOST_FEEDBACK: Final = 0.5  # chosen: limit of the linear correction, where it doubles the standard deviation
_SILENT: Final = -30.0  # logarithm of slack and noise for an absent sensor: practically zero
_STIFFNESSES: Final = tuple(
    INDEX[f"{kind}_{end}_npm"] for kind in ("spring", "anti_roll", "tyre") for end in ("front", "rear")
)
_STEP: Final = 1e-3  # chosen: of a logarithm, for a difference quotient


@dataclass(frozen=True, slots=True)
class Sideways:
    """Centre of gravity (m) of the sprung mass, left of the centre line, given the load.

    own_variance (m2) is the error from the batch's length and road. moves (n,) is its derivative by each parameter of
    the vehicle, moves_with_load (2,) by payload (m/kg) and front share (m per 0..1). day (c,) is its change with each
    of the day's causes under the same load. is_mount_changed: the sensor is not where, or not turned as, it was at
    calibration.
    """

    cg_left_m: float
    own_variance: float
    moves: F64
    moves_with_load: F64
    day: F64
    is_mount_changed: bool


@dataclass(frozen=True, slots=True)
class Place:
    """The result of the search over FREE and the place, with its covariance; the place is the last entry."""

    found: Found

    @property
    def cg_left_m(self) -> float:
        """Metres left of the centre line."""
        return float(self.found.x[-1])


def most_probable_place(rolling: Whittle, point: Point) -> Place:
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


def sideways_at(rolling: Whittle, place: Place, point: Point, drifted: F64) -> Sideways:
    """The place with its variance and derivatives; ``drifted`` (c, k) is the change of the drifting parameters with
    each of the day's causes.
    """
    there, n, found = _at(point, place.found.x), len(point.theta), place.found
    whole = rolling.curvature(there, range(n + 3))
    moves = -found.covariance[-1] @ whole.information[_free(there)]
    day = drifted @ moves[DRIFTING]
    day[: DAY_OF_STEADY.shape[1]] += moves[STEADY] @ DAY_OF_STEADY
    moves[[*FREE, *DRIFTING]] = 0.0
    return Sideways(
        cg_left_m=place.cg_left_m,
        own_variance=float(found.covariance[-1, -1]),
        moves=moves[:n],
        moves_with_load=moves[n : n + 2],
        day=day,
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


def with_roll_share(answer: Estimate, point: Point, calibration: CrossSpectrumCalibration) -> Estimate:
    """``answer`` with the axles' shares of a roll moment at the load of ``point``."""
    stiffness = _roll_share_front(point, calibration)
    return replace(answer, roll_share_front=stiffness.number, roll_share_front_std=stiffness.std)


def _roll_share_front(point: Point, calibration: CrossSpectrumCalibration) -> Quantity:
    """The part of a roll moment that the front axle takes, from springs, bars and tyres as calibrated."""
    load = SidewaysLoad(point.payload_kg, point.front_share, point.cg_left_m)

    def share(theta: F64) -> float:
        return float(np.squeeze(roll_share_front(rolling_car(theta, calibration.ground), load)))

    entries = list(_STIFFNESSES)
    here = share(point.theta)
    moved = point.theta + _STEP * np.eye(len(point.theta))[entries]
    slopes = np.array([share(one) - here for one in moved]) / _STEP
    return Quantity(here, math.sqrt(float(slopes @ calibration.covariance[np.ix_(entries, entries)] @ slopes)))


def sideways_columns(
    spectra: CrossSpectra, point: Point, calibration: CrossSpectrumCalibration, weigh: Callable[[CrossSpectra], F64]
) -> F64:
    """(k, 2) change of payload (kg) and front share (0..1) with the unknown lateral place, one standard deviation.

    ``point`` is the answer to ``spectra``, and ``weigh`` finds payload and share (2,) in similar spectra. It gets the
    model's spectra with the load a standard deviation to either side; half of the difference of both answers is the
    column. By symmetry it is zero for a sensor on the centre line. If calibration knows the vehicle's roll, the part
    common to both sides counts too: a load on either side couples roll with heave and pitch.
    """
    width_m = calibration.track_width_m or TRACK_PER_WHEELBASE * calibration.wheelbase_m
    theta = _rolling(point.theta, calibration, width_m)
    ground = replace(calibration.ground, track_width_m=width_m)
    payload_kg = max(point.payload_kg, 0.0)
    cg_left_std_m = payload_kg * PAYLOAD_LEFT_PER_TRACK * width_m / (calibration.empty_mass_kg + payload_kg)

    def weighed_at(cg_left_m: float) -> F64:
        model, by = solved_at(theta, (point.payload_kg, point.front_share, cg_left_m), ground, spectra)
        return weigh(spectra.showing(expected_of_driven(by, model, spectra)))

    if not payload_kg:
        return np.zeros((1, 2))
    left, right = weighed_at(cg_left_std_m), weighed_at(-cg_left_std_m)
    columns = [0.5 * (left - right)]
    if has_roll(calibration.parameters):
        columns.append(0.5 * (left + right) - (point.payload_kg, point.front_share))
    return np.array([_of_true_load(moved, payload_kg) for moved in columns])


def _of_true_load(moved: F64, payload_kg: float) -> F64:
    """``moved`` (2,) relative to the true load: where the answer is too small, the change is larger."""
    feedback = min(abs(float(moved[0])) / payload_kg, MOST_FEEDBACK)
    return moved / (1.0 - feedback)


def _rolling(theta: F64, calibration: CrossSpectrumCalibration, width_m: float) -> F64:
    """theta (n,) with roll parameters: as calibrated, else usual ones; the sensor as far off the line as it may be."""
    left_m = float(np.hypot(calibration.sensor_left_m, calibration.sensor_left_std_m))
    if has_roll(calibration.parameters):
        roll = calibration.parameters[len(PARAMETERS) :]
    else:
        usual = usual_roll(calibration.empty_mass_kg, width_m)
        roll = np.array([usual.get(name, _SILENT if is_positive(name) else 0.0) for name in ROLL_PARAMETERS])
    whole = np.r_[upright(theta), roll]
    whole[INDEX["sensor_left_m"]] = left_m
    return np.asarray(whole, np.float64)
