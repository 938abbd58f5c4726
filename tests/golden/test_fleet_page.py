"""docs/fleet.md shows what `make fleet-test` counted, and those counts are good."""

import json
from pathlib import Path
from typing import Any

import measured
import pytest

RUNS = json.loads(measured.COUNTS.read_text(encoding="utf-8"))


@pytest.mark.parametrize("counts", RUNS, ids=lambda counts: str(counts["vehicles"]))
def test_nothing_was_lost_and_nothing_doubled(counts: dict[str, Any]) -> None:
    assert counts["vehicles"] >= 50
    assert counts["estimate_rows"] == counts["estimates"] > 0
    assert counts["entry_rows"] == counts["entries"] > 0
    assert (counts["ids_doubled"], counts["records_missing"], counts["unreadable"]) == (0, 0, 0)


def test_a_run_takes_the_place_of_the_last_with_as_many_vehicles(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(measured, "COUNTS", tmp_path / "fleet_test.json")
    measured.COUNTS.write_text(json.dumps(RUNS[:1]))
    for n, seconds in ((500, 9.0), (RUNS[0]["vehicles"], 7.0), (500, 8.0)):
        measured.take({**RUNS[0], "vehicles": n, "seconds": seconds})
    told = [(run["vehicles"], run["seconds"]) for run in json.loads(measured.COUNTS.read_text())]
    assert told == [(RUNS[0]["vehicles"], 7.0), (500, 8.0)]
