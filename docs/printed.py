"""The output of commands that the pages quote, run on simulated drives."""

import contextlib
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from click.testing import CliRunner

from gateway.cli import springscale
from gateway.offline.bundle import CONTRIBUTION, TEMPLATE
from gateway.sim.drive import rural, urban
from gateway.sim.obstacles import UnevenRoad
from gateway.sim.road import iso_road
from gateway.sim.scenario import simulate_drive
from gateway.sim.vans import SMALL_VAN
from gateway.workbench.phones import PHONE, Lying, write_export
from gateway.workbench.simulate import bench_of, write_campaign


def campaign_pack() -> str:
    """`springscale campaign pack` (docs/contribute.md): ten runs of a minute with the page's own contribution.toml."""
    with TemporaryDirectory() as folder, contextlib.chdir(folder):
        write_campaign(bench_of("experiment", longest_s=60.0), Path.cwd())
        Path(CONTRIBUTION).write_text(TEMPLATE, encoding="utf-8")
        return _output("campaign", "pack", ".", "--output", "my-van.zip")


def phone_import() -> str:
    """`springscale import` (docs/phone.md): 15 minutes of town and country, the phone turned by 130 degrees."""
    rng = np.random.default_rng(4)
    drive = urban(300.0, rng).then(rural(600.0, rng))
    road = UnevenRoad(iso_road("B"), stretch_m=600.0, spread=0.25)
    driven = simulate_drive(SMALL_VAN, (), road, drive, PHONE, 4)
    with TemporaryDirectory() as folder, contextlib.chdir(folder):
        write_export(driven.recording, Path("drive1.zip"), "phyphox", Lying())
        return _output("import", "drive1.zip", "1.log")


def _output(*command: str) -> str:
    """The command's output as a Markdown code block."""
    result = CliRunner().invoke(springscale, list(command), catch_exceptions=False)
    if result.exit_code:
        sys.exit(result.output)
    return f"```text\n{result.stdout}```\n"
