"""springscale state: each kind of statement, the list, a table, and what is refused, against a served learner."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.commands import called
from support.learner import ANSWERS, LearnerBench, at, found
from support.web import Gateway, serving

from gateway.stated.facts import VehicleAnswers


@pytest.fixture
def bench(tmp_path: Path) -> LearnerBench:
    made = LearnerBench(tmp_path / "vehicle")
    made.learner.van.state(VehicleAnswers(**ANSWERS), "workshop", is_confirmed=False)
    return made


@pytest.fixture
def url(tmp_path: Path, bench: LearnerBench) -> Iterator[str]:
    with Gateway(tmp_path / "store", learner=bench.learner) as gateway, serving(gateway.app) as server:
        yield server.url


def said(url: str, *words: str) -> dict[str, Any]:
    result = called("state", *words, "--url", url, "--json")
    assert result.exit_code == 0, result.output
    told: dict[str, Any] = json.loads(result.stdout)
    return told


@pytest.mark.parametrize(
    ("words", "source", "load"),
    [
        (("empty",), "empty", {"payload_kg": 0.0}),
        (("note", "310", "--plus-minus", "25"), "delivery_note", {"payload_kg": 310.0, "plus_minus_kg": 25.0}),
        (("scale", "--gross", "1890"), "scale", {"gross_kg": 1890.0}),
        (("axles", "850", "1040"), "axle_scales", {"front_axle_kg": 850.0, "rear_axle_kg": 1040.0}),
    ],
)
def test_each_kind_of_statement(url: str, words: tuple[str, ...], source: str, load: dict[str, float]) -> None:
    told = said(url, *words, "--ref", "LS-1", "--from", at(0), "--until", at(300), "--check", "--note", "yard")
    assert (told["source"], told["ref"], told["learn"], told["note"]) == (source, "LS-1", False, "yard")
    assert {name: kg for name, kg in told["load"].items() if kg is not None} == load
    assert (told["from"], told["until"]) == (at(0), at(300))


def test_without_a_time_it_holds_from_now_on(url: str) -> None:
    told = said(url, "note", "310")
    assert told["until"] is None
    assert told["from"] > "2026"


def test_the_list_shows_findings_and_questions(url: str, bench: LearnerBench) -> None:
    one = said(url, "note", "310", "--from", at(0), "--ref", "LS-1")
    bench.drive(0)
    bench.turn()
    bench.finish(**found(bench, "held", 120.0, "says 310 kg, the drive shows 120 ± 40 kg: is it of another drive?"))
    text = called("state", "list", "--url", url).stdout
    assert f"{one['id']} LS-1: 310 kg, delivery note" in text
    assert "held; found without it: 120 ± 40 kg" in text
    assert "is it of another drive?" in text
    assert f"springscale state confirm {one['id']}" in text
    assert [item["id"] for item in said(url, "list", "--state", "held")["items"]] == [one["id"]]
    assert said(url, "confirm", "LS-1")["confirmed"]
    assert said(url, "withdraw", one["id"][:8])["state"] == "withdrawn"
    refused = called("state", "withdraw", "LS-1", "--url", url)
    assert refused.exit_code == 1
    assert "springscale state list" in str(refused.exception)


def test_drives_that_look_empty_and_were_not_are_not_asked_about_again(url: str, bench: LearnerBench) -> None:
    bench.drive(0)
    bench.turn()
    drives = tuple({"number": n + 1, "t_start": at(600 * n), "t_end": at(600 * n + 300)} for n in range(2))
    bench.finish(drives=drives, looks_empty=(1, 2))
    left = called("state", "not-empty", at(600), "--url", url).stdout
    assert left.startswith("The drive of ")
    assert "not asked about again" in called("state", "not-empty", "--url", url).stdout
    refused = called("state", "not-empty", "--url", url)
    assert refused.exit_code == 1
    assert "no such drive is asked about" in str(refused.exception)


def test_an_empty_list_gives_advice(url: str) -> None:
    assert "springscale state note 310" in called("state", "list", "--url", url).stdout


def test_a_table_is_tried_and_then_taken(url: str, tmp_path: Path) -> None:
    table = tmp_path / "notes.csv"
    table.write_text("from;payload_kg;ref\n21.09.2026 18:00;310,5;A\nnever;12;B\n")
    options = ("--timezone", "Europe/Berlin", "--url", url)
    tried = called("state", "import", str(table), "--dry-run", *options).stdout
    assert tried.startswith("2 rows: 0 match a drive, 1 waits, 1 bad (row 3)\n")
    assert "row 3: from: never: no time" in tried
    assert tried.endswith("this was a dry run\n")
    assert said(url, "list")["items"] == []
    called("state", "import", str(table), *options)
    assert [one["from"] for one in said(url, "list")["items"]] == ["2026-09-21T18:00:00+02:00"]


@pytest.mark.parametrize("command", [("state", "import"), ("learn", "any.log", "--vehicle", "van.toml")])
def test_a_zone_that_differs_between_computers_is_refused(command: tuple[str, ...]) -> None:
    refused = called(*command, "notes.csv", "--timezone", "localtime")
    assert refused.exit_code == 2
    assert "localtime is another zone on every computer; write one as Europe/Berlin, or UTC" in refused.output


def test_an_invalid_time_is_refused_before_sending(url: str) -> None:
    refused = called("state", "empty", "--from", "this morning", "--url", url)
    assert refused.exit_code == 2
    assert "write it as 2026-11-26T07:40" in refused.output
