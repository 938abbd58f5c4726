"""Simulated drives in the export formats of phone apps: Sensor Logger on Android and iOS, phyphox.

The formats are those that gateway.offline.phone reads, written from the apps' documentation alone. Noise, rates and
gaps are typical of phones. Sources: Sensor Logger's SAMPLING.md (100 Hz on iOS, 60 to 210 Hz on Android, a fix a
second), and the data sheets of inertial units in phones (Bosch BMI160, ST LSM6DSO: 70 to 180 ug/sqrt(Hz), 0.004 to
0.007 deg/s/sqrt(Hz)).
"""

import math
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

import numpy as np

from gateway.records import F64, I64
from gateway.sim.sensors import Channel, Clock, Engine, Gps, Imu, Mount, Recording, Sensors
from gateway.units import NS_PER_S, STANDARD_GRAVITY_MPS2

App = Literal["sensor_logger_android", "sensor_logger_ios", "phyphox"]
APPS: Final[tuple[App, ...]] = ("sensor_logger_android", "sensor_logger_ios", "phyphox")

_DEG: Final = math.pi / 180.0  # radians
_EARTH_M: Final = 6_371_000.0  # mean radius (IUGG)

PHONE: Final = Sensors(  # on the floor of the load room, in the middle
    mount=Mount(position_m=2.4, height_m=0.5, roll_deg=1.0, pitch_deg=-1.5, yaw_deg=2.0),
    imu=Imu(
        rate_hz=100.1,
        corner_hz=40.0,
        accel=Channel(1.8e-3, bias_std=0.15, drift_std=0.03, scale_std=0.005, resolution=0.0024, limit=78.0),
        gyro=Channel(0.007 * _DEG, 0.2 * _DEG, 0.1 * _DEG, 0.005, resolution=0.06 * _DEG, limit=2000.0 * _DEG),
    ),
    gps=Gps(1.0, latency_s=0.4, noise_std_mps=0.1, dropouts_per_hour=6.0, dropout_mean_s=8.0),
    clock=Clock(error_ppm=20.0, jitter_mean_s=1e-5),
    engine=Engine(level_mps2=0.25),
)


@dataclass(frozen=True, slots=True)
class Lying:
    """How the phone is placed: yawed and tilted; it is put down after ``handled_s`` and picked up at the end.

    At moved_at_s (NaN: never) it tilts by another 20 degrees within one second.
    """

    turned_deg: float = 130.0
    tilted_deg: float = 4.0
    handled_s: float = 15.0
    moved_at_s: float = math.nan


def write_export(recording: Recording, path: Path, app: App, lying: Lying | None = None, seed: int = 1) -> None:
    """Write a recording (vehicle axes) as the zip that this app exports. Raises OSError."""
    lying = lying or Lying()
    t_ns, accel, gyro = _as_held(recording, lying, np.random.default_rng(seed))
    fixes = _fixes(recording, np.random.default_rng([seed, 1]))
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        if app == "phyphox":
            _phyphox(archive, t_ns, accel, gyro, fixes)
        else:
            _sensor_logger(archive, t_ns, accel, gyro, fixes, is_ios=app.endswith("ios"))


def _as_held(recording: Recording, lying: Lying, rng: np.random.Generator) -> tuple[I64, F64, F64]:
    """Times, acceleration and rates in the phone's axes, including handling before and after the drive."""
    turn = _turn(lying.turned_deg, lying.tilted_deg)
    accel, gyro = recording.accel_mps2 @ turn.T, recording.gyro_radps @ turn.T
    t_s = (recording.imu_t_ns - recording.imu_t_ns[0]) / NS_PER_S
    if math.isfinite(lying.moved_at_s):
        after = t_s > lying.moved_at_s
        again = _turn(0.0, 20.0)
        accel[after], gyro[after] = accel[after] @ again.T, gyro[after] @ again.T
        gyro[np.abs(t_s - lying.moved_at_s) < 0.5, 0] += math.radians(20.0)
    held = t_s < lying.handled_s
    held |= t_s > t_s[-1] - lying.handled_s
    swing = np.cumsum(rng.standard_normal((len(t_s), 3)), axis=0) / math.sqrt(len(t_s))
    gyro[held] += 3.0 * np.sin(2.0 * np.pi * 0.7 * t_s[held, None] + swing[held])
    accel[held] += 3.0 * np.sin(2.0 * np.pi * 0.5 * t_s[held, None] + swing[held])
    return recording.imu_t_ns, accel, gyro


def _turn(turned_deg: float, tilted_deg: float) -> F64:
    """Rotation matrix (3, 3) from the vehicle's axes to the phone's."""
    a, b = math.radians(turned_deg), math.radians(tilted_deg)
    about_up = np.array([[math.cos(a), math.sin(a), 0.0], [-math.sin(a), math.cos(a), 0.0], [0.0, 0.0, 1.0]])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, math.cos(b), math.sin(b)], [0.0, -math.sin(b), math.cos(b)]])
    turn: F64 = about_x @ about_up
    return turn


@dataclass(frozen=True, slots=True)
class _Fixes:
    t_ns: I64
    speed_mps: F64
    bearing_deg: F64
    latitude_deg: F64
    longitude_deg: F64


