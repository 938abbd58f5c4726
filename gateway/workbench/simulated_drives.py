"""Write simulated drives as campaigns on disk, or send them as frames to a bus."""

import csv
import math
import re
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from shutil import copyfile
from statistics import median
from typing import Final

import numpy as np

from gateway.bus.frames import Speed, merge_frames
from gateway.bus.logs import write_candump
from gateway.bus.signals import shipped_map
from gateway.bus.signals.signal_map import SignalMapFile
from gateway.bus.sink import BusSink, OnProgress, replay_frames
from gateway.errors import ConfigurationError, SignalMapError
from gateway.files.toml_file import load_toml
from gateway.records import F64, Frames
from gateway.sim.instruments import CANMOD, REFERENCE, Sensors
from gateway.sim.obstacles import UnevenRoad
from gateway.sim.parameters import Load, Vehicle, front_share_pct, payload_kg, payload_left_m
from gateway.sim.road import iso_road
from gateway.sim.scenario import START_NS, LoadStep, SimulatedDrive, simulate_drive
from gateway.sim.speed_profile import Drive, Leg, constant, drive_of, standstill
from gateway.sim.vans import PAPER_VAN, VANS
from gateway.units import NS_PER_S
from gateway.workbench.simulated_campaigns import (
    PAPER_SPEED_MPS,
    PLANS,
    Carried,
    Plan,
    PlannedDrive,
    plan_of,
    share_range_pct,
)
from gateway.workbench.wiring import Wiring, unrelated_traffic


def sideways(plan: Plan, most_m: float, rng: np.random.Generator) -> Plan:
    """The plan with random lateral load positions within most_m of the centre line, constant during a drive."""
    return replace(plan, drives=tuple(_sideways(planned, most_m, rng) for planned in plan.drives))


def _sideways(planned: PlannedDrive, most_m: float, rng: np.random.Generator) -> PlannedDrive:
    moved = {
        loads: tuple(replace(load, left_m=float(rng.uniform(-most_m, most_m))) for load in loads)
        for loads in dict.fromkeys(step.loads for step in planned.steps)
    }
    return replace(
        planned,
        carried=tuple(replace(carried, loads=moved[carried.loads]) for carried in planned.carried),
        steps=tuple(replace(step, loads=moved[step.loads]) for step in planned.steps),
    )


OnDrive = Callable[[int, int], None]  # (drives done, drives in all)

CHANNEL: Final = "can0"
BETWEEN_DRIVES_S: Final = 120.0  # the bus sleeps while the vehicle is parked
TRUTH_COLUMNS: Final = (
    "log", "t_ns", "payload_kg", "front_share_pct", "front_axle_kg", "rear_axle_kg", "cg_left_m",
    "front_left_kg", "front_right_kg", "rear_left_kg", "rear_right_kg",
)  # fmt: skip
ROLL_RATE: Final = re.compile(r"^\[signals\.roll_rate\][^\n]*\n(?:[^\n]+\n)+", re.MULTILINE)
NO_ROLL_RATE: Final = "# No roll rate: both wheels of an axle run over one profile, and nothing rolls.\n"
SENSORS_OF_MAP: Final = {"reference": REFERENCE, "canmod_gps": CANMOD, "j1939": REFERENCE}


