"""Made-up drives as frames on a bus, for whatever signal map."""

import numpy as np

from gateway.bus.signals import load_signal_map
from gateway.records import F64, Frames, Signal
from support.encoded import encode_signals

START_NS = 1_790_000_000_000_000_000


def bus_drive(duration_s: float, seed: int, signals: str = "springscale:reference", start_ns: int = START_NS) -> Frames:
    """A van at 50 km/h as its two sensors hear it: coloured noise, one source and its delayed echo."""
    rng = np.random.default_rng(seed)
    n = round(100 * duration_s)
    road = np.convolve(rng.standard_normal(n + 40), np.hanning(12), mode="same")
    acceleration, pitch_rate = 0.3 * road[20 : n + 20], 0.03 * (road[20 : n + 20] - road[:n])
    speed = 13.9 + 0.1 * rng.standard_normal(round(5 * duration_s))
    return _frames(signals, start_ns, acceleration, pitch_rate, speed)


def white_noise(duration_s: float, start_ns: int, seed: int, speed_mps: float = 15.0) -> Frames:
    """White noise on both sensors at 15 m/s: enough for a regression that always answers the same."""
    rng = np.random.default_rng(seed)
    n = round(100 * duration_s)
    acceleration, pitch_rate = 0.5 * rng.standard_normal(n), 0.02 * rng.standard_normal(n)
    speed = np.maximum(0.0, speed_mps + 0.1 * rng.standard_normal(round(5 * duration_s)))
    return _frames("springscale:reference", start_ns, acceleration, pitch_rate, speed)


def _frames(signals: str, start_ns: int, acceleration_mps2: F64, pitch_rate_radps: F64, speed_mps: F64) -> Frames:
    """Acceleration, gravity not in it yet, and pitch rate at 100 Hz; speed at 5 Hz."""
    t_ns = start_ns + np.arange(len(acceleration_mps2)) * 10_000_000
    gps_ns = start_ns + np.arange(len(speed_mps)) * 200_000_000
    return encode_signals(
        load_signal_map(signals),
        {Signal.VERTICAL_ACCELERATION: t_ns, Signal.PITCH_RATE: t_ns, Signal.SPEED: gps_ns},
        {
            Signal.VERTICAL_ACCELERATION: 9.81 + acceleration_mps2,
            Signal.PITCH_RATE: pitch_rate_radps,
            Signal.SPEED: speed_mps,
        },
    )
