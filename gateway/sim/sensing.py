"""The sensors' readings of a vehicle's motion."""

import math
from dataclasses import dataclass

import numpy as np

from gateway.records import F64, I64, Bool
from gateway.sim.compiled import compiled
from gateway.sim.instruments import Channel, Engine, Gps, Imu, Mount, Recording, Sensors
from gateway.sim.parameters import Vehicle
from gateway.sim.ride import Ride
from gateway.units import NS_PER_S, STANDARD_GRAVITY_MPS2


@dataclass(frozen=True, slots=True)
class Felt:
    """Truth at the sensor's place, every step_s: force_mps2 and rate_radps (n, 3), speed_mps (n,)."""

    step_s: float
    force_mps2: F64
    rate_radps: F64
    speed_mps: F64

    def part(self, begin: int, end: int) -> "Felt":
        return Felt(self.step_s, self.force_mps2[begin:end], self.rate_radps[begin:end], self.speed_mps[begin:end])


def joined(parts: list[Felt]) -> Felt:
    """The parts as one recording, one after the other."""
    return Felt(
        parts[0].step_s,
        np.concatenate([part.force_mps2 for part in parts]),
        np.concatenate([part.rate_radps for part in parts]),
        np.concatenate([part.speed_mps for part in parts]),
    )


def felt_at(ride: Ride, vehicle: Vehicle, mount: Mount) -> Felt:
    """Specific force and angular rate at the mount, in its own turned axes.

    First order in the body's angles: gravity leaks into x and y with pitch and roll, the place's
    lever turns angular into linear acceleration.
    """
    behind = mount.position_m - vehicle.cog_position_m
    above = mount.height_m - vehicle.cog_height_m
    heave_acc, pitch_acc, roll_acc = ride.acceleration.T
    _, pitch, roll = ride.position.T
    g = STANDARD_GRAVITY_MPS2
    force = np.column_stack(
        (
            ride.longitudinal_mps2 + above * pitch_acc - g * pitch,
            ride.lateral_mps2 - above * roll_acc + g * roll,
            g + heave_acc + behind * pitch_acc + mount.left_m * roll_acc,
        )
    )
    yaw_rate = ride.lateral_mps2 / np.maximum(ride.speed_mps, 2.0)
    rate = np.column_stack((ride.rate[:, 2], ride.rate[:, 1], yaw_rate))
    turn = _turn(mount)
    return Felt(ride.step_s, force @ turn, rate @ turn, ride.speed_mps)


def record(felt: Felt, sensors: Sensors, rng: np.random.Generator, start_ns: int) -> Recording:
    """The samples that the sensors send; the first instant of ``felt`` is start_ns."""
    shaken = felt.force_mps2 + _engine_vibration(felt, sensors.engine, rng)
    t_s = _sample_times(felt, sensors.imu.rate_hz, sensors.clock.error_ppm)
    accel = _read(shaken, felt.step_s, t_s, sensors.imu, sensors.imu.accel, rng)
    gyro = _read(felt.rate_radps, felt.step_s, t_s, sensors.imu, sensors.imu.gyro, rng)
    arrives = rng.random(len(t_s)) >= sensors.clock.lost_share
    stamps = _stamps(t_s, sensors.clock.jitter_mean_s, rng, start_ns)[arrives]
    gps_t_s = _sample_times(felt, sensors.gps.rate_hz, sensors.clock.error_ppm)
    speed, has_fix = _satellite_speed(felt, gps_t_s, sensors.gps, rng)
    gps_stamps = _stamps(gps_t_s, sensors.clock.jitter_mean_s, rng, start_ns)
    return Recording(stamps, accel[arrives], gyro[arrives], gps_stamps, speed, has_fix)


def _turn(mount: Mount) -> F64:
    """The matrix (3, 3) that turns row vectors from the vehicle's axes to the sensor's."""
    (sr, cr), (sp, cp), (sy, cy) = (
        (math.sin(math.radians(a)), math.cos(math.radians(a))) for a in (mount.roll_deg, mount.pitch_deg, mount.yaw_deg)
    )
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    turn: F64 = about_z @ about_y @ about_x
    return turn


def _sample_times(felt: Felt, rate_hz: float, error_ppm: float) -> F64:
    """When a clock that runs error_ppm slow takes its samples [s]."""
    period_s = (1.0 + error_ppm * 1e-6) / rate_hz
    n = int((len(felt.speed_mps) - 1) * felt.step_s / period_s) + 1
    return np.arange(n, dtype=np.float64) * period_s


def _stamps(t_s: F64, jitter_mean_s: float, rng: np.random.Generator, start_ns: int) -> I64:
    """Arrival times, never out of order."""
    late_s = rng.exponential(jitter_mean_s, len(t_s)) if jitter_mean_s > 0.0 else 0.0
    offsets = np.rint((t_s + late_s) * NS_PER_S).astype(np.int64)
    return start_ns + np.maximum.accumulate(offsets)