@dataclass(frozen=True, slots=True)
class Bench:
    """A simulated vehicle on a kind of plan, whose sensors send the messages of a shipped signal map.

    n_unrelated other identifiers share the bus. Each load is driven for at most longest_s. The inertial unit is
    sensor_left_m left of the centre line (None: as its mount says); loads are at random lateral positions within
    loads_off_m of that line (0: as the plan says).
    """

    kind: str
    vehicle: Vehicle
    map_name: str = "reference"
    seed: int = 1
    n_unrelated: int = 0
    longest_s: float = math.inf
    sensor_left_m: float | None = None
    loads_off_m: float = 0.0

    @property
    def sensors(self) -> Sensors:
        sensors = SENSORS_OF_MAP[self.map_name]
        if self.sensor_left_m is None:
            return sensors
        return replace(sensors, mount=replace(sensors.mount, left_m=self.sensor_left_m))

    def plan(self) -> Plan:
        plan = plan_of(self.kind, self.vehicle, self.seed, self.longest_s)
        if self.loads_off_m == 0.0:
            return plan
        rng = np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(1,)))
        return sideways(plan, self.loads_off_m, rng)

    def simulate(self, planned: PlannedDrive, number: int, start_ns: int) -> SimulatedDrive:
        """Simulate drive ``number`` of the plan, starting at start_ns."""
        seed = int(np.random.SeedSequence([self.seed, number]).generate_state(1)[0])
        return simulate_drive(self.vehicle, planned.steps, planned.road, planned.drive, self.sensors, seed, start_ns)

    def frames_of(self, planned: PlannedDrive, number: int, driven: SimulatedDrive) -> Frames:
        """The drive's frames in order of time, together with the unrelated traffic."""
        frames = Wiring(self.map_name).frames_of(driven.recording)
        if self.n_unrelated == 0:
            return frames
        rng = np.random.default_rng([self.seed, number])
        start_ns = int(driven.truth.t_ns[0])
        return merge_frames([frames, unrelated_traffic(start_ns, planned.drive.duration_s, self.n_unrelated, rng)])


def bench_of(
    kind: str,
    vehicle: str = "paper_van",
    map_name: str = "reference",
    seed: int = 1,
    n_unrelated: int = 0,
    longest_s: float = math.inf,
    sensor_left_m: float | None = None,
    loads_off_m: float = 0.0,
) -> Bench:
    """Build a bench from names. Raises ConfigurationError for an unknown name and lists the known ones."""
    for what, name, known in (
        ("campaign", kind, PLANS),
        ("vehicle", vehicle, VANS),
        ("signal map to send by", map_name, SENSORS_OF_MAP),
    ):
        if name not in known:
            raise ConfigurationError(f"there is no {what} {name!r}: choose {', '.join(known)}")
    if not longest_s > 0.0:
        raise ConfigurationError(f"a drive needs a positive duration, not {longest_s:g} s")
    return Bench(kind, VANS[vehicle], map_name, seed, n_unrelated, longest_s, sensor_left_m, loads_off_m)


def write_campaign(
    bench: Bench, directory: Path, *, workers: int = 1, on_drive: OnDrive = lambda done, of: None
) -> Path:
    """Write campaign.toml, signals.toml with its DBC, the logs and truth.csv; return the path of campaign.toml.

    The frames depend on the bench only, not on the number of processes. Raises ConfigurationError if the
    directory already contains a campaign.
    """
    campaign = directory / "campaign.toml"
    if campaign.exists():
        raise ConfigurationError(f"{campaign}: there is a campaign already; name another directory or remove it")
    directory.mkdir(parents=True, exist_ok=True)
    plan = bench.plan()
    _copy_signal_map(bench.map_name, directory, with_roll_rate=plan.rolls)
    logs = [f"{number:02d}_{planned.name}/can.log.gz" for number, planned in enumerate(plan.drives, 1)]
    write = partial(_write_drive, bench, plan, directory, logs)
    truths = []
    on_drive(0, len(logs))
    for truth in _mapped(write, range(len(logs)), workers):
        truths.append(truth)
        on_drive(len(truths), len(logs))
    _write_truth(directory / "truth.csv", truths)
    campaign.write_text(_campaign_text(bench, plan, logs), encoding="utf-8")
    return campaign


def simulated_frames(bench: Bench) -> Iterator[Frames]:
    """The plan's drives in sequence with the vehicle parked in between; yields one chunk of frames per drive."""
    start_ns = START_NS
    for number, planned in enumerate(bench.plan().drives):
        driven = bench.simulate(planned, number, start_ns)
        yield bench.frames_of(planned, number, driven)
        start_ns += round((planned.drive.duration_s + BETWEEN_DRIVES_S) * NS_PER_S)


