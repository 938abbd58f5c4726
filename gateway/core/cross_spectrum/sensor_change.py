"""Is the sensor still where and what it was when it was calibrated? What one batch can tell of it.

    scores_of(...)      how strongly the batch pulls at what a calibration takes as fixed, in standard deviations
    gain_moves(...)     by how much the answer moves with the gain of the accelerometer
    gyro_gain_ratio(..) the gyro's gain over that in calibration, by bends

A sensor that was moved along the vehicle, or whose gain changed, makes the half-car want another sensor position;
one that was moved sideways or turned mixes roll into what it reads, which the half-car can only take for noise. A
score test (C. R. Rao, Proc. Camb. Phil. Soc. 44, 1948) asks this of the likelihood at the answer, without
another search: the slope towards the parameter, all that the search left free moving along, over its own
standard deviation.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.drift import DRIFTING, STEADY
from gateway.core.cross_spectrum.likelihood import Curvature, Point, Whittle
from gateway.core.cross_spectrum.model.parameters import INDEX, PARAMETERS
from gateway.records import F64

FITTED: Final = [*DRIFTING, len(PARAMETERS), len(PARAMETERS) + 1]  # of all parameters, then payload and front share


def weighed(point: Point) -> list[int]:
    """Where FITTED stand in what a curvature at ``point`` may leave free: the load comes after all of theta."""
    return [*DRIFTING, len(point.theta), len(point.theta) + 1]


MOST_GRAVITY_CHANGE_MPS2: Final = 0.35
"""Offsets of such sensors move by 0.1 m/s2 (standard deviation) from day to day; so much is a gain off by 3.6 %."""

MOST_GYRO_GAIN_SCORE: Final = 3.5
"""Standard deviations; chance exceeds it once in two thousand batches."""

TEMPERATURE_STD_K: Final = 15.0  # of the sensor between its calibration and any other day of the year; chosen
GAIN_PER_K: Final = 2e-4  # of each sensor (data sheets of MPU-6050, BMI160)
OFFSET_PER_K_MPS2: Final = 0.01  # 1 mg (likewise)
GAIN_STD: Final = TEMPERATURE_STD_K * GAIN_PER_K * 2.0**0.5
"""Of the logarithm of the ratio of both sensors' gains."""

MOST_GYRO_NOISE: Final = float(np.log(3.0))
"""By how much the pitch rate's own noise may lie above the calibrated (logarithm of its power) where the floor above
the vehicle's frequencies is as quiet as ever. Recorded drives of four vans stay below 0.8; a gyro turned by 6 degrees
shows 1.0 to 2.8, for the roll that leaks into it ends where the vehicle's motion does. Chosen.
"""
QUIET: Final = (
    2.0**0.5
)  # amplitude over what is expected at most, from which a floor shows that the gyro itself has become noisier

MOST_LAG_CHANGE_S: Final = 0.03
"""By how much the gyro may come later or earlier than it was calibrated. A sensor that is 50 ms late can still be
fitted, at the price of a noise that hides the load. Chosen.
"""

STEP: Final = 1e-3


@dataclass(frozen=True, slots=True)
class SensorScores:
    """In standard deviations: towards another sensor position, and towards more noise in the acceleration."""

    position: float
    noise: float

    def is_changed(self, calibration: CrossSpectrumCalibration) -> bool:
        """True where chance, and the errors that the half-car showed in calibration, do not explain them."""
        return abs(self.position) > calibration.most_position_score or self.noise > calibration.most_noise_score


def off_calibration(point: Point, calibration: CrossSpectrumCalibration, name: str) -> float:
    """By how much a parameter lies above its calibration at ``point``, in its unit or as a logarithm."""
    return float(point.theta[INDEX[name]] - calibration.parameters[INDEX[name]])


def is_gyro_turned(point: Point, calibration: CrossSpectrumCalibration, loudness: F64) -> bool:
    """True where the pitch rate holds noise within the vehicle's frequencies alone: roll must leak into it.

    ``point`` is the answer, ``loudness`` (p,) how loud each sensor is above these frequencies. Without a roll rate the
    noise is held where calibration has it, and this is never so.
    """
    found = off_calibration(point, calibration, "noise_pitch_rate_rad2ps")
    return found > MOST_GYRO_NOISE and not np.any(loudness[1:2] > QUIET)


def is_gyro_late(point: Point, calibration: CrossSpectrumCalibration) -> bool:
    """True where the gyro lags, or leads, by more than a change of its filter explains. ``point`` is the answer."""
    return abs(off_calibration(point, calibration, "gyro_lag_s")) > MOST_LAG_CHANGE_S


def scores_of(
    whole: Curvature, point: Point, covariance: F64, calibration: CrossSpectrumCalibration, precision: F64
) -> SensorScores:
    """``whole`` is the curvature at ``point`` for every parameter and the load, ``covariance`` that of FITTED,
    ``precision`` that of the drifting parameters beforehand.
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
    """(k,) by how much drifting parameters and load move for each unit of the logarithm of the accelerometer's gain."""
    stronger = Whittle(whittle.spectra.with_acceleration_times(1.0 + STEP), whittle.ground)
    there = stronger.curvature(point, weighed(point)).gradient
    moves: F64 = -covariance @ (there - whole.gradient[FITTED]) / np.log1p(STEP)
    return moves


def gyro_gain_ratio(
    gain: tuple[float, float] | None, calibrated: tuple[float, float] | None
) -> tuple[float, float] | None:
    """The gyro's gain over that in calibration, and its standard deviation; None where bends did not tell both."""
    if gain is None or calibrated is None:
        return None
    ratio = gain[0] / calibrated[0]
    return ratio, float(np.hypot(gain[1], calibrated[1] * ratio)) / calibrated[0]


def is_gyro_gain_changed(ratio: tuple[float, float] | None) -> bool:
    """True where neither chance nor temperature explains it."""
    return ratio is not None and abs(ratio[0] - 1.0) > MOST_GYRO_GAIN_SCORE * float(np.hypot(ratio[1], GAIN_STD))


def gain_of(gravity_mps2: float, calibrated_mps2: float | None) -> tuple[float, float]:
    """Logarithm of the accelerometer's gain over that in calibration, and its standard deviation.

    Gravity shows the gain and the offset together; the data sheets say how much of a change is the gain's.
    """
    if calibrated_mps2 is None:
        return 0.0, GAIN_STD
    of_gain, of_offset = GAIN_PER_K, OFFSET_PER_K_MPS2 / calibrated_mps2
    believed = of_gain**2 / (of_gain**2 + of_offset**2)
    log_gain = float(np.log(gravity_mps2 / calibrated_mps2))
    return believed * log_gain, float(np.sqrt(GAIN_STD**2 - believed * (TEMPERATURE_STD_K * GAIN_PER_K) ** 2))
