"""What a load that lies sideways does to an answer that nobody can see it in: without a roll rate.

A sensor off the centre line takes the roll of such a load for heave. Where no roll rate tells, the answer carries it:
the load may lie anywhere across the floor, and the sensor where it was said to sit, or somewhere, if nobody said.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np

from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.likelihood import Point
from gateway.core.cross_spectrum.measured import CrossSpectra
from gateway.core.cross_spectrum.model.expected import expected_of_driven
from gateway.core.cross_spectrum.model.parameters import (
    INDEX,
    PARAMETERS,
    ROLL_PARAMETERS,
    has_roll,
    is_positive,
    upright,
)
from gateway.core.cross_spectrum.model.slopes import solved_at
from gateway.core.cross_spectrum.model.usual_roll import TRACK_PER_WHEELBASE, usual_roll
from gateway.records import F64

PAYLOAD_LEFT_PER_TRACK: Final = 0.95 / 3.0 / 1.96
"""Over the track's width: loads whose middle is evenly spread over its middle two thirds. A Gaussian of this standard
deviation has the same 95 % interval; the even spread's own, 1 / (3 sqrt 3), would make it wider by a fifth.
"""


MOST_FEEDBACK: Final = 0.5  # beyond, proportion no longer holds; chosen, it doubles the standard deviation


def sideways_columns(
    spectra: CrossSpectra, point: Point, calibration: CrossSpectrumCalibration, weigh: Callable[[CrossSpectra], F64]
) -> F64:
    """(k, 2) by how much payload (kg) and front share (0..1) move with a place across the vehicle that is not seen.

    ``point`` is the answer to ``spectra``, and ``weigh`` finds payload and share (2,) in others not far from it. It is
    handed what the sensors would read with the load a standard deviation to either side: half of what the two answers
    differ by is what such a load does. By symmetry that is nothing for a sensor on the centre line. Where calibration
    knows how the vehicle rolls, what both have in common counts too: a load to either side couples roll with the rest.
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
    """``moved`` (2,) under the load that truly lies so: where the answer fell short of it, it moves by more."""
    feedback = min(abs(float(moved[0])) / payload_kg, MOST_FEEDBACK)
    return moved / (1.0 - feedback)


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
