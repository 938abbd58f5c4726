"""Writes what `springscale import` prints into docs/phone.md, for a drive that is simulated; --check compares."""

import contextlib
import re
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import numpy as np
from click.testing import CliRunner
from generated import keep_up_to_date

from gateway.cli import springscale
from gateway.sim.drive import rural, urban
from gateway.sim.obstacles import UnevenRoad
from gateway.sim.road import iso_road
from gateway.sim.scenario import simulate_drive
from gateway.sim.vans import SMALL_VAN
from gateway.workbench.phones import PHONE, Lying, write_export

PAGE: Final = Path(__file__).with_name("phone.md")
OUTPUT: Final = re.compile(r"(<!-- output: springscale import .*?-->\n).*?(<!-- end of output -->)", re.DOTALL)


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
    return result.stdout


def main() -> None:
    page = PAGE.read_text(encoding="utf-8")
    text = OUTPUT.sub(lambda found: f"{found[1]}```text\n{printed()}```\n{found[2]}", page)
    keep_up_to_date(PAGE, text, "springscale import", tolerance=0.01)


if __name__ == "__main__":
    main()