def _read(signal: F64, step_s: float, t_s: F64, imu: Imu, channel: Channel, rng: np.random.Generator) -> F64:
    """Low-pass, sample, scale, bias, drift, noise, limit, round: (m, 3) at t_s."""
    grid_s = np.arange(len(signal)) * step_s
    axes = (np.interp(t_s, grid_s, _low_pass(column, step_s, imu.corner_hz)) for column in signal.T)
    sampled = np.column_stack(tuple(axes))
    scale = 1.0 + channel.scale_std * rng.standard_normal(3)
    bias = channel.bias_std * rng.standard_normal(3)
    walk_std = channel.drift_std / math.sqrt(3600.0 * imu.rate_hz)
    drift = np.cumsum(walk_std * rng.standard_normal(sampled.shape), axis=0)
    noise = channel.noise_density * math.sqrt(imu.rate_hz / 2.0) * rng.standard_normal(sampled.shape)
    reading: F64 = np.clip(sampled * scale + bias + drift + noise, -channel.limit, channel.limit)
    return np.round(reading / channel.resolution) * channel.resolution if channel.resolution > 0.0 else reading


def _low_pass(signal: F64, step_s: float, corner_hz: float) -> F64:
    """Second-order Butterworth by the bilinear transform, its corner prewarped; starts settled."""
    if corner_hz * step_s >= 0.5:
        return signal
    k = math.tan(math.pi * corner_hz * step_s)
    scale = 1.0 + math.sqrt(2.0) * k + k * k
    gain = k * k / scale
    back_1 = 2.0 * (k * k - 1.0) / scale
    back_2 = (1.0 - math.sqrt(2.0) * k + k * k) / scale
    return _biquad(np.ascontiguousarray(signal), gain, back_1, back_2)


@compiled
def _biquad(x: F64, gain: float, back_1: float, back_2: float) -> F64:
    """y[k] = gain (x[k] + 2 x[k-1] + x[k-2]) - back_1 y[k-1] - back_2 y[k-2], at rest on x[0] before."""
    y = np.empty_like(x)
    x1 = x2 = y1 = y2 = x[0]
    for k in range(x.size):
        y[k] = gain * (x[k] + 2.0 * x1 + x2) - back_1 * y1 - back_2 * y2
        x2, x1 = x1, x[k]
        y2, y1 = y1, y[k]
    return y


def _engine_vibration(felt: Felt, engine: Engine, rng: np.random.Generator) -> F64:
    """Orders 0.5, 1, 2, 4 of the crank speed (n, 3); the gear follows the speed."""
    if engine.level_mps2 == 0.0:
        return np.zeros((1, 3))
    turns_per_s = crank_rpm(felt.speed_mps, engine) / 60.0
    turns = np.cumsum(turns_per_s) * felt.step_s
    level = engine.level_mps2 * (turns_per_s * 60.0 / 2000.0)[:, None]
    shaking = np.zeros((len(turns), 3))
    for order, strength in ((0.5, 0.2), (1.0, 0.3), (2.0, 1.0), (4.0, 0.3)):
        direction = strength * rng.uniform(0.3, 1.0, 3)
        phase = rng.uniform(0.0, 2.0 * math.pi, 3)
        shaking += np.sin(2.0 * math.pi * order * turns[:, None] + phase) * direction
    vibration: F64 = level * shaking
    return vibration


def crank_rpm(speed_mps: F64, engine: Engine) -> F64:
    """Crank speed (n,) in the lowest gear that keeps it under the shift speed; never under idle."""
    rpm = speed_mps[:, None] / np.array(engine.metres_per_turn) * 60.0
    gear = np.argmax(rpm <= engine.shift_rpm, axis=1)
    gear[rpm[:, -1] > engine.shift_rpm] = len(engine.metres_per_turn) - 1
    in_gear: F64 = rpm[np.arange(len(rpm)), gear]
    return np.maximum(in_gear, engine.idle_rpm)


def _satellite_speed(felt: Felt, t_s: F64, gps: Gps, rng: np.random.Generator) -> tuple[F64, Bool]:
    """Speed as it was latency_s ago, with noise; 0 while there is no fix."""
    grid_s = np.arange(len(felt.speed_mps)) * felt.step_s
    speed = np.interp(t_s - gps.latency_s, grid_s, felt.speed_mps)
    noisy = np.abs(speed + gps.noise_std_mps * rng.standard_normal(len(t_s)))
    has_fix = np.ones(len(t_s), dtype=np.bool_)
    for _ in range(rng.poisson(gps.dropouts_per_hour * (t_s[-1] / 3600.0))):
        begin = rng.uniform(0.0, t_s[-1])
        has_fix &= ~((t_s >= begin) & (t_s < begin + rng.exponential(gps.dropout_mean_s)))
    return np.where(has_fix, noisy, 0.0), has_fix
