"""Drives of a simulated van whose sensor sits off the centre line, with loads that may lie off it too.

The simulator shares no model with the estimators: four wheels, dampers with friction, springs that stiffen.
"""

from dataclasses import replace

import numpy as np

from benchmarks.accuracy.drives import known_run, stated
from gateway.bus.signals import Decoder, load_signal_map
from gateway.calibration.known_run import KnownRun
from gateway.sim.instruments import REFERENCE
from gateway.sim.obstacles import UnevenRoad
from gateway.sim.parameters import Load
from gateway.sim.road import iso_road
from gateway.sim.scenario import simulate_drive
from gateway.sim.speed_profile import constant
from gateway.sim.vans import PAPER_VAN
from gateway.workbench.wiring import Wiring

SENSORS = replace(REFERENCE, mount=replace(REFERENCE.mount, left_m=0.3))
VEHICLE = stated(PAPER_VAN, SENSORS)
ROAD = UnevenRoad(iso_road("B"), stretch_m=600.0, spread=0.25)


def driven(number: int, loads: tuple[Load, ...], seed: int, duration_s: float = 310.0) -> KnownRun:
    """One batch at about 14 m/s, through sensors, frames and decoder."""
    course = constant(14.0, duration_s, np.random.default_rng([seed, number]), jitter_std_mps=0.4)
    simulated = simulate_drive(PAPER_VAN, loads, ROAD, course, SENSORS, 100 * seed + number)
    rows = Decoder(load_signal_map("springscale:reference")).decode(Wiring("reference").frames_of(simulated.recording))
    return known_run(rows, number, f"drive {number}", PAPER_VAN, loads)


def known_drives() -> list[KnownRun]:
    """Empty, and three loads about the centre line."""
    loads: list[tuple[Load, ...]] = [(), (Load(150.0, 0.6),), (Load(280.0, 2.6),), (Load(430.0, 1.4),)]
    return [driven(number, load, seed=1) for number, load in enumerate(loads, 1)]
