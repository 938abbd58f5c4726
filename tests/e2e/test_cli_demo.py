"""The demonstration: simulator, bus, service, database, and what it tells of a load it was not told."""

import json
import sys

import pytest
from support.commands import run

from gateway.cli import main


def test_the_demo_weighs_the_van_before_and_after_loading() -> None:
    found = run("demo", "--once", "--json")
    records = [json.loads(line) for line in found.stdout.splitlines()]
    counted = [record for record in records if not record["rejected"]]
    payloads = [record["payload_kg"] for record in counted]
    assert len(payloads) == 5
    assert all(abs(payload) < 60.0 for payload in payloads[:3])
    assert all(abs(payload - 270.0) < 60.0 for payload in payloads[3:])
    assert [record["epoch_n_batches"] for record in counted] == [1, 2, 3, 1, 2]  # the stop opened a new epoch
    assert counted[2]["epoch_payload_std_kg"] < counted[2]["payload_std_kg"]


def test_a_fleet_is_shown_by_one_command() -> None:
    """Two vans, one of them too heavy: what the page would show."""
    found = run("demo", "--fleet", "2", "--once")
    light, heavy = [json.loads(line) for line in found.stdout.splitlines()]
    assert (light["vehicle_id"], heavy["vehicle_id"]) == ("van-1", "van-2")
    assert abs(light["estimate"]["payload_kg"] - 270.0) < 60.0
    assert abs(heavy["estimate"]["payload_kg"] - 400.0) < 60.0
    assert light["alarms"] == []
    assert heavy["estimate"]["weights"]["gross"]["is_over_limit"]
    assert [(alarm["kind"], alarm["where"]) for alarm in heavy["alarms"]] == [("overload", "gross")]
    assert heavy["used_share"] > 1.0 > light["used_share"] > 0.0


def test_the_fleet_demo_names_the_missing_package(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in [name for name in sys.modules if name.startswith(("gateway.fleet", "gateway.cli.demo_fleet"))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "sqlalchemy", None)
    with pytest.raises(SystemExit):
        main(["demo", "--fleet", "1", "--once"])
    assert "this command needs sqlalchemy: pip install 'springscale[fleet]'" in capsys.readouterr().err
