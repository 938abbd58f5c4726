"""Made-up drives as frames on a bus, for whatever signal map."""

import numpy as np

from gateway.bus.signals import load_signal_map
from gateway.records import Frames, Signal
from support.encoded import encode_signals

START_NS = 1_790_000_000_000_000_000


def bus_drive(duration_s: float, seed: int, signals: str = "springscale:reference", start_ns: int = START_NS) -> Frames:
    """A van at 50 km/h as its two sensors hear it: coloured noise, one source and its delayed echo."""
    rng = np.random.default_rng(seed)
    n = round(100 * duration_s)
    road = np.convolve(rng.standard_normal(n + 40), np.hanning(12), mode="same")
    t_ns = start_ns + np.arange(n) * 10_000_000
    gps_ns = start_ns + np.arange(round(5 * duration_s)) * 200_000_000
    return encode_signals(
        load_signal_map(signals),
        {Signal.VERTICAL_ACCELERATION: t_ns, Signal.PITCH_RATE: t_ns, Signal.SPEED: gps_ns},
        {
            Signal.VERTICAL_ACCELERATION: 9.81 + 0.3 * road[20 : n + 20],
            Signal.PITCH_RATE: 0.03 * (road[20 : n + 20] - road[:n]),
            Signal.SPEED: 13.9 + 0.1 * rng.standard_normal(len(gps_ns)),
        },
    )


def white_noise(duration_s: float, start_ns: int, seed: int, speed_mps: float = 15.0) -> Frames:
    """White noise on both sensors at 15 m/s: enough for a regression that always answers the same."""
    rng = np.random.default_rng(seed)
    n = round(100 * duration_s)
    t_ns = start_ns + np.arange(n) * 10_000_000
    gps_ns = start_ns + np.arange(round(5 * duration_s)) * 200_000_000
    return encode_signals(
        load_signal_map("springscale:reference"),
        {Signal.VERTICAL_ACCELERATION: t_ns, Signal.PITCH_RATE: t_ns, Signal.SPEED: gps_ns},
        {
            Signal.VERTICAL_ACCELERATION: 9.81 + 0.5 * rng.standard_normal(n),
            Signal.PITCH_RATE: 0.02 * rng.standard_normal(n),
            Signal.SPEED: np.maximum(0.0, speed_mps + 0.1 * rng.standard_normal(len(gps_ns))),
        },
    )
