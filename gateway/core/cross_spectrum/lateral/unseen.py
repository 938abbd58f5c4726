"""The effect of an unknown lateral place on the estimate, without a roll rate.

A sensor off the centre line reads the roll of such a load as heave. Without a roll rate the interval includes this: the
load may be anywhere across the floor, and the sensor where it was stated, or anywhere plausible.
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
"""Chosen, over the track's width: load centres uniform over its middle two thirds. A Gaussian of this standard
deviation has the same 95 % interval; the uniform's own, 1 / (3 sqrt 3), would make it wider by a fifth.
"""


MOST_FEEDBACK: Final = 0.5  # chosen: limit of the linear correction, where it doubles the standard deviation


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


_SILENT: Final = -30.0  # logarithm of slack and noise for an absent sensor: practically zero
