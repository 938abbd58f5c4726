"""The noise of the sensors themselves, read above the frequencies of the vehicle's movement.

    floor_of(batch)                            power densities of its sensors between 16.5 and 20 Hz
    usual_floor(batches, with_roll=...)        the quietest and the loudest of a calibration
    noise_over(floor, expected)                the excess of a noisy sensor

Springs, wheels and tyres move little at these frequencies, so the noise of a sensor shows there. Vibration of the drive
train shows too: a floor counts as noise only far above everything that calibration saw.
"""

from collections.abc import Iterable
from typing import Final

import numpy as np

from gateway.core.cross_spectrum.model.reading import Reading
from gateway.core.spectrum import frequencies_hz, segment_starts, segment_transforms
from gateway.records import F64, Batch, Bool

FLOOR_BAND_HZ: Final = (16.5, 20.0)  # chosen: above the analysed band, within the pass-band of the low-pass
NOISY_FROM: Final = 4.0  # chosen: times the largest expected power, twice the amplitude
NOISY_RATIO: Final = NOISY_FROM**0.5  # the same in amplitude
SEGMENT_N: Final = 256  # chosen: 5 s at 50 Hz
SENSOR_OF: Final = {
    "noise_acceleration_ratio": "the accelerometer is",
    "noise_pitch_rate_ratio": "the gyro's pitch rate is",
    "noise_roll_rate_ratio": "the gyro's roll rate is",
}
"""Diagnostics in the order of a floor: a sensor's noise amplitude over the largest expected."""

UsualFloor = tuple[tuple[float, float], ...]
"""For each sensor, the quietest and the loudest batch of a calibration."""


def floor_of(batch: Batch) -> F64:
    """(p,) noise in the square of each sensor's unit per hertz; NaN if no segment fits between the gaps.

    The median over segments and frequencies, divided by log 2 (an exponential distribution): tones of engine and
    wheels, and potholes, are few and do not move it.
    """
    sensed = [batch.vertical_acceleration_mps2, batch.pitch_rate_radps]
    if batch.roll_rate_radps is not None:
        sensed.append(batch.roll_rate_radps)
    freq_hz = frequencies_hz(SEGMENT_N, batch.rate_hz)
    kept = (freq_hz >= FLOOR_BAND_HZ[0]) & (freq_hz <= FLOOR_BAND_HZ[1])
    return np.array([_floor(one, batch, kept) for one in sensed])


def _floor(x: F64, batch: Batch, kept: Bool) -> float:
    starts = segment_starts(batch.usable & np.isfinite(x), SEGMENT_N, SEGMENT_N)
    if not len(starts):
        return float("nan")
    transforms = segment_transforms(x, starts, SEGMENT_N, batch.rate_hz)[:, kept]
    return float(np.median(np.abs(transforms) ** 2) / np.log(2.0))


def usual_floor(batches: Iterable[Batch], *, with_roll: bool) -> UsualFloor | None:
    """The floor of a calibration's batches; None if unknown. The roll rate is left out if it is not used."""
    floors = [floor_of(batch) for batch in batches]
    n_sensors = min((3 if with_roll else 2, *(len(one) for one in floors))) if floors else 0
    by_sensor = np.array([one[:n_sensors] for one in floors]).T
    if not n_sensors or not np.isfinite(by_sensor).any(axis=1).all():
        return None
    quietest, loudest = np.nanmin(by_sensor, axis=1), np.nanmax(by_sensor, axis=1)
    return tuple(zip(quietest.tolist(), loudest.tolist(), strict=True)) if np.all(quietest > 0.0) else None


def expected_floor(usual: UsualFloor, times: float) -> F64:
    """(p,) largest expected floor of an untouched sensor when the vehicle moves with ``times`` the power of
    calibration: the sensor's own noise is constant, and the vehicle's vibration grows with the power.
    """
    quietest, loudest = np.array(usual).T
    found: F64 = quietest + (loudest - quietest) * max(1.0, times)
    return found


def noise_over(floor: F64, expected: F64) -> F64:
    """(p,) excess of each sensor over the expected floor; 0 if it may still be vibration."""
    n = min(len(floor), len(expected))
    over = np.where(floor[:n] > NOISY_FROM * expected[:n], floor[:n] - expected[:n], 0.0)
    return np.pad(over, (0, len(floor) - n))


def as_read(noise: F64, reading: Reading, freq_hz: F64, *, with_roll: bool) -> F64:
    """(p, m) ``noise`` (p,) at freq_hz (m,) as the spectra contain it.

    Moving a sensor to the centre line adds the roll rate's noise to the acceleration, times lever arm and frequency,
    and some of it to the pitch rate.
    """
    found = np.repeat(noise[: 3 if with_roll else 2, None], len(freq_hz), axis=1)
    if with_roll and reading.mount is not None:
        found[0] += noise[2] * (2.0 * np.pi * freq_hz * reading.mount.left_m) ** 2
        found[1] += noise[2] * reading.mount.yaw_rad**2
    return found
