"""Faults of the sensors that gravity, bends and the floor of the spectra show before anything is weighed."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.model.spectra import CrossSpectra, as_read, expected_floor, floor_of, noise_over
from gateway.model.vehicle_model import VehicleModel
from gateway.records import F64, Batch
from gateway.units import STANDARD_GRAVITY_MPS2

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
NOISE_RATIOS: Final = {
    "noise_acceleration_ratio": "the accelerometer is",
    "noise_pitch_rate_ratio": "the gyro's pitch rate is",
    "noise_roll_rate_ratio": "the gyro's roll rate is",
}
"""Diagnostics by sensor, in their order: its noise amplitude over the largest expected; with the words of a fault."""


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


def gyro_gain_ratio(
    gain: tuple[float, float] | None, calibrated: tuple[float, float] | None
) -> tuple[float, float] | None:
    """The gyro's gain over that in calibration, and its standard deviation; None if bends did not give both."""
    if gain is None or calibrated is None:
        return None
    ratio = gain[0] / calibrated[0]
    return ratio, float(np.hypot(gain[1], calibrated[1] * ratio)) / calibrated[0]


def is_changed(batch: Batch, model: VehicleModel) -> bool:
    """Whether gravity shows another gain or axis of the accelerometer, or bends another gain of the gyro."""
    usual_mps2 = model.gravity_mps2
    if usual_mps2 is not None and abs(batch.gravity_mps2 - usual_mps2) > MOST_GRAVITY_CHANGE_MPS2:
        return True
    ratio = gyro_gain_ratio(batch.gyro_gain, model.gyro_gain)
    return ratio is not None and abs(ratio[0] - 1.0) > MOST_GYRO_GAIN_SCORE * float(np.hypot(ratio[1], GAIN_STD))


@dataclass(frozen=True, slots=True, eq=False)
class Noise:
    """Noise of p sensors above the vehicle's frequencies: its excess (p,) over the expected, in the square of each unit
    per hertz, and loudness (p,), its amplitude over the largest expected.
    """

    excess: F64
    loudness: F64

    @property
    def is_there(self) -> bool:
        """True if a sensor is so noisy that the fit must include it."""
        return bool(self.excess.any())

    def on(self, spectra: CrossSpectra) -> F64 | None:
        """The level of each sensor (p, m) in these spectra; None if there is none."""
        if not self.is_there:
            return None
        return as_read(self.excess, spectra.reading, spectra.freq_hz[1:-1], with_roll=spectra.has_roll)


def noise_of(batch: Batch, spectra: CrossSpectra, model: VehicleModel) -> Noise:
    """The noise of the batch's sensors beside what calibration leads to expect at this amplitude of movement."""
    floor = floor_of(batch)
    times = (spectra.acceleration_rms_mps2 / model.acceleration_rms_mps2) ** 2
    expected = np.empty(0) if model.floor is None else expected_floor(model.floor, times)
    loudness: F64 = np.sqrt(floor[: len(expected)] / expected[: len(floor)])
    return Noise(noise_over(floor, expected), loudness)


def watched(batch: Batch, model: VehicleModel) -> dict[str, float]:
    """Diagnostics of the sensors that need no weighing."""
    ratio = gyro_gain_ratio(batch.gyro_gain, model.gyro_gain)
    return {} if ratio is None else {"gyro_gain_ratio": ratio[0], "gyro_gain_ratio_std": ratio[1]}
