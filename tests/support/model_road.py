"""A vehicle of the model's parameters on a random road, its sensors' signals made in the frequency domain."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from gateway.core.vehicle import Load, Vehicle
from gateway.model.car import USUAL_LEVEL, Ground, natural, numbers_of
from gateway.model.response import Frequencies, Motion
from gateway.model.table import INDEX, LOG, NAMES, ROLL, ROWS, UPRIGHT, prior_of
from gateway.model.vehicle_model import VehicleModel
from gateway.records import C128, F64, Batch

RATE_HZ = 50.0
BAND_HZ = (1.1, 14.0)
VAN = Vehicle(
    name="van",
    empty_mass_kg=1240.0,
    wheelbase_m=2.8,
    empty_front_share_pct=52.0,
    sensor_position_m=3.1,
    track_width_m=1.5,
    sensor_offset_left_m=0.3,
)
GROUND = Ground.of(VAN)
KNOWN = ((0.0, 52.0), (270.0, 55.5), (270.0, 47.0), (420.0, 41.5))  # payload (kg), front share (%)
HALF_UNITS = {
    "spring_front_npm": 62e3,
    "spring_rear_npm": 70e3,
    "spring_slope_front_per_kn": 0.02,
    "spring_slope_rear_per_kn": 0.04,
    "damper_front_nspm": 3.9e3,
    "damper_rear_nspm": 4.1e3,
    "damper_mount_front_npm": 8e5,
    "damper_mount_rear_npm": 7e5,
    **dict.fromkeys((f"{kind}_friction_{end}" for kind in ("damper", "spring") for end in ("front", "rear")), 0.0),
    "tyre_front_npm": 3.6e5,
    "tyre_rear_npm": 3.8e5,
    "unsprung_front_kg": 82.0,
    "unsprung_rear_kg": 88.0,
    "pitch_inertia_kgm2": 2200.0,
    "payload_gyration_m2": 0.1,
    "payload_mode_hz": 28.0,
}
"""A known half-car, its axles not alike."""
UNCOUPLED = dict.fromkeys(("driveline_front_kg", "driveline_rear_kg"), 1e-20)
"""No driveline."""
QUIET = {row.name: 1e-20 for row in ROWS if row.name.startswith(("slack_", "noise_"))}
"""All power comes by the modelled paths."""
LEFT = {"empty_left_m": 0.01, "gyro_yaw_rad": 0.02, "sensor_left_m": 0.3, "damper_against_rear": 1.1}
"""What makes left and right differ."""


def theta_of(*, with_roll: bool = False, vehicle: Vehicle = VAN, **units: float) -> F64:
    """The middle of the prior, with these parameters in the units that end their names."""
    rows = (*UPRIGHT, *ROLL) if with_roll else UPRIGHT
    theta, _ = prior_of(rows, vehicle)
    for name, number in units.items():
        if INDEX[name] < len(theta):
            theta[INDEX[name]] = np.log(number) if rows[INDEX[name]].scale == LOG else number
    return theta


def times(car: F64, **factors: float) -> F64:
    """The car with these positive parameters multiplied."""
    changed = car.copy()
    for name, factor in factors.items():
        changed[INDEX[name]] += np.log(factor)
    return changed


def model_of(theta: F64, covariance: F64, loads: tuple[Load, ...], vehicle: Vehicle) -> VehicleModel:
    """A fitted vehicle with these parameters (n,) and their covariance (n, n)."""
    return VehicleModel(
        empty_mass_kg=vehicle.empty_mass_kg,
        empty_front_share_pct=vehicle.empty_front_share_pct,
        wheelbase_m=vehicle.wheelbase_m,
        band_hz=BAND_HZ,
        n_segment=256,
        names=NAMES[: len(theta)],
        parameters=theta,
        covariance=covariance,
        directions=np.zeros((len(theta), 0)),
        model_std=(10.0, 0.2, 0.002),
        spread=(1.0, 1.0, 1.0),
        misfit_limit=3.0,
        acceleration_rms_mps2=0.5,
        pitch_rate_rms_radps=0.05,
        speed_seen_mps=(12.0, 15.0),
        taught_loads=loads,
        usual_log_amplitude=0.0,
        track_width_m=vehicle.track_width_m,
    )


def motion_of(
    theta: F64,
    load: tuple[float, ...],
    freq_hz: F64,
    n_sensors: int = 2,
    speed_mps: float = 14.0,
    ground: Ground = GROUND,
) -> Motion:
    """The vehicle theta (n,) with payload (kg), front share (0..1) and, with roll, centre of gravity left (m)."""
    numbers = numbers_of(natural(theta)[None], np.array(load)[:, None], ground)
    return Motion(numbers, ground, Frequencies(freq_hz), n_sensors, speed_mps)


def paths_of(
    theta: F64,
    load: tuple[float, ...],
    freq_hz: F64,
    n_sensors: int = 2,
    speed_mps: float = 14.0,
    ground: Ground = GROUND,
) -> C128:
    """(p, s, m) its sensors' readings per unit of road where it moves as usual."""
    return motion_of(theta, load, freq_hz, n_sensors, speed_mps, ground).paths[:, :, 0, USUAL_LEVEL]


