"""A real car's recorded drive as an unknown log: gravity and braking find the map that a person had made for it."""

import json
from pathlib import Path

import pytest
from support.commands import run
from support.recordings import recordings

from gateway.bus.signals import load_signal_map
from gateway.records import Signal


@pytest.mark.parametrize("trip", ["A", "B"])
def test_the_map_of_a_real_car_is_found_from_its_log(trip: str, tmp_path: Path) -> None:
    folder = recordings() / "real_drive"
    arguments = ["look", str(folder / f"candump_trip{trip}.log.gz"), "--output", str(tmp_path / "s.toml"), "--json"]
    found = run(*arguments)
    told = json.loads(found.stdout)
    assert told["can_work"]
    assert not any(one["fits"] for one in told["maps"])  # mounted otherwise than canmod_gps.toml says
    mine, theirs = (
        {m.signal: (m.dbc_signal, m.to_si, m.valid_when) for message in one.messages for m in message.signals}
        for one in (load_signal_map(tmp_path / "s.toml"), load_signal_map(folder / "signals_roll.toml"))
    )
    assert {signal: mine[signal] for signal in theirs} == theirs
    assert mine.keys() - theirs.keys() == {Signal.LONGITUDINAL_ACCELERATION}
    assert load_signal_map(tmp_path / "s.toml").channel == "can1"