def _fixes(recording: Recording, rng: np.random.Generator) -> _Fixes:
    """Course and position integrated from turn rate and speed, starting at 48 N, 9 E [deg]; lost fixes are omitted."""
    t_s = (recording.imu_t_ns - recording.imu_t_ns[0]) / NS_PER_S
    turned = np.concatenate(([0.0], np.cumsum(recording.gyro_radps[1:, 2] * np.diff(t_s))))
    at_s = (recording.gps_t_ns - recording.imu_t_ns[0]) / NS_PER_S
    course = -np.interp(at_s, t_s, turned)
    way = recording.gps_speed_mps * np.gradient(at_s)
    north, east = np.cumsum(way * np.cos(course)), np.cumsum(way * np.sin(course))
    noisy = np.degrees(course) + 2.0 * rng.standard_normal(len(course))
    fix = recording.gps_fix
    return _Fixes(
        recording.gps_t_ns[fix],
        recording.gps_speed_mps[fix],
        (noisy % 360.0)[fix],
        48.0 + np.degrees(north / _EARTH_M)[fix],
        9.0 + np.degrees(east / (_EARTH_M * math.cos(math.radians(48.0))))[fix],
    )


def _sensor_logger(archive: zipfile.ZipFile, t_ns: I64, accel: F64, gyro: F64, fixes: _Fixes, *, is_ios: bool) -> None:
    begin_ns = int(t_ns[0])
    if is_ios:
        smooth = np.column_stack([np.convolve(axis, np.full(101, 1.0 / 101.0), mode="same") for axis in accel.T])
        gravity = smooth / np.maximum(np.linalg.norm(smooth, axis=1), 1e-9)[:, None] * STANDARD_GRAVITY_MPS2
        _xyz(archive, "Accelerometer.csv", t_ns, begin_ns, -(accel - gravity))
        _xyz(archive, "Gravity.csv", t_ns, begin_ns, -gravity)
    else:
        _xyz(archive, "TotalAcceleration.csv", t_ns, begin_ns, accel)
    _xyz(archive, "Gyroscope.csv", t_ns, begin_ns, gyro)
    rows = [
        "time,seconds_elapsed,bearingAccuracy,speedAccuracy,verticalAccuracy,horizontalAccuracy,speed,bearing,altitude,"
        "longitude,latitude"
    ]
    rows += [
        f"{t},{(t - begin_ns) / NS_PER_S},3,0.2,4.1,3.9,{speed:.4f},{bearing:.2f},401.2,{longitude:.7f},{latitude:.7f}"
        for t, speed, bearing, longitude, latitude in zip(
            fixes.t_ns.tolist(),
            fixes.speed_mps,
            fixes.bearing_deg,
            fixes.longitude_deg,
            fixes.latitude_deg,
            strict=True,
        )
    ]
    archive.writestr("Location.csv", "\n".join(rows) + "\n")
    platform, device = ("ios", "iPhone14,5") if is_ios else ("android", "SM-S911B")
    archive.writestr(
        "Metadata.csv",
        "version,device name,recording epoch time,recording time,recording timezone,platform,appVersion,device id,"
        "sensors,sampleRateMs,standardisation,platform version\n"
        f"3,{device},{begin_ns // 1_000_000},2026-01-01_00-00-00,Etc/UTC,{platform},1.47.1,made,"
        "Accelerometer|Gyroscope|Location,0|0|0,false,15\n",
    )


def _xyz(archive: zipfile.ZipFile, name: str, t_ns: I64, begin_ns: int, xyz: F64) -> None:
    rows = ["time,seconds_elapsed,z,y,x"]
    rows += [
        f"{t},{(t - begin_ns) / NS_PER_S:.9f},{z:.9g},{y:.9g},{x:.9g}"
        for t, (x, y, z) in zip(t_ns.tolist(), xyz.tolist(), strict=True)
    ]
    archive.writestr(name, "\n".join(rows) + "\n")


def _phyphox(archive: zipfile.ZipFile, t_ns: I64, accel: F64, gyro: F64, fixes: _Fixes) -> None:
    def table(name: str, header: str, stamps: I64, columns: F64) -> None:
        t_s = (stamps - t_ns[0]) / NS_PER_S
        lines = [header]
        lines += [
            ",".join(f"{x:.9E}" for x in (t, *row)) for t, row in zip(t_s.tolist(), columns.tolist(), strict=True)
        ]
        archive.writestr(name, "\n".join(lines) + "\n")

    for name, what, unit, xyz in (
        ("Accelerometer", "Acceleration", "m/s^2", accel),
        ("Gyroscope", "Gyroscope", "rad/s", gyro),
    ):
        columns = ",".join(f'"{what} {axis} ({unit})"' for axis in "xyz")
        table(f"{name}.csv", f'"Time (s)",{columns}', t_ns, xyz)
    place = np.column_stack(
        (fixes.latitude_deg, fixes.longitude_deg, np.full(len(fixes.t_ns), 401.2), fixes.speed_mps, fixes.bearing_deg)
    )
    header = '"Time (s)","Latitude (°)","Longitude (°)","Height (m)","Velocity (m/s)","Direction (°)"'
    table("Location.csv", header, fixes.t_ns, place)
    archive.writestr("meta/device.csv", '"property","value"\n"version","1.1.16"\n"deviceModel","Pixel 7"\n')
    archive.writestr(
        "meta/time.csv",
        '"event","experiment time","system time","system time text"\n'
        f'"START",0.000000000E0,{t_ns[0] / NS_PER_S:.3f},"2026-01-01 00:00:00.000 UTC+00:00"\n',
    )
