"""The fleet's book: every record once, the newest shown, nothing held up by what cannot be read."""

import sqlite3
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import create_model
from support.fleet_messages import alarm, estimate, message

from gateway.fleet import Book, Message
from gateway.fleet.book import AWAY
from gateway.fleet.messages import KINDS, Entry

NOW_S = 1_800_000_000.0


@pytest.fixture
def book(tmp_path: Path) -> Iterator[Book]:
    opened = Book(str(tmp_path / "fleet.sqlite"), lambda: NOW_S)
    yield opened
    opened.close()


def test_a_late_older_answer_does_not_replace_the_newest(book: Book) -> None:
    book.write([estimate("van-1", 55, 200.0), estimate("van-1", 50, 100.0), estimate("van-1", 58, 0.0, "too_slow")])
    (line,) = book.fleet().items
    assert (line.vehicle_id, line.estimate.payload_kg, line.estimate.weights["gross"].kg) == ("van-1", 200.0, 1700.0)
    assert line.used_share == pytest.approx(200.0 / 500.0)
    assert line.age_s == 300.0


def test_duplicates_become_one_row_with_the_highest_revision(book: Book, tmp_path: Path) -> None:
    book.write([estimate("van-1", 55, 600.0), alarm("van-1", 2, is_active=True)] * 2)
    book.write([alarm("van-1", 1, is_active=False), estimate("van-1", 55, 1.0)])
    (line,) = book.fleet().items
    assert (line.estimate.payload_kg, [one.kind for one in line.alarms]) == (600.0, ["overload"])
    assert line.used_share == pytest.approx(600.0 / 500.0)
    book.write([alarm("van-1", 3, is_active=False)])
    assert book.fleet().items[0].alarms == []
    with sqlite3.connect(tmp_path / "fleet.sqlite") as looked:
        assert looked.execute("SELECT count(*) FROM estimate").fetchone() == (1,)


def test_a_vehicle_that_goes_offline_keeps_what_it_reported(book: Book) -> None:
    book.write([message("van-1", "status", state="online", vin="WVW1"), message("van-1", "status", state="offline")])
    (line,) = book.fleet().items
    assert (line.status.state, line.status.vin) == ("offline", "WVW1")
    assert (line.estimate, line.age_s, line.used_share) == (None, None, None)


def test_statements_to_a_vehicle_and_the_copy_of_its_last_estimate_are_no_records(book: Book) -> None:
    copy = estimate("van-1", 1, 200.0).payload
    sent = [Message("springscale/van-1/statements", b"from;source\n"), Message("springscale/van-1/latest", copy)]
    assert book.write(sent) == []
    assert (book.fleet().n_unreadable, book.fleet().items) == (0, [])


def test_a_record_that_the_database_alone_refuses_is_set_aside(book: Book, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever is not foreseen, here a number that SQLite cannot hold: the others are stored, each once."""
    boundless = create_model("Boundless", __base__=Entry, revision=(int, ...))
    monkeypatch.setitem(KINDS, "trips", boundless)
    trips = [message("van-1", "trips", id=f"trip-{n}", revision=10**30 if n == 2 else 1) for n in range(5)]
    assert [fault.partition(":")[0] for _, fault in book.write(trips)] == ["OverflowError"]
    assert book.write([trips[0]]) == []
    assert book.counts == {"unreadable": 1, "trips": 4, "known already": 1}


def test_a_table_that_is_missing_is_made_again(book: Book, tmp_path: Path) -> None:
    """Every record that came was taken for an absent database, for ever."""
    book.write([estimate("van-1", 1, 5.0)])
    with sqlite3.connect(tmp_path / "fleet.sqlite") as breaking:
        breaking.execute("DROP TABLE estimate")
    assert book.write([estimate("van-1", 2, 6.0)]) == []
    assert book.fleet().items[0].estimate.payload_kg == 6.0


def test_an_unreachable_database_raises_and_is_used_again_later(tmp_path: Path) -> None:
    book = Book(str(tmp_path / "absent" / "fleet.sqlite"), lambda: NOW_S)
    with pytest.raises(AWAY):
        book.write([estimate("van-1", 2, 5.0), Message("springscale/van-1/trips", b"no JSON")])
    assert book.counts == {}
    (tmp_path / "absent").mkdir()
    assert book.write([estimate("van-1", 2, 5.0)]) == []
    book.close()


def test_records_are_kept_over_a_restart(book: Book, tmp_path: Path) -> None:
    book.write([estimate("van-1", 55, 200.0)])
    again = Book(str(tmp_path / "fleet.sqlite"), lambda: NOW_S)
    assert again.fleet().items == book.fleet().items
    again.close()


@given(
    st.permutations(
        [estimate("van-1", n, 10.0 * n) for n in range(4)] + [alarm("van-1", n, is_active=n < 3) for n in range(4)]
    )
)
def test_the_order_of_arrival_does_not_matter(arrivals: list[Message]) -> None:
    book = Book(":memory:", lambda: NOW_S)
    book.write(arrivals)
    (line,) = book.fleet().items
    book.close()
    assert (line.estimate.payload_kg, line.alarms) == (30.0, [])


def test_a_vehicle_that_is_too_heavy_empty_has_no_share_of_its_room(book: Book) -> None:
    book.write([estimate("van-1", 55, 100.0, limit_kg=1400.0)])
    assert book.fleet().items[0].used_share is None
