"""springscale commission: every step as an option, for scripts; refusals in the service's own words."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from support.commissioning import Bench, fitted
from support.web import Gateway, serving

from gateway.cli import commission as command
from gateway.core.cargo import is_said
from gateway.errors import SpringscaleError

VEHICLE = ("--front-axle-kg", "690", "--rear-axle-kg", "710", "--wheelbase-m", "2.75", "--sensor-m", "1.2")


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path)


@pytest.fixture
def url(tmp_path: Path, bench: Bench) -> Iterator[str]:
    with Gateway(tmp_path / "store", commissioning=bench.desk) as gateway, serving(gateway.app) as server:
        yield server.url


def run(url: str, *arguments: str, answers: str | None = None) -> Result:
    return CliRunner().invoke(command.commission, [*arguments, "--url", url], input=answers)


def test_one_call_answers_everything(url: str, bench: Bench) -> None:
    begun = run(url, "start", *VEHICLE, "--empty", "--note", "yard", "--json")
    assert begun.exit_code == 0, begun.exception
    underway = json.loads(begun.stdout)["underway"]
    assert (underway["step"], underway["note"], underway["vehicle"]["wheelbase_m"]) == ("drive", "yard", 2.75)
    bench.drive(0)
    bench.worker.finish(fitted(payload_std_kg=36.0))
    shown = run(url, "show")
    assert "next: drive, empty" in shown.stdout
    assert "5 min driven, one window: 50% of the goal" in shown.stdout
    assert "next: the calibration is being made" in run(url, "fit").stdout
    bench.worker.finish(fitted(payload_std_kg=36.0))
    made = run(url, "show").stdout
    assert "in use: sha256:" in made
    assert "van-17 like any vehicle, one window, made 2026-09-21T14:13:20Z by local (yard)" in made
    assert "another calibration counts from the next drive on" in made
    assert "undone" in run(url, "undo").stdout


def test_what_it_carries_can_be_said_and_reaches_the_vehicle_that_is_fitted(url: str, bench: Bench) -> None:
    loads = ("--carries", "parcels", "--payload-length-m", "2.4", "--payload-height-m", "1.2", "--roof-rack")
    begun = json.loads(run(url, "start", *VEHICLE, *loads, "--empty", "--json").stdout)
    said = begun["underway"]["vehicle"]
    assert [said[key] for key in ("carries", "payload_length_m", "payload_height_m")] == ["parcels", 2.4, 1.2]
    assert (said["roof_rack"], said["tow_bar"]) == (True, False)
    bench.drive(0)
    stated = bench.worker.jobs[-1].vehicle
    assert (stated.carries, stated.payload_length_m, stated.payload_height_m) == ("parcels", 2.4, 1.2)
    assert (stated.roof_rack, stated.tow_bar, is_said(stated)) == (True, False, True)
    assert run(url, "start", "--carries", "elephants").exit_code == 2


def test_what_it_may_carry_can_be_said(url: str) -> None:
    begun = json.loads(run(url, "start", *VEHICLE, "--payload-kg", "1200", "--empty", "--json").stdout)
    assert begun["underway"]["vehicle"]["payload_range_kg"] == [0.0, 1200.0]


def test_steps_may_come_one_by_one(url: str) -> None:
    assert isinstance(run(url, "start").exception, SystemExit)
    assert json.loads(run(url, "show", "--json").stdout)["underway"]["step"] == "vehicle"
    kept = run(url, "start", *VEHICLE)
    assert isinstance(kept.exception, SpringscaleError)
    assert "--empty" in str(kept.exception)
    assert json.loads(run(url, "start", "--empty", "--json").stdout)["underway"]["step"] == "drive"
    assert json.loads(run(url, "cancel", "--json").stdout)["underway"] is None


def test_a_person_is_asked(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command, "_is_at_terminal", lambda: True)
    begun = run(url, "start", "--no-follow", answers="690\n710\n2.75\n1.2\ny\n")
    assert begun.exit_code == 0, (begun.output, begun.exception)
    assert "Wheelbase [m]" in begun.stdout
    assert "next: drive, empty" in begun.stdout


def test_what_is_wrong_is_told_in_words(url: str) -> None:
    refused = run(url, "fit")
    assert isinstance(refused.exception, SpringscaleError)
    assert "no commissioning is under way" in str(refused.exception)
    missing = run(url, "start", "--front-axle-kg", "690")
    assert "--rear-axle-kg" in missing.output
