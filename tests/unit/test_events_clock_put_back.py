"""Load events and trips where the clock was ahead and is put right: batches count in the order in which they came."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import pytest
from support.days import RULES, assert_a_restart_changes_nothing, batch, day, told, trips

from gateway.core.events import ledger
from gateway.core.events.entry import Entry
from gateway.core.events.ledger import Ledger
from gateway.estimate import Estimate, Watched

DAY_MIN = 24 * 60.0
AHEAD_MIN = 3 * DAY_MIN + 7.0


def moved(estimates: list[Estimate], minutes: float) -> list[Estimate]:
    """The same batches by another clock; they have no stops of their own."""
    by_ns = round(minutes * 60e9)
    return [replace(one, t_start_ns=one.t_start_ns + by_ns, t_end_ns=one.t_end_ns + by_ns) for one in estimates]


def put_right(*kg_of_leg: float | None, ahead: int, ahead_min: float = AHEAD_MIN, **how) -> list[Estimate]:
    """A day whose first batches were driven by a clock that was ahead."""
    whole = day(*kg_of_leg, **how)
    return moved(whole[:ahead], ahead_min) + whole[ahead:]


def told_with(estimates: list[Estimate]) -> Iterator[tuple[int, Entry]]:
    ledger = Ledger(RULES)
    return ((n, entry) for n, one in enumerate(estimates) for entry in ledger.add(one))


def changes(estimates: list[Estimate]) -> list[dict]:
    return [entry.record for entry in told(estimates).values() if entry.kind == "event"]


@pytest.mark.parametrize("ahead_min", [18.0, 60.0, DAY_MIN, 3650 * DAY_MIN])
def test_a_delivery_after_it_is_told_as_without_it(ahead_min):
    (expected,) = changes(day(400.0, 400.0, 220.0))
    (found,) = changes(put_right(400.0, 400.0, 220.0, ahead=1, ahead_min=ahead_min))
    assert found == expected
    assert found["stops"]


def test_a_delivery_after_it_is_told_with_the_first_batch_that_weighs_it():
    whole = put_right(400.0, 400.0, 220.0, ahead=4, batches=4)
    assert min(n for n, entry in told_with(whole) if entry.kind == "event") == 8


def test_the_stop_after_it_counts_as_likely_as_without_it():
    """A change as small as this is told for the door that opened; rolling it would be noise."""
    legs = {"batches": 2, "door": True}
    (expected,) = changes(day(300.0, 300.0, 264.0, **legs))
    (found,) = changes(put_right(300.0, 300.0, 264.0, ahead=2, **legs))
    assert [stop["door_opened"] for stop in found["stops"]] == [True]
    assert (found["t_start"], found["t_end"]) == (expected["t_start"], expected["t_end"])


def test_trips_before_and_after_it_are_told_and_all_but_the_last_are_over():
    found = trips(put_right(300.0, 300.0, 300.0, ahead=1))
    assert [trip["is_over"] for trip in found] == [True, True, False]
    assert all(trip["t_start"] < trip["t_end"] for trip in found)


def test_a_load_while_it_was_put_right_is_told_at_the_right_time():
    whole = put_right(400.0, 400.0, 100.0, 100.0, ahead=2)
    (found,) = changes(whole)
    assert found["change_kg"] == pytest.approx(-300.0)
    assert found["t_start"] <= found["t_end"]
    (right,) = changes(day(400.0, 400.0, 100.0, 100.0))
    assert found["t_end"] == right["t_end"]


def test_a_load_in_the_minutes_before_it_is_told_in_order():
    """Two legs without a weighing, one by each clock: both stops are named that can have been long enough."""
    whole = put_right(400.0, None, None, 100.0, ahead=2)
    (found,) = changes(whole)
    assert len(found["stops"]) == 2
    assert found["t_start"] <= found["t_end"]
    assert all(stop["t_start"] <= stop["t_end"] for stop in found["stops"])


def test_each_drive_that_begins_in_1970_hides_no_load():
    """No clock battery: the first batch of a day is of 1970, until the date is learned."""
    evening, morning = day(300.0), moved(day(100.0, 100.0), DAY_MIN)
    first = replace(batch(0.0, 1.0, None), t_start_ns=0, t_end_ns=60_000_000_000)
    (expected,) = changes([*evening, *morning])
    (found,) = changes([*evening, first, *morning])
    for name in ("change_kg", "t_start", "t_end", "before", "after"):
        assert found[name] == expected[name]


def test_a_restart_after_it_goes_on_as_if_it_had_not_been():
    assert_a_restart_changes_nothing(put_right(0.0, 500.0, 500.0, 320.0, 200.0, ahead=5, batches=2))


def test_what_is_old_stays_as_it_was_told_whatever_the_clock_did(monkeypatch):
    monkeypatch.setattr(ledger, "HORIZON", 60)
    monkeypatch.setattr(ledger, "SETTLED", 30)
    whole = put_right(400.0, 300.0, *[300.0] * 80, ahead=3)
    revisions = [(n, entry) for n, entry in told_with(whole) if entry.kind == "event"]
    assert len({entry.id for _, entry in revisions}) == 1
    assert max(n for n, _ in revisions) <= 31
    assert not revisions[-1][1].record["is_withdrawn"]


def test_put_right_at_a_stop_the_door_that_opened_is_of_that_stop():
    first, second = put_right(300.0, 264.0, ahead=1)
    second = replace(second, way=replace(second.way, before=Watched(True, None)))
    (found,) = changes([first, second])
    assert [stop["door_opened"] for stop in found["stops"]] == [True]


def test_revisions_rise_by_one_each():
    found: dict[str, list[int]] = {}
    for _, entry in told_with(put_right(0.0, 500.0, 320.0, 200.0, ahead=4, batches=3)):
        found.setdefault(entry.id, []).append(entry.revision)
    assert len(found) > 3
    assert all(other == one + 1 for revisions in found.values() for one, other in pairwise(revisions))
