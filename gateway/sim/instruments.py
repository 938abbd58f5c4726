"""The sensors that are bolted to the vehicle: inertial unit, satellite receiver, and their clock.

Axes ISO 8855: x forward, y left, z up; specific force, so a vehicle at rest reads +9.81 m/s2 along z;
rates about +x (left side up), +y (nose down), +z (nose left).
"""

import math
from dataclasses import dataclass, field
from typing import Final

from gateway.records import F64, I64, Bool


@dataclass(frozen=True, slots=True)
class Recording:
    """Time-stamped samples as they leave the sensors, SI.

    imu_t_ns (n,), accel_mps2 and gyro_radps (n, 3); gps_t_ns, gps_speed_mps, gps_fix (m,): without a fix
    the speed reads 0.
    """

    imu_t_ns: I64
    accel_mps2: F64
    gyro_radps: F64
    gps_t_ns: I64
    gps_speed_mps: F64
    gps_fix: Bool


@dataclass(frozen=True, slots=True)
class Mount:
    """The place of the inertial unit, and how far its axes are turned from the vehicle's."""

    position_m: float = 3.2  # behind the front axle: the rear of the trunk
    left_m: float = 0.0
    height_m: float = 0.7
    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    yaw_deg: float = 0.0


@dataclass(frozen=True, slots=True)
class Channel:
    """One kind of sensor, equal on its three axes, in the SI unit u of what it reads.

    noise_density in u/sqrt(Hz); bias_std drawn once; drift_std is how far the bias walks in an hour;
    scale_std relative, drawn once; resolution 0: not rounded.
    """

    noise_density: float = 0.0
    bias_std: float = 0.0
    drift_std: float = 0.0
    scale_std: float = 0.0
    resolution: float = 0.0
    limit: float = math.inf


@dataclass(frozen=True, slots=True)
class Imu:
    """corner_hz: second-order low-pass before sampling (infinite: none)."""

    rate_hz: float = 100.0
    corner_hz: float = math.inf
    accel: Channel = field(default_factory=Channel)
    gyro: Channel = field(default_factory=Channel)


@dataclass(frozen=True, slots=True)
class Gps:
    """Speed that is late by latency_s. Drop-outs: mean number per hour and mean duration."""

    rate_hz: float = 5.0
    latency_s: float = 0.0
    noise_std_mps: float = 0.0
    dropouts_per_hour: float = 0.0
    dropout_mean_s: float = 4.0


@dataclass(frozen=True, slots=True)
class Clock:
    """The sensor's rate error, the delay of a frame's stamp (exponential), the share of frames lost."""

    error_ppm: float = 0.0
    jitter_mean_s: float = 0.0
    lost_share: float = 0.0


@dataclass(frozen=True, slots=True)
class Engine:
    """Four cylinders: vibration at half, first, second and fourth order, level_mps2 the second's amplitude."""

    level_mps2: float = 0.0
    idle_rpm: float = 850.0
    shift_rpm: float = 2600.0
    metres_per_turn: tuple[float, ...] = (0.135, 0.25, 0.39, 0.55, 0.72)  # way per crank turn, gear by gear


@dataclass(frozen=True, slots=True)
class Sensors:
    mount: Mount = field(default_factory=Mount)
    imu: Imu = field(default_factory=Imu)
    gps: Gps = field(default_factory=Gps)
    clock: Clock = field(default_factory=Clock)
    engine: Engine = field(default_factory=Engine)


_DEG: Final = math.pi / 180.0  # radians

REFERENCE: Final = Sensors(
    mount=Mount(left_m=0.15, roll_deg=1.0, pitch_deg=-1.5, yaw_deg=2.0),
    imu=Imu(
        rate_hz=100.0,
        corner_hz=40.0,
        accel=Channel(1.5e-3, bias_std=0.1, drift_std=0.03, scale_std=0.003, resolution=0.001, limit=32.0),
        gyro=Channel(0.01 * _DEG, 0.3 * _DEG, 0.1 * _DEG, 0.003, resolution=0.005 * _DEG, limit=160.0 * _DEG),
    ),
    gps=Gps(5.0, latency_s=0.2, noise_std_mps=0.05, dropouts_per_hour=4.0),
    clock=Clock(error_ppm=30.0, jitter_mean_s=2e-4, lost_share=2e-4),
    engine=Engine(level_mps2=0.25),
)

CANMOD: Final = Sensors(  # resolutions of CSS Electronics' CANmod.gps as its DBC gives them
    mount=Mount(position_m=1.6, height_m=0.9, roll_deg=-1.0, pitch_deg=1.0, yaw_deg=1.0),
    imu=Imu(
        rate_hz=101.25,
        corner_hz=40.0,
        accel=Channel(3e-3, bias_std=0.1, drift_std=0.03, scale_std=0.005, resolution=0.125, limit=64.0),
        gyro=Channel(0.02 * _DEG, 0.3 * _DEG, 0.1 * _DEG, 0.005, resolution=0.25 * _DEG, limit=256.0 * _DEG),
    ),
    gps=Gps(1.0, latency_s=0.1, noise_std_mps=0.05, dropouts_per_hour=2.0),
    clock=Clock(error_ppm=50.0, jitter_mean_s=3e-4, lost_share=1e-4),
    engine=Engine(level_mps2=0.25),
)
