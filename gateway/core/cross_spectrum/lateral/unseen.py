"""What a load that lies sideways does to an answer that nobody can see it in: without a roll rate.

A sensor off the centre line takes the roll of such a load for heave. Where no roll rate tells, the answer carries it:
the load may lie anywhere across the floor, and the sensor where it was said to sit, or somewhere, if nobody said.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.likelihood import Point, Whittle
from gateway.core.cross_spectrum.model.parameters import (
    INDEX,
    PARAMETERS,
    ROLL_PARAMETERS,
    has_roll,
    is_positive,
    upright,
)
from gateway.core.cross_spectrum.model.usual_roll import TRACK_PER_WHEELBASE, usual_roll
from gateway.core.cross_spectrum.sensor_change import weighed
from gateway.records import F64

PAYLOAD_LEFT_PER_TRACK: Final = 1.0 / (3.0 * 3.0**0.5)
"""Standard deviation over the track's width: loads whose middle is evenly spread over its middle two thirds."""

MOST_FEEDBACK: Final = 0.5  # beyond, first order no longer tells; chosen, it doubles the standard deviation


def sideways_covariance(whittle: Whittle, point: Point, covariance: F64, calibration: CrossSpectrumCalibration) -> F64:
    """(2, 2) of payload (kg) and front share (0..1), from a place across the vehicle that is not seen.

    First order: load and share move by -C I_xy for each metre, with C the search's covariance and I_xy the information
    between what it fitted and the place, on average over the load a standard deviation to either side. By symmetry that
    is nothing for a sensor on the centre line.

    ``whittle`` is of two sensors, ``covariance`` (k, k) of what a search found at ``point``, without a roll in it.
    """
    width_m = calibration.track_width_m or TRACK_PER_WHEELBASE * calibration.wheelbase_m
    theta = _rolling(point.theta, calibration, width_m)
    there = Whittle(whittle.spectra, replace(calibration.ground, track_width_m=width_m))
    payload_kg = max(point.payload_kg, 0.0)
    cg_left_std_m = payload_kg * PAYLOAD_LEFT_PER_TRACK * width_m / (calibration.empty_mass_kg + payload_kg)

    def moves_at(cg_left_m: float) -> F64:
        rolling = Point(theta, point.payload_kg, point.front_share, cg_left_m)
        along: F64 = there.curvature(rolling, [*weighed(rolling), len(theta) + 2]).information[:-1, -1]
        return -(covariance @ along)[-2:]

    moves = 0.5 * (moves_at(-cg_left_std_m) + moves_at(cg_left_std_m))
    # the load that lies there is the true one: where the answer fell short of it, it is the larger
    feedback = min(abs(float(moves[0])) * cg_left_std_m / payload_kg, MOST_FEEDBACK) if payload_kg else 0.0
    widened: F64 = (cg_left_std_m / (1.0 - feedback)) ** 2 * np.outer(moves, moves)
    return widened


def _rolling(theta: F64, calibration: CrossSpectrumCalibration, width_m: float) -> F64:
    """theta (n,) with how the vehicle rolls: as calibrated, else as vehicles do; the sensor as far off as it may be."""
    left_m = float(np.hypot(calibration.sensor_left_m, calibration.sensor_left_std_m))
    if has_roll(calibration.parameters):
        roll = calibration.parameters[len(PARAMETERS) :]
    else:
        usual = usual_roll(calibration.empty_mass_kg, width_m)
        roll = np.array([usual.get(name, _SILENT if is_positive(name) else 0.0) for name in ROLL_PARAMETERS])
    whole = np.r_[upright(theta), roll]
    whole[INDEX["sensor_left_m"]] = left_m
    return np.asarray(whole, np.float64)


_SILENT: Final = -30.0  # the logarithm of the slack and noise of a sensor that is not there
