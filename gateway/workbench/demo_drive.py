"""The drives of the demo: a van drives empty, is loaded, and drives on. Each drive has another load."""

from typing import Final

import numpy as np

from gateway.records import Frames
from gateway.sim.drive import Drive, Leg, constant, drive_of, standstill
from gateway.sim.obstacles import UnevenRoad
from gateway.sim.road import iso_road
from gateway.sim.scenario import START_NS, LoadStep, SimulatedDrive, simulate_drive
from gateway.sim.sensors import REFERENCE
from gateway.sim.vans import PAPER_VAN
from gateway.sim.vehicle import Load
from gateway.workbench.campaigns import PAPER_SPEED_MPS
from gateway.workbench.wiring import Wiring

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
