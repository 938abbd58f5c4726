"""[uplink] repeat_s: after a break the outbox says again what a killed broker may have forgotten."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from support.estimates import make_record
from support.patience import PATIENCE_S

from gateway.store import Store
from gateway.uplink.outbox import Outbox


class Clock:
    now_s = 0.0


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    moving = Clock()
    monkeypatch.setattr("gateway.uplink.outbox.time.monotonic", lambda: moving.now_s)
    return moving


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
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
        (letter,) = outbox.next_messages(1)
        clock.now_s += 1.0
        outbox.delivered(letter)
        said.append(letter.id)
    return said


def test_what_was_delivered_lately_is_said_again(store: Store, clock: Clock) -> None:
    outbox = Outbox(store, "fleet", repeat_s=1.5)
    assert delivered(outbox, 4, clock) == IDS[:4]
    clock.now_s += 1000.0  # a dead link may be noticed late: what counts is the time before the last delivery
    outbox.rewind()
    outbox.rewind()  # no connection yet
    assert [letter.id for letter in outbox.next_messages(9)] == IDS[2:]


def test_a_second_break_in_the_middle_begins_no_later(store: Store, clock: Clock) -> None:
    outbox = Outbox(store, "fleet", repeat_s=1.5)
    delivered(outbox, 4, clock)
    outbox.rewind()
    assert delivered(outbox, 1, clock) == IDS[2:3]
    outbox.rewind()
    assert [letter.id for letter in outbox.next_messages(9)] == IDS[2:]


def test_without_it_nothing_that_was_delivered_comes_again(store: Store, clock: Clock) -> None:
    outbox = Outbox(store, "fleet")
    delivered(outbox, 4, clock)
    outbox.rewind()
    assert [letter.id for letter in outbox.next_messages(9)] == IDS[4:]


def test_a_replaced_database_is_not_asked_for_the_old_ones_places(store: Store, clock: Clock, tmp_path: Path) -> None:
    outbox = Outbox(store, "fleet", repeat_s=10.0)
    delivered(outbox, 4, clock)
    another = Store.open(tmp_path / "another")
    another.write_estimate(make_record(9))
    assert another.flush(PATIENCE_S)
    outbox._journal, outbox._follower = another, another.follow(outbox._kinds, outbox._follower.place, lambda: None)
    outbox.rewind()
    assert [letter.id for letter in outbox.next_messages(9)] == [make_record(9)["id"]]
    another.close()
