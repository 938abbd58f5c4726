"""docs/phone.md, command by command as it is written, with recordings that are made in place of the drives."""

import contextlib
import json
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.commands import printed

from gateway.sim.drive import rural, urban
from gateway.sim.obstacles import UnevenRoad
from gateway.sim.road import iso_road
from gateway.sim.scenario import simulate_drive
from gateway.sim.vans import SMALL_VAN
from gateway.sim.vehicle import Load
from gateway.workbench.phones import PHONE, Lying, write_export

PAGE = (Path(__file__).parents[2] / "docs/phone.md").read_text(encoding="utf-8")
COMMANDS = re.findall(r"^    springscale (.+)$", PAGE, re.MULTILINE)
CAMPAIGN = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)[0]
CARRIED = Load(250.0, 1.9)  # on the drive that is weighed
ROAD = UnevenRoad(iso_road("B"), stretch_m=600.0, spread=0.25)
DRIVE_S = (170.0, 370.0)  # in town, in the country: shorter than the page asks for, which makes no other command


def record(path: Path, loads: tuple[Load, ...], seed: int) -> None:
    rng = np.random.default_rng(seed)
    drive = urban(DRIVE_S[0], rng).then(rural(DRIVE_S[1], rng))
    write_export(simulate_drive(SMALL_VAN, loads, ROAD, drive, PHONE, seed).recording, path, "phyphox", Lying(), seed)


@pytest.fixture
def drives(tmp_path: Path) -> dict[str, Any]:
    """What the page's campaign says, and a recording of each of its drives and of one more."""
    told = tomllib.loads(CAMPAIGN)
    for n, one in enumerate(told["runs"], 1):
        loads = (Load(one["payload_kg"], one["payload_position_m"]),) if one["payload_kg"] else ()
        record(tmp_path / f"drive{n}.zip", loads, n)
    record(tmp_path / "another.zip", (CARRIED,), len(told["runs"]) + 1)
    (tmp_path / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    return told


def test_every_command_of_the_page_works_in_turn(tmp_path: Path, drives: dict[str, Any]) -> None:
    vehicle = drives["vehicle"]
    assert vehicle["empty_mass_kg"] == SMALL_VAN.sprung_kg  # the page's car is the one that is driven here
    assert vehicle["empty_front_share_pct"] == pytest.approx(SMALL_VAN.empty_front_share_pct, abs=0.2)
    assert (vehicle["wheelbase_m"], vehicle["track_width_m"]) == (SMALL_VAN.wheelbase_m, SMALL_VAN.front.track_m)
    assert (vehicle["sensor_position_m"], vehicle["sensor_offset_left_m"]) == (
        PHONE.mount.position_m,
        PHONE.mount.left_m,
    )
    with contextlib.chdir(tmp_path):
        *before, last = COMMANDS
        for command in before:
            printed(*command.split())
        estimates = [json.loads(line) for line in printed(*last.split(), "--json").splitlines()]
    assert len(COMMANDS) == 6
    whole = [one for one in estimates if not one["rejected"]]
    assert whole
    for one in whole:
        low, high = one["payload_interval95_kg"]
        assert low <= CARRIED.mass_kg <= high
