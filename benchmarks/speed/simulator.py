"""How fast the simulator drives: seconds of driving per second of one core."""

import time
from collections.abc import Callable

import numpy as np

from gateway.sim.instruments import REFERENCE
from gateway.sim.parameters import Load
from gateway.sim.ride import ride
from gateway.sim.road import PaperRoad, iso_road
from gateway.sim.scenario import simulate_drive
from gateway.sim.speed_profile import constant
from gateway.sim.vans import PAPER_VAN
from gateway.workbench.wiring import Wiring

DRIVE_S = 900.0  # chosen


def measure() -> dict[str, float]:
    """Times real time, warm, of each stage."""
    rng = np.random.default_rng(1)
    drive, loads = constant(50.0 / 3.6, DRIVE_S, rng), (Load(270.0, 1.3),)
    road = iso_road("B").lay(drive.travelled_m[-1] + 50.0, rng)
    recording = simulate_drive(PAPER_VAN, loads, PaperRoad(), drive, REFERENCE, 1).recording
    wiring = Wiring("reference")
    stages: dict[str, Callable[[], object]] = {
        "vehicle alone, 1 kHz": lambda: ride(PAPER_VAN, loads, road, drive),
        "road, vehicle, sensors": lambda: simulate_drive(PAPER_VAN, loads, iso_road("B"), drive, REFERENCE, 1),
        "encoding to frames": lambda: wiring.frames_of(recording),
    }
    rates = {}
    for name, run in stages.items():
        run()
        begun_s = time.process_time()
        run()
        rates[name] = DRIVE_S / (time.process_time() - begun_s)
    return rates
