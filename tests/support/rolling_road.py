"""A batch of exact spectra with a roll rate: sensors of a known rolling car over two tracks of one road."""

from dataclasses import replace

import numpy as np

from gateway.calibration.half_car.fit import calibrate_cross_spectrum
from gateway.calibration.known_run import KnownRun
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.model.rolling_car import RollingCar, SidewaysLoad, rolling_response
from gateway.records import Batch
from support.half_car_road import RATE_HZ, VAN, batch_of
from support.kept import kept
from support.rolling_car import HALF_TRACK_M, ROLLING_CAR

KNOWN_ROLLING = ((0.0, 52.0, 0.0), (300.0, 46.0, 0.0))  # payload (kg), front share (%), to the left (m)
WIDE_VAN = replace(VAN, track_width_m=2.0 * HALF_TRACK_M, sensor_offset_left_m=0.3, sensor_offset_left_std_m=0.02)


def batch_over_two_tracks(
    payload_kg: float,
    front_share_pct: float,
    cg_left_m: float,
    seed: int,
    duration_s: float = 300.0,
    speed_mps: float = 14.0,
    noise: float = 0.02,
    car: RollingCar = ROLLING_CAR,
    shaken_mps2: float = 0.8,
) -> Batch:
    """Constant speed; ``shaken_mps2`` is the acceleration's standard deviation.

    The tracks differ more the shorter the waves are.
    """
    rng = np.random.default_rng(seed)
    n = int(duration_s * RATE_HZ)
    freq_hz = np.fft.rfftfreq(n, 1.0 / RATE_HZ)[1:]
    shape = (2, len(freq_hz))
    mean, half_difference = (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / freq_hz
    alike = np.exp(-np.pi * freq_hz / speed_mps * 2.0 * car.half_track_m)
    half_difference = half_difference * np.sqrt((1.0 - alike) / (1.0 + alike))
    r = rolling_response(car, SidewaysLoad(payload_kg, front_share_pct / 100.0, cg_left_m), freq_hz)
    later = np.exp(-2j * np.pi * freq_hz * car.half_car.wheelbase_m / speed_mps)
    sensed = (r.together_front + r.together_rear * later) * mean
    sensed = sensed + (r.against_front + r.against_rear * later) * half_difference
    sensed = sensed * ((freq_hz > 0.5) & (freq_hz < 22.0))
    signals = np.fft.irfft(np.concatenate([np.zeros((3, 1)), sensed], axis=1), n, axis=1)
    signals *= shaken_mps2 / signals[0].std()
    signals = signals + noise * signals.std(axis=1, keepdims=True) * rng.standard_normal(signals.shape)
    batch = batch_of(signals[0], signals[1], np.full(n, speed_mps))
    return replace(batch, roll_rate_radps=signals[2])


def runs_over_two_tracks() -> list[KnownRun]:
    """A short drive with each of KNOWN_ROLLING."""
    return [
        KnownRun(i, f"run {i}", *load[:2], (batch_over_two_tracks(*load, seed=50 + i, duration_s=120.0),))
        for i, load in enumerate(KNOWN_ROLLING)
    ]


@kept
def calibrated_with_roll() -> CrossSpectrumCalibration:
    """From those drives."""
    return calibrate_cross_spectrum(runs_over_two_tracks(), WIDE_VAN)