def stream(
    bench: Bench,
    interface: str,
    channel: str,
    *,
    speed: Speed = 1.0,
    on_progress: OnProgress | None = None,
    stop: threading.Event | None = None,
) -> int:
    """Send the plan's drives to a bus in real time; return the number of frames. Raises BusError."""
    with BusSink(interface, channel) as sink:
        return replay_frames(simulated_frames(bench), sink, speed, on_progress, stop)


def _mapped(write: Callable[[int], list[list[str]]], numbers: Sequence[int], workers: int) -> Iterator[list[list[str]]]:
    if workers <= 1:
        yield from map(write, numbers)
        return
    with ProcessPoolExecutor(workers) as pool:
        yield from pool.map(write, numbers)


def _write_drive(bench: Bench, plan: Plan, directory: Path, logs: Sequence[str], number: int) -> list[list[str]]:
    """Simulate one drive and write its log; return its rows of truth.csv."""
    planned = plan.drives[number]
    driven = bench.simulate(planned, number, START_NS + number * 86_400 * NS_PER_S)
    log = directory / logs[number]
    log.parent.mkdir(exist_ok=True)
    write_candump(bench.frames_of(planned, number, driven), CHANNEL, log)
    truth = driven.truth
    columns = zip(
        truth.t_ns, truth.payload_kg, truth.front_share_pct, truth.axle_loads_kg, truth.cg_left_m, truth.wheel_loads_kg,
        strict=True,
    )  # fmt: skip
    return [
        [logs[number], str(t), f"{kg:.3f}", f"{d:.4f}", *_kg(axles), f"{left_m:.5f}", *_kg(wheels)]
        for t, kg, d, axles, left_m, wheels in columns
    ]


def _kg(weights: F64) -> list[str]:
    return [f"{kg:.3f}" for kg in weights]


def _write_truth(path: Path, drives: Sequence[Sequence[Sequence[str]]]) -> None:
    """Write one row per load; the load is on board from t_ns on."""
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(TRUTH_COLUMNS)
        table.writerows(row for drive in drives for row in drive)


def _copy_signal_map(map_name: str, directory: Path, *, with_roll_rate: bool) -> None:
    shipped = shipped_map(map_name)
    text = shipped.read_text(encoding="utf-8")
    text = text if with_roll_rate else ROLL_RATE.sub(NO_ROLL_RATE, text)
    (directory / "signals.toml").write_text(text, encoding="utf-8")
    for database in load_toml(shipped, SignalMapFile, SignalMapError).dbc:
        copyfile(shipped.parent / database, directory / database)


def _campaign_text(bench: Bench, plan: Plan, logs: Sequence[str]) -> str:
    vehicle, mount = bench.vehicle, bench.sensors.mount
    low, high = share_range_pct(vehicle)
    lines = [
        f"# Simulated: {bench.kind}, seed {bench.seed}, sensors of the map {bench.map_name}. Truth is in truth.csv.",
        'signals = "signals.toml"',
        f"identification_fraction = {plan.identification_fraction}",
        "",
        "[vehicle]",
        f'name = "{vehicle.name}"',
        f"empty_mass_kg = {vehicle.sprung_kg}",
        f"wheelbase_m = {vehicle.wheelbase_m}",
        f"empty_front_share_pct = {vehicle.empty_front_share_pct:.6g}",
        f"sensor_position_m = {mount.position_m}",
        f"track_width_m = {(vehicle.front.track_m + vehicle.rear.track_m) / 2.0:.6g}",
        f"sensor_offset_left_m = {mount.left_m}",
        f"payload_range_kg = [0.0, {vehicle.rated_payload_kg}]",
        f"front_share_range_pct = [{low}, {high}]",
        f"unsprung_front_kg = {2.0 * vehicle.front.wheel.unsprung_kg}",
        f"unsprung_rear_kg = {2.0 * vehicle.rear.wheel.unsprung_kg}",
        f"wheel_radius_m = {vehicle.front.wheel.radius_m}",
        *_length_lines([carried.loads for planned in plan.drives for carried in planned.carried if carried.loads]),
    ]
    for planned, log in zip(plan.drives, logs, strict=True):
        for carried in planned.carried:
            lines += ["", "[[runs]]", f'log = "{log}"', *_run_lines(vehicle, planned, carried)]
            lines += [f'split = "{plan.split}"'] if plan.split else []
    return "\n".join(lines) + "\n"


