"""Logs of simulated drives, their size on disk, and the cost of reading and weighing them."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.speed.day import FRAMES_PER_S, busy_drive
from benchmarks.speed.meter import CALIBRATION
from gateway.bus.logs import motion_of_log, write_candump
from gateway.bus.signals import load_signal_map
from gateway.core.flow import Identity
from gateway.estimate import Estimate
from gateway.offline.estimates import estimates_of_logs
from gateway.records import Frames
from gateway.setup import Setup, load_setup
from gateway.sim.scenario import START_NS
from gateway.units import NS_PER_S
from gateway.workbench.simulate import demo_drive, frames_of

SIGNALS = "springscale:reference"
REPEATS = 3  # chosen: the fastest counts
APART_NS = 86_400 * NS_PER_S  # a drive a day


@dataclass(frozen=True, slots=True)
class Weighed:
    """The records of some logs, and the CPU seconds for reading and weighing them."""

    estimates: list[Estimate]
    cpu_s: float


def write_drives(folder: Path, n_drives: int) -> Iterator[tuple[Path, float]]:
    """A log of each drive's mapped frames -> (path, hours)."""
    for seed in range(1, n_drives + 1):
        frames = frames_of(demo_drive(seed, START_NS + seed * APART_NS))
        path = folder / f"drive{seed}.log.gz"
        write_candump(frames, "can0", path)
        yield path, _hours(frames)


def bytes_of_the_bus(folder: Path) -> dict[str, float]:
    """The first drive among all the other traffic of a bus: bytes an hour as text and as .gz, Mframes/s read."""
    frames = busy_drive()
    hours = _hours(frames)
    text, packed = folder / "bus.log", folder / "bus.log.gz"
    write_candump(frames, "can0", text)
    write_candump(frames, "can0", packed)
    return {
        "frames_per_s": FRAMES_PER_S,
        "hours": hours,
        "text_bytes_per_hour": text.stat().st_size / hours,
        "gz_bytes_per_hour": packed.stat().st_size / hours,
        "text_mframes_per_cpu_s": len(frames) / _cpu_to_read(text) / 1e6,
        "gz_mframes_per_cpu_s": len(frames) / _cpu_to_read(packed) / 1e6,
    }


def weigh(logs: Sequence[Path], vehicle_id: str) -> Weighed:
    """Every log through the pipeline of `springscale estimate`; the fastest of some runs."""
    setup = load_setup(SIGNALS, CALIBRATION, identity=Identity(vehicle_id))
    list(estimates_of_logs(logs[:1], setup))  # computations once per process are not part of a batch
    runs = [_weighed(logs, setup) for _ in range(REPEATS)]
    return min(runs, key=lambda run: run.cpu_s)


def _weighed(logs: Sequence[Path], setup: Setup) -> Weighed:
    begun_s = time.process_time()
    estimates = list(estimates_of_logs(logs, setup))
    return Weighed(estimates, time.process_time() - begun_s)


def _cpu_to_read(path: Path) -> float:
    signal_map = load_signal_map(SIGNALS)
    took_s = []
    for _ in range(REPEATS):
        begun_s = time.process_time()
        motions, _, _ = motion_of_log(path, signal_map)
        for _ in motions:
            pass
        took_s.append(time.process_time() - begun_s)
    return min(took_s)


def _hours(frames: Frames) -> float:
    return float(frames.t_ns[-1] - frames.t_ns[0]) / NS_PER_S / 3600.0
