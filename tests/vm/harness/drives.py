"""Short simulated drives as candump logs: a loaded van that the shipped calibration can weigh in 20 s batches."""

from functools import cache
from pathlib import Path

import numpy as np

from gateway.bus.logs import write_candump
from gateway.records import Frames
from gateway.sim.instruments import REFERENCE
from gateway.sim.parameters import Load
from gateway.sim.road import iso_road
from gateway.sim.scenario import START_NS, LoadStep, simulate_drive
from gateway.sim.speed_profile import constant
from gateway.sim.vans import PAPER_VAN
from gateway.workbench.simulated_campaigns import PAPER_SPEED_MPS
from gateway.workbench.wiring import Wiring

LOAD = Load(270.0, 1.3)


@cache
def loaded_drive(duration_s: float, seed: int, map_name: str = "reference") -> Frames:
    """The paper's van with 270 kg at about 50 km/h on an ISO 8608 class B road, as frames of a shipped map."""
    return _drive(duration_s, seed, map_name, (LOAD,))


def driven_with(duration_s: float, seed: int, loads: tuple[Load, ...]) -> Frames:
    """The van with these loads."""
    return _drive(duration_s, seed, "reference", loads)


def _drive(duration_s: float, seed: int, map_name: str, loads: tuple[Load, ...]) -> Frames:
    speed = constant(PAPER_SPEED_MPS, duration_s, np.random.default_rng(seed), 0.4)
    driven = simulate_drive(PAPER_VAN, [LoadStep(0.0, loads)], iso_road("B"), speed, REFERENCE, seed, START_NS)
    return Wiring(map_name).frames_of(driven.recording)


def faster(frames: Frames, times: float) -> Frames:
    """The frames with their stamps closer together, in whole microseconds: canplayer reads no finer ones."""
    t_ns = START_NS + ((frames.t_ns - START_NS) / times / 1000).astype(np.int64) * 1000
    return Frames(t_ns, frames.can_id, frames.length, frames.payload)


def log_of(frames: Frames, path: Path) -> Path:
    """A candump log of can0."""
    write_candump(frames, "can0", path)
    return path
