"""Tests whether the sensor is as it was at calibration: its place, its orientation and its gain.

    scores_of(...)      score tests of the batch against fixed parameters, in standard deviations
    gain_moves(...)     derivative of the answer by the accelerometer's gain
    gyro_gain_ratio(..) the gyro's gain over that in calibration, from bends

A sensor that was moved along the vehicle, or whose gain changed, makes the half-car prefer another sensor position; one
that was moved sideways or turned mixes roll into its signals, which the half-car can only explain as noise. A score
test (C. R. Rao, Proc. Camb. Phil. Soc. 44, 1948) checks this at the answer without another search: the slope towards
the parameter, with all free parameters following, over its standard deviation.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.drift import DRIFTING, STEADY
from gateway.core.cross_spectrum.likelihood import Curvature, Point, Whittle
from gateway.core.cross_spectrum.model.parameters import INDEX, PARAMETERS
from gateway.records import F64
from gateway.units import STANDARD_GRAVITY_MPS2

FITTED: Final = [*DRIFTING, len(PARAMETERS), len(PARAMETERS) + 1]  # of all parameters, then payload and front share


def weighed(point: Point) -> list[int]:
    """Entries of FITTED for a curvature at ``point``: those of the load come after all of theta."""
    return [*DRIFTING, len(point.theta), len(point.theta) + 1]


MOST_GYRO_GAIN_SCORE: Final = 3.5
"""Chosen: standard deviations; chance exceeds it once in two thousand batches."""

TEMPERATURE_STD_K: Final = 15.0  # of the sensor between its calibration and any other day of the year; chosen
GAIN_PER_K: Final = 2e-4  # of each sensor (data sheets of MPU-6050, BMI160)
OFFSET_PER_K_MPS2: Final = 0.01  # 1 mg (likewise)
GAIN_STD: Final = TEMPERATURE_STD_K * GAIN_PER_K * 2.0**0.5
"""Standard deviation of the logarithm of the ratio of both sensors' gains."""
MOST_GRAVITY_CHANGE_MPS2: Final = (
    2.576 * TEMPERATURE_STD_K * float(np.hypot(OFFSET_PER_K_MPS2, GAIN_PER_K * STANDARD_GRAVITY_MPS2))
)
"""The temperature of one healthy day in a hundred changes gravity by more, 0.39 m/s2, by the three constants above."""

MOST_GYRO_NOISE: Final = float(np.log(3.0))
"""Chosen: largest increase of the pitch rate's noise (logarithm of its power) while the floor above the vehicle's
frequencies is quiet. Recorded drives of four vans stay below 0.8; a gyro turned by 6 degrees shows 1.0 to 2.8, because
the roll that leaks into it is limited to the vehicle's frequencies.
"""
QUIET: Final = 2.0**0.5
"""Chosen: amplitude over the largest expected, above which the floor shows that the gyro itself has become noisier."""

MOST_LAG_CHANGE_S: Final = 0.03
"""Chosen: largest change of the gyro's lag since calibration. A sensor that is 50 ms late can still be fitted, but with
a noise that hides the load.
"""

STEP: Final = 1e-3  # chosen: relative step of a difference quotient


@dataclass(frozen=True, slots=True)
class SensorScores:
    """Scores in standard deviations: towards another sensor position, and towards more noise in the acceleration."""

    position: float
    noise: float

    def is_changed(self, calibration: CrossSpectrumCalibration) -> bool:
        """True if neither chance nor the half-car's errors in calibration explain the scores."""
        return abs(self.position) > calibration.most_position_score or self.noise > calibration.most_noise_score


def off_calibration(point: Point, calibration: CrossSpectrumCalibration, name: str) -> float:
    """Deviation of a parameter from its calibration at ``point``, in its unit or as a logarithm."""
    return float(point.theta[INDEX[name]] - calibration.parameters[INDEX[name]])


