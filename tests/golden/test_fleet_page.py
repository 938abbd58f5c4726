"""docs/fleet.md shows what `make fleet-test` counted, and those counts are good."""

import json

import make_fleet


def test_the_page_shows_the_counts() -> None:
    assert make_fleet.fleet_page() == make_fleet.PAGE.read_text(encoding="utf-8"), "run `make docs`"


def test_nothing_was_lost_and_nothing_doubled() -> None:
    counts = json.loads(make_fleet.COUNTS.read_text(encoding="utf-8"))
    assert counts["vehicles"] >= 50
    assert counts["estimate_rows"] == counts["estimates"] > 0
    assert counts["entry_rows"] == counts["entries"] > 0
    assert (counts["ids_doubled"], counts["records_missing"], counts["unreadable"]) == (0, 0, 0)