def batch_over_road(
    theta: F64,
    load: Load,
    seed: int,
    cg_left_m: float = 0.0,
    duration_s: float = 300.0,
    speed_mps: float = 14.0,
    noise: float = 0.02,
    shaken_mps2: float = 0.8,
    ground: Ground = GROUND,
    waviness: float = 2.0,
    slack: float = 0.0,
) -> Batch:
    """A drive of the vehicle theta (n,) at constant speed; see ``batch_by``."""
    rolls = len(theta) > len(UPRIGHT)
    loaded = (load.payload_kg, load.front_share, cg_left_m)[: 3 if rolls else 2]

    def paths(freq_hz: F64) -> C128:
        return paths_of(theta, loaded, freq_hz, 3 if rolls else 2, speed_mps, ground)

    return batch_by(paths, seed, duration_s, speed_mps, noise, shaken_mps2, ground, waviness, slack)


def batch_by(
    paths_at: Callable[[F64], C128],
    seed: int,
    duration_s: float = 300.0,
    speed_mps: float = 14.0,
    noise: float = 0.02,
    shaken_mps2: float = 0.8,
    ground: Ground = GROUND,
    waviness: float = 2.0,
    slack: float = 0.0,
) -> Batch:
    """Constant speed, over a random road whose density falls as frequency to the power ``waviness``.

    ``paths_at`` gives the readings (p, s, m) per unit of road; ``shaken_mps2`` is the acceleration's standard
    deviation, ``noise`` a share of each signal's. ``slack`` is the part of each sensor's power that comes by no
    modelled path.
    """
    rng = np.random.default_rng(seed)
    n = int(duration_s * RATE_HZ)
    freq_hz = np.fft.rfftfreq(n, 1.0 / RATE_HZ)[1:]
    mean, apart = rng.standard_normal((2, len(freq_hz))) + 1j * rng.standard_normal((2, len(freq_hz)))
    mean, apart = mean * freq_hz ** (-0.5 * waviness), apart * freq_hz ** (-0.5 * waviness)
    paths = paths_at(freq_hz)
    later = np.exp(-2j * np.pi * freq_hz * ground.wheelbase_m / speed_mps)
    sensed = (paths[:, 0] + paths[:, 1] * later) * mean
    if paths.shape[1] > 2:
        alike = np.exp(-2.0 * np.pi * freq_hz / speed_mps * ground.half_track_m)
        sensed = sensed + (paths[:, 2] + paths[:, 3] * later) * apart * np.sqrt((1.0 - alike) / (1.0 + alike))
    if slack:
        unlike = rng.standard_normal((2, *paths.shape[:1], 2, len(freq_hz)))
        strength = np.abs(paths[:, :2]) * freq_hz ** (-0.5 * waviness) * slack**0.5
        sensed = sensed + ((unlike[0] + 1j * unlike[1]) * strength).sum(axis=1)
    sensed = np.pad(sensed * ((freq_hz > 0.5) & (freq_hz < 22.0)), ((0, 0), (1, 0)))
    signals = np.fft.irfft(sensed, n, axis=1)
    signals *= shaken_mps2 / signals[0].std()
    signals += noise * signals.std(axis=1, keepdims=True) * rng.standard_normal(signals.shape)
    return batch_of(*signals, speed_mps=speed_mps)


def batch_of(
    acceleration_mps2: F64, pitch_rate_radps: F64, roll_rate_radps: F64 | None = None, speed_mps: F64 | float = 14.0
) -> Batch:
    """A batch whose every sample is usable."""
    n = len(acceleration_mps2)
    return Batch(
        t_start_ns=0,
        t_end_ns=int(n / RATE_HZ * 1e9),
        drive_start_ns=0,
        rate_hz=RATE_HZ,
        vertical_acceleration_mps2=acceleration_mps2,
        pitch_rate_radps=pitch_rate_radps,
        roll_rate_radps=roll_rate_radps,
        speed_mps=np.broadcast_to(speed_mps, n).copy(),
        usable=np.ones(n, bool),
        gravity_mps2=9.81,
        gap_share=0.0,
        shares={},
    )


def joined(*batches: Batch) -> Batch:
    """One batch after another, as one."""
    names = "vertical_acceleration_mps2", "pitch_rate_radps", "roll_rate_radps", "speed_mps", "usable"
    columns = {name: [getattr(one, name) for one in batches] for name in names}
    whole = {name: np.concatenate(each) for name, each in columns.items() if each[0] is not None}
    return replace(batches[0], t_end_ns=sum(one.t_end_ns for one in batches), **whole)