def is_gyro_turned(point: Point, calibration: CrossSpectrumCalibration, loudness: F64) -> bool:
    """True if the pitch rate has more noise only within the vehicle's frequencies, so that roll must leak into it.

    ``point`` is the answer, ``loudness`` (p,) each sensor's noise above these frequencies. Without a roll rate the
    noise is fixed as calibrated, and this is never true.
    """
    found = off_calibration(point, calibration, "noise_pitch_rate_rad2ps")
    return found > MOST_GYRO_NOISE and not np.any(loudness[1:2] > QUIET)


def is_gyro_late(point: Point, calibration: CrossSpectrumCalibration) -> bool:
    """True if the gyro lags, or leads, by more than a change of its filter explains. ``point`` is the answer."""
    return abs(off_calibration(point, calibration, "gyro_lag_s")) > MOST_LAG_CHANGE_S


def scores_of(
    whole: Curvature, point: Point, covariance: F64, calibration: CrossSpectrumCalibration, precision: F64
) -> SensorScores:
    """The score tests; ``whole`` is the curvature at ``point`` for every parameter and the load, ``covariance`` that of
    FITTED, ``precision`` the prior precision of the drifting parameters.
    """
    pull = whole.gradient[FITTED].copy()
    pull[: len(DRIFTING)] += precision @ (point.theta - calibration.parameters)[DRIFTING]
    across = whole.information[np.ix_(FITTED, STEADY)]
    left_open = calibration.covariance[np.ix_(STEADY, STEADY)]

    def score(name: str) -> float:
        entry = INDEX[name]
        slope, information = whole.towards(entry, FITTED, covariance, pull)
        if not information > 0.0:
            return 0.0
        by_steady = whole.information[entry, STEADY] - whole.information[entry, FITTED] @ covariance @ across
        return float(-slope / np.sqrt(information + by_steady @ left_open @ by_steady))

    return SensorScores(score("sensor_position_m"), score("noise_acceleration_m2ps3"))


def gain_moves(whole: Curvature, whittle: Whittle, point: Point, covariance: F64) -> F64:
    """(k,) derivative of drifting parameters and load by the logarithm of the accelerometer's gain."""
    stronger = whittle.showing(whittle.spectra.with_acceleration_times(1.0 + STEP))
    there = stronger.curvature(point, weighed(point)).gradient
    moves: F64 = -covariance @ (there - whole.gradient[FITTED]) / np.log1p(STEP)
    return moves


def gyro_gain_ratio(
    gain: tuple[float, float] | None, calibrated: tuple[float, float] | None
) -> tuple[float, float] | None:
    """The gyro's gain over that in calibration, and its standard deviation; None if bends did not give both."""
    if gain is None or calibrated is None:
        return None
    ratio = gain[0] / calibrated[0]
    return ratio, float(np.hypot(gain[1], calibrated[1] * ratio)) / calibrated[0]


def is_gyro_gain_changed(ratio: tuple[float, float] | None) -> bool:
    """True if neither chance nor temperature explains the ratio."""
    return ratio is not None and abs(ratio[0] - 1.0) > MOST_GYRO_GAIN_SCORE * float(np.hypot(ratio[1], GAIN_STD))


def gain_of(gravity_mps2: float, calibrated_mps2: float | None) -> tuple[float, float]:
    """Logarithm of the accelerometer's gain over that in calibration, and its standard deviation.

    Gravity shows gain and offset together; data sheets give the gain's part of a change.
    """
    if calibrated_mps2 is None:
        return 0.0, GAIN_STD
    of_gain, of_offset = GAIN_PER_K, OFFSET_PER_K_MPS2 / calibrated_mps2
    believed = of_gain**2 / (of_gain**2 + of_offset**2)
    log_gain = float(np.log(gravity_mps2 / calibrated_mps2))
    return believed * log_gain, float(np.sqrt(GAIN_STD**2 - believed * (TEMPERATURE_STD_K * GAIN_PER_K) ** 2))
