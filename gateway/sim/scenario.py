"""The front door: a vehicle, its loads, a road, a drive, sensors and a seed give a recording and the truth."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.records import F64, I64
from gateway.sim.instruments import Recording, Sensors
from gateway.sim.parameters import Load, Vehicle, axle_loads_kg, cg_left_m, front_share_pct, payload_kg
from gateway.sim.ride import ride, wheel_loads_kg
from gateway.sim.road import Road, RoadRecipe
from gateway.sim.sensing import Felt, felt_at, joined, record
from gateway.sim.speed_profile import Drive

START_NS: Final = 1_767_225_600_000_000_000  # 2026-01-01 00:00:00 UTC
_SETTLE_S: Final = 5.0  # chosen: transients of the start decay within it
_MARGIN_M: Final = 50.0  # chosen: of road beyond the drive


@dataclass(frozen=True, slots=True)
class LoadStep:
    """A load that the vehicle carries from t_s of the drive on."""

    t_s: float
    loads: tuple[Load, ...]


@dataclass(frozen=True, slots=True)
class Truth:
    """The true loads from t_ns (k,) on: payload_kg, front_share_pct, cg_left_m (k,), and the scale readings.

    cg_left_m is the sprung mass's centre of gravity left of the centre line; axle_loads_kg (k, 2) front and rear;
    wheel_loads_kg (k, 4) front left and right, rear left and right.
    """

    t_ns: I64
    payload_kg: F64
    front_share_pct: F64
    axle_loads_kg: F64
    cg_left_m: F64
    wheel_loads_kg: F64


@dataclass(frozen=True, slots=True)
class SimulatedDrive:
    recording: Recording
    truth: Truth


def simulate_drive(
    vehicle: Vehicle,
    loads: Sequence[LoadStep] | tuple[Load, ...],
    road: Road | RoadRecipe,
    drive: Drive,
    sensors: Sensors,
    seed: int,
    start_ns: int = START_NS,
) -> SimulatedDrive:
    """Drive once. The same arguments give the same recording.

    ``loads`` are either constant or steps, never both, and steps happen at a standstill (ValueError otherwise).
    A drive that begins at speed is preceded by a few unrecorded seconds of it. A recipe lays a road
    long enough; a ready Road that is too short is a ValueError.
    """
    steps = _steps(loads, drive)
    road_rng, sensor_rng = (np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(2))
    settled, settle_s = _preceded(drive)
    length_m = vehicle.wheelbase_m + settled.travelled_m[-1] + _MARGIN_M
    ready = road if isinstance(road, Road) else road.lay(length_m, road_rng)
    felt = _drive_in_parts(vehicle, steps, ready, settled, sensors, settle_s)
    recording = record(felt, sensors, sensor_rng, start_ns)
    return SimulatedDrive(recording, _truth(vehicle, steps, start_ns))


def _steps(loads: Sequence[LoadStep] | tuple[Load, ...], drive: Drive) -> list[LoadStep]:
    """Load steps from time 0 on, in order, each at a standstill."""
    steps = [step for step in loads if isinstance(step, LoadStep)]
    constant = tuple(load for load in loads if isinstance(load, Load))
    if steps and constant:
        raise ValueError("loads are either constant or steps, not both: what is always on board belongs in every step")
    if not steps:
        return [LoadStep(0.0, constant)]
    if steps[0].t_s != 0.0:
        raise ValueError(f"the first load step must be at 0 s, not {steps[0].t_s:g} s")
    for before, step in itertools.pairwise(steps):
        speed = drive.speed_mps[min(round(step.t_s / drive.step_s), len(drive.speed_mps) - 1)]
        if step.t_s <= before.t_s or step.t_s >= drive.duration_s:
            raise ValueError(f"the load step at {step.t_s:g} s is out of order or after the drive's end")
        if speed > 0.0:
            raise ValueError(f"the load cannot change at {step.t_s:g} s: the vehicle moves at {speed:.1f} m/s")
    return steps


def _preceded(drive: Drive) -> tuple[Drive, float]:
    """The drive with a few seconds at its first speed before it, so that transients have died; and how long."""
    first = drive.speed_mps[0]
    if first == 0.0:
        return drive, 0.0
    n = round(_SETTLE_S / drive.step_s)
    speed = np.concatenate((np.full(n, first), drive.speed_mps))
    return Drive(speed, np.concatenate((np.zeros(n), drive.lateral_mps2)), drive.step_s), n * drive.step_s


def _drive_in_parts(
    vehicle: Vehicle, steps: list[LoadStep], road: Road, drive: Drive, sensors: Sensors, settle_s: float
) -> Felt:
    """One ride per load; each begins in the equilibrium of its own load."""
    begins = [0.0, *(step.t_s + settle_s for step in steps[1:])]
    ends = [*begins[1:], drive.duration_s]
    travelled = drive.travelled_m
    parts = []
    for step, begin, end in zip(steps, begins, ends, strict=True):
        start_m = vehicle.wheelbase_m + travelled[round(begin / drive.step_s)]
        driven = ride(vehicle, step.loads, road, drive.part(begin, end), start_m)
        felt = felt_at(driven, vehicle, sensors.mount)
        parts.append(felt.part(0, len(driven) - (end < drive.duration_s)))
    whole = joined(parts)
    return whole.part(round(settle_s / whole.step_s), len(whole.speed_mps))


def _truth(vehicle: Vehicle, steps: list[LoadStep], start_ns: int) -> Truth:
    return Truth(
        t_ns=start_ns + np.array([round(step.t_s * 1e9) for step in steps], dtype=np.int64),
        payload_kg=np.array([payload_kg(step.loads) for step in steps]),
        front_share_pct=np.array([front_share_pct(vehicle, step.loads) for step in steps]),
        axle_loads_kg=np.array([axle_loads_kg(vehicle, step.loads) for step in steps]),
        cg_left_m=np.array([cg_left_m(vehicle, step.loads) for step in steps]),
        wheel_loads_kg=np.array([wheel_loads_kg(vehicle, step.loads) for step in steps]),
    )
