"""What `springscale import` prints (docs/phone.md), for a drive that is simulated."""

import contextlib
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from click.testing import CliRunner

from gateway.cli import springscale
from gateway.sim.drive import rural, urban
from gateway.sim.obstacles import UnevenRoad
from gateway.sim.road import iso_road
from gateway.sim.scenario import simulate_drive
from gateway.sim.vans import SMALL_VAN
from gateway.workbench.phones import PHONE, Lying, write_export


def printed() -> str:
    """The output for a quarter of an hour of town and country, the phone turned by 130 degrees."""
    rng = np.random.default_rng(4)
    drive = urban(300.0, rng).then(rural(600.0, rng))
    road = UnevenRoad(iso_road("B"), stretch_m=600.0, spread=0.25)
    driven = simulate_drive(SMALL_VAN, (), road, drive, PHONE, 4)
    with TemporaryDirectory() as folder, contextlib.chdir(folder):
        write_export(driven.recording, Path("drive1.zip"), "phyphox", Lying())
        result = CliRunner().invoke(springscale, ["import", "drive1.zip", "1.log"], catch_exceptions=False)
    if result.exit_code:
        sys.exit(result.output)
    return f"```text\n{result.stdout}```\n"
