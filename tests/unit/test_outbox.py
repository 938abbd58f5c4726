"""An outbox: all kinds that are wanted, in order and once; after a break, what a killed broker may have forgotten."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from support.estimates import make_record
from support.patience import PATIENCE_S
from support.sequence import drained

from gateway.records import json_line
from gateway.store import Retention, Store
from gateway.uplink.outbox import Outbox

NAME = "https://fleet.example/hook"


def tell(store: Store, *what: str) -> None:
    """Rows in order: "estimate", or "event-1" and so on for an entry."""
    for n, each in enumerate(what):
        if each == "estimate":
            store.write_estimate(make_record(store.health().n_written * 100 + n))
        else:
            record = {"id": each, "revision": 1, "kind": "drift", "where": None}
            store.write_entry(each.partition("-")[0], each, n, json_line(record))
    assert store.flush(PATIENCE_S)


def outbox(store: Store, *only: str) -> Outbox:
    return Outbox(store, NAME, only=only)


def ids(box: Outbox, most: int = 10_000) -> list[str]:
    return [letter.id for letter in drained(box, most)]


MIXED = ("event-1", "estimate", "trip-1", "estimate", "estimate", "alarm-1", "estimate", "event-2", "trip-2", "alarm-2")


@pytest.mark.parametrize("page", [1, 2, 3, 100])
@pytest.mark.parametrize("only", [("alarm",), ("alarm", "event"), ("event", "trip", "alarm"), ("trip",)])
def test_wanted_records_come_in_order_and_once(
    store: Store, only: tuple[str, ...], page: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gateway.uplink.outbox.PAGE", page)
    tell(store, *MIXED)
    wanted = [f"{each}-1" for each in MIXED if each.partition("-")[0] in only]
    assert ids(outbox(store, *only)) == wanted
    assert store.flush(PATIENCE_S)
    assert ids(outbox(store, *only)) == []  # as after a restart


def test_unwanted_records_count_as_delivered_so_that_age_may_remove_them(store: Store) -> None:
    tell(store, *["estimate"] * 7, "trip-1")
    box = outbox(store, "alarm")
    assert box.next() is None
    assert store.flush(PATIENCE_S)
    kept = store.reader().delivery(NAME)
    assert kept.n_waiting == 0
    assert kept.cursor == store.reader().entries(limit=1).last_cursor
    tell(store, "estimate", "alarm-1", "estimate")
    assert box.look().n_waiting == 1
    assert ids(box) == ["alarm-1-1"]
    assert store.flush(PATIENCE_S)
    assert box.look().n_waiting == 0


def test_entries_that_retention_takes_undelivered_are_counted_and_newer_revisions_are_not(tmp_path: Path) -> None:
    now_ns = [1_800_000_000_000_000_000]

    store = Store.open(tmp_path, Retention(max_age_s=100.0), lambda: now_ns[0])
    box = outbox(store, "alarm")
    assert box.next() is None
    tell(store, "alarm-0", "estimate")
    assert ids(box, 1) == ["alarm-0-1"]
    tell(store, "alarm-1", "alarm-1", "alarm-2")  # the second takes the place of the first
    now_ns[0] += 1_000_000_000_000
    tell(store, "estimate")
    tell(store, "estimate")
    assert store.flush(PATIENCE_S)
    assert box.look().n_pruned == 2
    assert store.delivery(NAME).n_pruned == 3  # of an uplink that sends estimates too
    store.close()


class Clock:
    now_s = 0.0


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    moving = Clock()
    monkeypatch.setattr("gateway.uplink.outbox.time.monotonic", lambda: moving.now_s)
    return moving


@pytest.fixture
def six(tmp_path: Path) -> Iterator[Store]:
    opened = Store.open(tmp_path)
    for n in range(6):
        opened.write_estimate(make_record(n))
    assert opened.flush(PATIENCE_S)
    yield opened
    opened.close()


IDS = [make_record(n)["id"] for n in range(6)]


def delivered(outbox: Outbox, n: int, clock: Clock) -> list[str]:
    """The next ``n``, one a second."""
    said = []
    for _ in range(n):
        clock.now_s += 1.0
        said += ids(outbox, 1)
    return said


def test_recently_delivered_records_are_repeated(six: Store, clock: Clock) -> None:
    outbox = Outbox(six, "fleet", repeat_s=1.5)
    assert delivered(outbox, 4, clock) == IDS[:4]
    clock.now_s += 1000.0  # a dead link may be noticed late: what counts is the time before the last delivery
    outbox.repeat()
    outbox.repeat()  # nothing was delivered in between
    assert ids(outbox) == IDS[2:]


def test_a_second_break_in_the_middle_begins_no_later(six: Store, clock: Clock) -> None:
    outbox = Outbox(six, "fleet", repeat_s=1.5)
    delivered(outbox, 4, clock)
    outbox.repeat()
    assert delivered(outbox, 1, clock) == IDS[2:3]
    outbox.repeat()
    assert ids(outbox) == IDS[2:]


def test_without_it_nothing_that_was_delivered_comes_again(six: Store, clock: Clock) -> None:
    outbox = Outbox(six, "fleet")
    delivered(outbox, 4, clock)
    outbox.repeat()
    assert ids(outbox) == IDS[4:]


def test_a_database_that_was_replaced_is_delivered_from_its_first_row(six: Store, tmp_path: Path) -> None:
    outbox = Outbox(six, "fleet")
    assert ids(outbox) == IDS
    other = Store.open(tmp_path / "other")
    tell(other, "estimate", "estimate")
    outbox._journal, outbox._follower = other, other.follow(outbox._kinds, outbox._follower.place, lambda: None)
    assert len(ids(outbox)) == 2
    other.close()