def _length_lines(carried: Sequence[tuple[Load, ...]]) -> list[str]:
    """The campaign-file lines that state the usual length of the loads."""
    if not carried:
        return []
    reaches_m = [
        max(one.position_m + one.length_m / 2.0 for one in loads)
        - min(one.position_m - one.length_m / 2.0 for one in loads)
        for loads in carried
    ]
    return [f"payload_length_m = {median(reaches_m):.6g}"]


def _run_lines(vehicle: Vehicle, planned: PlannedDrive, carried: Carried) -> list[str]:
    lines = [f"payload_kg = {payload_kg(carried.loads):.6g}"]
    if len(carried.loads) == 1:
        lines.append(f"payload_position_m = {carried.loads[0].position_m:.6g}")
    elif carried.loads:
        lines.append(f"front_share_pct = {front_share_pct(vehicle, carried.loads):.6g}")
    if carried.loads:
        lines.append(f"payload_left_m = {payload_left_m(carried.loads):.6g}")
    if carried.start_s > 0.0:
        lines.append(f"start_s = {carried.start_s:.3f}")
    if carried.end_s < planned.drive.duration_s:
        lines.append(f"end_s = {carried.end_s:.3f}")
    return lines


MAP_NAME: Final = "reference"
LOADS: Final = (Load(270.0, 1.3), Load(400.0, 1.8), Load(150.0, 0.6))  # in turn
WINDOW_S: Final = 300.0  # BatchSettings.window_s
N_EMPTY_WINDOWS: Final = 3  # chosen
N_LOADED_WINDOWS: Final = 2  # chosen
STOP_S: Final = 75.0  # longer than the minute of standstill that ends a drive
_JITTER_MPS: Final = 0.4  # how well a driver holds a speed


def frames_of(driven: SimulatedDrive) -> Frames:
    """The frames of a drive, encoded by the signal map "reference"."""
    return Wiring(MAP_NAME).frames_of(driven.recording)


def demo_drive(seed: int = 1, start_ns: int = START_NS) -> SimulatedDrive:
    """Three empty windows of five minutes, a stop for loading, two loaded windows; returned with the true loads.

    The first seed's load is 270 kg.
    """
    load = LOADS[(seed - 1) % len(LOADS)]
    rng = np.random.default_rng(seed)
    empty = _near_50_kmh(N_EMPTY_WINDOWS * WINDOW_S, rng, stops=True)
    loaded = _near_50_kmh(N_LOADED_WINDOWS * WINDOW_S, rng, stops=False)
    whole = empty.then(standstill(STOP_S)).then(loaded)
    steps = [LoadStep(0.0, ()), LoadStep(empty.duration_s + STOP_S / 2.0, (load,))]
    road = UnevenRoad(iso_road("B"), stretch_m=600.0, spread=0.25)
    return simulate_drive(PAPER_VAN, steps, road, whole, REFERENCE, seed, start_ns)


def _near_50_kmh(hold_s: float, rng: np.random.Generator, *, stops: bool) -> Drive:
    """Accelerate from rest and hold the speed for hold_s; with the ramp this is slightly more than whole windows."""
    legs = [Leg(PAPER_SPEED_MPS, hold_s)]
    planned = drive_of([*legs, Leg(0.0, 1.0)] if stops else legs)
    wandering = constant(PAPER_SPEED_MPS, planned.duration_s + 1.0, rng, _JITTER_MPS).speed_mps
    held = planned.speed_mps * wandering[: len(planned.speed_mps)] / PAPER_SPEED_MPS
    return Drive(held, planned.lateral_mps2, planned.step_s)
