"""How loud the sensors themselves are: what a batch reads above the frequencies at which a vehicle moves.

    floor_of(batch)                            power densities of its sensors between 16.5 and 20 Hz
    usual_floor(batches, with_roll=...)        the quietest and the loudest of a calibration
    noise_over(floor, expected)                what a sensor adds that has become noisy

Springs, wheels and tyres leave little up there, so that a sensor that has become noisy shows, and by how much.
Vibration of the drive train does too: a floor counts as noise only where it is far above all that calibration heard.
"""

from collections.abc import Iterable
from typing import Final

import numpy as np

from gateway.core.cross_spectrum.model.reading import Reading
from gateway.core.spectrum import frequencies_hz, segment_starts, segment_transforms
from gateway.records import F64, Batch, Bool

FLOOR_BAND_HZ: Final = (16.5, 20.0)  # above what is weighed, and the low-pass before the grid lets it through
NOISY_FROM: Final = 4.0  # times the power that is expected at most: twice the amplitude; chosen
NOISY_RATIO: Final = NOISY_FROM**0.5
SEGMENT_N: Final = 256
SENSOR_OF: Final = {
    "noise_acceleration_ratio": "the accelerometer is",
    "noise_pitch_rate_ratio": "the gyro's pitch rate is",
    "noise_roll_rate_ratio": "the gyro's roll rate is",
}
"""By diagnostic, in the order of a floor: how loud a sensor is over what is expected at most, in amplitude."""

UsualFloor = tuple[tuple[float, float], ...]
"""By sensor, the quietest and the loudest batch of a calibration."""


def floor_of(batch: Batch) -> F64:
    """(p,) in the square of each sensor's unit per hertz; NaN where no segment fits between the gaps.

    The median over segments and frequencies, that of an exponential distribution being log 2 times its mean: tones of
    engine and wheels, and potholes, are few.
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
    """Of a calibration's batches; None where they do not tell. The roll rate is left out where it is not used."""
    floors = [floor_of(batch) for batch in batches]
    n_sensors = min((3 if with_roll else 2, *(len(one) for one in floors))) if floors else 0
    by_sensor = np.array([one[:n_sensors] for one in floors]).T
    if not n_sensors or not np.isfinite(by_sensor).any(axis=1).all():
        return None
    quietest, loudest = np.nanmin(by_sensor, axis=1), np.nanmax(by_sensor, axis=1)
    return tuple(zip(quietest.tolist(), loudest.tolist(), strict=True)) if np.all(quietest > 0.0) else None


def expected_floor(usual: UsualFloor, times: float) -> F64:
    """(p,) the loudest that a sensor may be that nobody touched, where the vehicle moves with ``times`` the power that
    it had in calibration: its own noise stays, and what it heard of the vehicle grows with that.
    """
    quietest, loudest = np.array(usual).T
    found: F64 = quietest + (loudest - quietest) * max(1.0, times)
    return found


def noise_over(floor: F64, expected: F64) -> F64:
    """(p,) by how much more than that each sensor sounds; 0 where it may be vibration yet."""
    n = min(len(floor), len(expected))
    over = np.where(floor[:n] > NOISY_FROM * expected[:n], floor[:n] - expected[:n], 0.0)
    return np.pad(over, (0, len(floor) - n))


def as_read(noise: F64, reading: Reading, freq_hz: F64, *, with_roll: bool) -> F64:
    """(p, m) at freq_hz (m,) of ``noise`` (p,) as the spectra hold it: bringing a sensor to the centre line puts the
    noise of the roll rate into the acceleration, by the lever arm times the frequency, and some into the pitch rate.
    """
    found = np.repeat(noise[: 3 if with_roll else 2, None], len(freq_hz), axis=1)
    if with_roll and reading.mount is not None:
        found[0] += noise[2] * (2.0 * np.pi * freq_hz * reading.mount.left_m) ** 2
        found[1] += noise[2] * reading.mount.yaw_rad**2
    return found
