"""Encode a simulated recording as CAN frames: which DBC message carries which sensor reading."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np

from gateway.bus.frames import merge_frames, take
from gateway.bus.signals import SHIPPED_PREFIX, Encoder, load_signal_map
from gateway.errors import ConfigurationError
from gateway.records import F64, I64, Frames
from gateway.sim.instruments import Recording
from gateway.units import NS_PER_S

_DEG: Final = math.pi / 180.0  # radians
_KMH: Final = 1.0 / 3.6  # m/s

_X, _Y, _Z = 0, 1, 2


@dataclass(frozen=True, slots=True)
class Wire:
    """One message: DBC signal -> the reading it carries and the DBC's unit in SI.

    delay_ns is the time from the sample to the frame on the bus.
    """

    message: str
    signals: Mapping[str, tuple[str, float]]
    is_satellite: bool = False
    delay_ns: int = 0


_WIRING: Final[Mapping[str, tuple[Wire, ...]]] = MappingProxyType(
    {
        "reference": (
            Wire(
                "IMU_ACCEL",
                {
                    "AccelX": ("accel_x", 1.0),
                    "AccelY": ("accel_y", 1.0),
                    "AccelZ": ("accel_z", 1.0),
                    "AccelCounter": ("counter", 1.0),
                },
            ),
            Wire(
                "IMU_GYRO",
                {
                    "RollRate": ("gyro_x", _DEG),
                    "PitchRate": ("gyro_y", _DEG),
                    "YawRate": ("gyro_z", _DEG),
                    "GyroCounter": ("counter", 1.0),
                },
                delay_ns=250_000,
            ),
            Wire(
                "GPS_SPEED",
                {"Speed": ("speed", 1.0), "Fix": ("fix", 1.0 / 3.0), "Satellites": ("fix", 1.0 / 11.0)},
                is_satellite=True,
            ),
        ),
        "canmod_gps": (
            Wire(
                "CANMOD_IMU",
                {
                    "AccelerationX": ("accel_x", 1.0),
                    "AccelerationY": ("accel_y", 1.0),
                    "AccelerationZ": ("accel_z", 1.0),
                    "AngularRateX": ("gyro_x", _DEG),
                    "AngularRateY": ("gyro_y", _DEG),
                    "AngularRateZ": ("gyro_z", _DEG),
                },
            ),
            Wire("CANMOD_SPEED", {"Speed": ("speed", 1.0), "SpeedValid": ("fix", 1.0)}, is_satellite=True),
        ),
        "j1939": (
            Wire(
                "ACCS",
                {
                    "LateralAcceleration": ("accel_y", 1.0),
                    "LongitudinalAcceleration": ("accel_x", 1.0),
                    "VerticalAcceleration": ("accel_z", 1.0),
                },
            ),
            Wire(
                "ARI",
                {"AngularRate1": ("gyro_y", _DEG), "AngularRate2": ("gyro_x", _DEG), "AngularRate3": ("gyro_z", _DEG)},
                delay_ns=550_000,
            ),
            Wire("VDS", {"NavigationBasedVehicleSpeed": ("speed", _KMH)}, is_satellite=True),
        ),
    }
)

WIRED_MAPS: Final = tuple(_WIRING)


class Wiring:
    """Frames of a recording as the sensors of a shipped signal map would send them."""

    def __init__(self, map_name: str) -> None:
        """Raises ConfigurationError for a map that the simulator cannot send."""
        if map_name not in _WIRING:
            raise ConfigurationError(f"the simulator has no sensors for {map_name!r}: choose {', '.join(WIRED_MAPS)}")
        self._wires = _WIRING[map_name]
        self._encoder = Encoder(load_signal_map(SHIPPED_PREFIX + map_name))

    def frames_of(self, recording: Recording) -> Frames:
        """All frames in order of time, stamped in whole microseconds as candump writes them.

        A sample without a satellite fix is not sent if its message has no signal for a missing fix.
        """
        return merge_frames([self._frames(wire, recording) for wire in self._wires])

    def _frames(self, wire: Wire, recording: Recording) -> Frames:
        if wire.is_satellite:
            stamps = recording.gps_t_ns
            readings = {"speed": recording.gps_speed_mps, "fix": recording.gps_fix.astype(np.float64)}
        else:
            stamps, readings = recording.imu_t_ns, _inertial_readings(recording)
        t_ns = (stamps + wire.delay_ns) // 1000 * 1000
        samples = {name: readings[reading] / si_per_unit for name, (reading, si_per_unit) in wire.signals.items()}
        frames = self._encoder.encode(wire.message, t_ns, samples)
        says_fix = any(reading == "fix" for reading, _ in wire.signals.values())
        return take(frames, recording.gps_fix) if wire.is_satellite and not says_fix else frames


def _inertial_readings(recording: Recording) -> dict[str, F64]:
    axes = {"x": _X, "y": _Y, "z": _Z}
    readings = {f"accel_{name}": recording.accel_mps2[:, axis] for name, axis in axes.items()}
    readings |= {f"gyro_{name}": recording.gyro_radps[:, axis] for name, axis in axes.items()}
    readings["counter"] = (np.arange(len(recording.imu_t_ns)) % 256).astype(np.float64)
    return readings


def unrelated_traffic(start_ns: int, duration_s: float, n_ids: int, rng: np.random.Generator) -> Frames:
    """Unrelated traffic: n_ids identifiers every 10 ms to 1 s with random bytes, a fifth of them with 29 bits.

    The identifiers are in 0x300 to 0x4FF and from 0x0CF10000 up, which no shipped map uses.
    """
    parts = []
    for i in range(n_ids):
        period_ns = int(rng.choice([10, 20, 50, 100, 200, 500, 1000])) * 1_000_000
        is_long = i % 5 == 4
        can_id = 0x8CF1_0000 + 0x100 * i if is_long else 0x300 + i
        begin_ns = start_ns + int(rng.integers(0, period_ns)) // 1000 * 1000
        t_ns: I64 = np.arange(begin_ns, start_ns + round(duration_s * NS_PER_S), period_ns, dtype=np.int64)
        length = int(rng.integers(1, 9))
        payload = np.zeros((len(t_ns), 8), np.uint8)
        payload[:, :length] = rng.integers(0, 256, (len(t_ns), length), dtype=np.uint8)
        parts.append(Frames(t_ns, np.full(len(t_ns), can_id, np.uint32), np.full(len(t_ns), length, np.uint8), payload))
    return merge_frames(parts)
