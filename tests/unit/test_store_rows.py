"""What goes into the store comes out of it, once, in order and unchanged."""

import json
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from support.estimates import WINDOW_NS, make_record, texts
from support.patience import PATIENCE_S

from gateway.errors import StoreError
from gateway.records import Why
from gateway.store import Retention, Store
from gateway.store.journal import SERVICE
from gateway.units import NS_PER_S


def write(store: Store, *records: dict[str, Any]) -> list[str]:
    cursors = [store.write_estimate(record) for record in records]
    assert store.flush(PATIENCE_S)
    return cursors


def test_the_text_comes_back_byte_for_byte(store: Store) -> None:
    written = (make_record(1, with_spectra=True), make_record(2, Why.GAP))
    write(store, *written)
    assert store.reader().estimates().items == texts(*written)


def test_a_record_takes_the_place_of_the_earlier_one_with_its_id(store: Store) -> None:
    write(store, make_record(1), make_record(2))
    write(store, make_record(1))
    assert store.reader().estimates().items == texts(make_record(2), make_record(1))


def test_pages_follow_one_another_in_both_directions(store: Store) -> None:
    written = texts(*(make_record(n) for n in range(5)))
    write(store, *(make_record(n) for n in range(5)))
    for newest_first, expected in ((False, written), (True, written[::-1])):
        seen: list[str] = []
        cursor = None
        while True:
            page = store.reader().estimates(limit=2, cursor=cursor, newest_first=newest_first)
            seen += page.items
            cursor = page.next_cursor
            if cursor is None:
                break
        assert tuple(seen) == expected


def test_a_cursor_outlives_its_store_and_one_of_another_database_begins_at_the_first_row(tmp_path: Path) -> None:
    with closing(Store.open(tmp_path)) as first:
        (before,) = write(first, make_record(0))
    with closing(Store.open(tmp_path)) as second:
        (after,) = write(second, make_record(1))
        assert second.reader().estimates(cursor=before).items == texts(make_record(1))
        assert len(second.reader().estimates(cursor="ffffffffffffffff-99").items) == 2
    assert after.split("-")[0] == before.split("-")[0]
    assert int(after.split("-")[1]) > int(before.split("-")[1])


def test_the_last_cursor_continues_with_new_records(store: Store) -> None:
    write(store, make_record(0), make_record(1))
    for newest_first in (False, True):
        page = store.reader().estimates(newest_first=newest_first)
        assert page.next_cursor is None
        assert store.reader().estimates(cursor=page.last_cursor).items == ()
    tail = page.last_cursor
    write(store, make_record(2))
    assert store.reader().estimates(cursor=tail).items == texts(make_record(2))


def test_time_filters_take_the_beginning_and_leave_the_end(store: Store) -> None:
    write(store, *(make_record(n) for n in range(5)))
    found = store.reader().estimates(since_ns=2 * WINDOW_NS, until_ns=4 * WINDOW_NS)
    assert found.items == texts(make_record(1), make_record(2))
    everything = store.reader().estimates(since_ns=-(10**30), until_ns=10**30)
    assert len(everything.items) == 5
    for since_ns, until_ns in ((None, -(10**30)), (10**30, None)):
        assert store.reader().estimates(since_ns=since_ns, until_ns=until_ns).items == ()


def test_spectra_can_be_left_out(store: Store) -> None:
    write(store, make_record(1, with_spectra=True))
    (item,) = store.reader().estimates(with_spectra=False).items
    expected = make_record(1, with_spectra=True)
    del expected["spectra"]
    assert (item,) == texts(expected)


def test_latest_distinguishes_answer_and_rejection(store: Store) -> None:
    assert store.reader().latest().estimate is None
    write(store, make_record(1), make_record(2), make_record(3, Why.TOO_SLOW))
    latest = store.reader().latest()
    assert latest.estimate == texts(make_record(2))[0]
    assert latest.rejection is not None
    assert json.loads(latest.rejection)["rejected"] == ["too_slow"]
    assert latest.age_s is not None
    assert latest.age_s >= 0.0


def test_events_of_the_service_are_kept(store: Store) -> None:
    store.write_event("started", {"version": "1"})
    store.write_event("bus_lost", {"channel": "can0"})
    assert store.flush(PATIENCE_S)
    events = store.reader().page((SERVICE,), newest_first=True).items
    assert [event.partition("\n")[0] for event in events] == ["bus_lost", "started"]


@pytest.mark.parametrize("cursor", ["", "x", "12", "abcd-", "abcd--5", "abcd-1e3", "ab cd-5", "abcd-" + "9" * 30])
def test_a_cursor_we_never_gave_is_refused(store: Store, cursor: str) -> None:
    with pytest.raises(ValueError, match="not a cursor"):
        store.reader().estimates(cursor=cursor)


def test_a_provisional_estimate_is_refused(store: Store) -> None:
    with pytest.raises(ValueError, match="provisional"):
        store.write_estimate({**make_record(1), "provisional": True})


@pytest.mark.parametrize(
    ("first_s", "n_pruned"),
    [(1_790_000_000 - 61, 2), (7, 0)],  # a box without a clock battery wakes up in 1970: that is not old
)
def test_old_records_are_removed_and_counted(tmp_path: Path, first_s: int, n_pruned: int) -> None:
    clock = [first_s * NS_PER_S]
    store = Store.open(tmp_path, Retention(max_age_s=60.0), clock_ns=lambda: clock[0])
    write(store, make_record(0), make_record(1))
    clock[0] = 1_790_000_000 * NS_PER_S
    write(store, make_record(2))
    assert store.close() == 0
    assert store.health().n_pruned == n_pruned
    assert store.reader().estimates().items == texts(*map(make_record, range(n_pruned, 3)))


def test_the_oldest_go_when_the_size_is_reached(tmp_path: Path) -> None:
    store = Store.open(tmp_path, Retention(max_bytes=1_000_000))
    n = 0
    while store.health().n_pruned == 0:
        record = {**make_record(n), "ballast": "x" * 50_000}
        store.write_estimate(record)
        assert store.flush(PATIENCE_S)
        n += 1
        assert n < 40
    assert store.close() == 0
    assert store.health().size_bytes <= 1_000_000
    kept = [json.loads(text)["t_end_ns"] // WINDOW_NS for text in store.reader().estimates().items]
    assert kept == list(range(n - len(kept) + 1, n + 1))
    assert len(kept) == n - store.health().n_pruned
    assert len(kept) > 0.8 * n  # a little at a time
    assert (tmp_path / "springscale.db").stat().st_size < 1_200_000


def test_a_store_that_cannot_hold_anything_is_refused() -> None:
    with pytest.raises(StoreError, match="max_bytes at least"):
        Retention(max_bytes=10)
