"""The journal: one row of numbers, published as they are given, followed by all alike, and robust against its disk."""

import json
import sqlite3
import threading
from contextlib import closing
from pathlib import Path
from typing import Any, NoReturn

import pytest
from support.estimates import make_record
from support.log import names
from support.patience import PATIENCE_S, wait_until
from support.sequence import drained

from gateway.log import Event
from gateway.store import Store, reader, writer
from gateway.store.journal import BATCHES, ENTRIES, KINDS
from gateway.uplink.outbox import Outbox
from gateway.web.live.board import Board

DAY_S = 86_400.0


def entry(store: Store, n: int, kind: str = "event", revision: int = 1) -> str:
    record = {"id": f"{kind}-{n}", "revision": revision, "kind": "drift", "where": None}
    return store.write_entry(kind, record["id"], n, json.dumps(record))


def refuse(*_: object) -> NoReturn:
    raise sqlite3.OperationalError("disk I/O error")


def test_a_flipped_bit_in_an_event_is_passed_over_counted_and_shown(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """`revision` became `revisioo`: the uplink died of it, and with it the service, ten times."""
    with closing(Store.open(tmp_path)) as store:
        for n in range(5):
            entry(store, n)
        assert store.flush(PATIENCE_S)
    path = tmp_path / "springscale.db"
    content = path.read_bytes()
    place = content.index(b'"revision"', content.index(b'{"id": "event-2"'))
    path.write_bytes(content[: place + 8] + bytes([content[place + 8] ^ 1]) + content[place + 9 :])
    with closing(Store.open(tmp_path)) as store:
        assert [message.id for message in drained(Outbox(store, "fleet"))] == [f"event-{n}-1" for n in (0, 1, 3, 4)]
        assert wait_until(lambda: store.health().n_bad_records == 1)
        assert len(store.reader().entries().items) == 4
    assert Event.STORE_BAD_RECORD in names(caplog)


def test_an_unreadable_record_is_skipped_and_reported(store: Store, caplog: pytest.LogCaptureFixture) -> None:
    """Its checksum is right, and yet it is no record of this program."""
    entry(store, 0)
    store.write_entry("event", "event-1", 0, "[]")
    entry(store, 2)
    store.write_entry("event", "event-3", 0, "{}")
    outbox = Outbox(store, "fleet")
    assert [message.id for message in drained(outbox)] == ["event-0-1", "event-2-1"]
    assert wait_until(lambda: names(caplog) == [Event.STORE_BAD_RECORD] * 2)
    assert store.flush(PATIENCE_S)
    assert store.reader().delivery("fleet").n_waiting == 0


def test_a_resumed_follower_gets_more_than_a_page_of_entries(store: Store) -> None:
    """Of 701 records that were missed 500 came."""
    first = store.write_estimate(make_record(0))
    for n in range(701):
        entry(store, n)
    assert store.flush(PATIENCE_S)
    follower, seen = store.follow(tuple(KINDS), first, lambda: None), []
    while records := follower.read(5):
        seen += [record.id for record in records]
    assert seen == [f"event-{n}" for n in range(701)]


@pytest.mark.parametrize("n_threads", [4])
def test_records_of_many_threads_are_published_in_order(store: Store, n_threads: int) -> None:
    """A number was given under one lock and the record published under another: a live alarm overtook."""
    numbers: list[int] = []
    news = threading.Event()
    follower = store.follow(ENTRIES, None, news.set)

    def write(first: int) -> None:
        for n in range(100):
            entry(store, 1000 * first + n, "alarm")

    threads = [threading.Thread(target=write, args=(first,)) for first in range(n_threads)]
    for thread in threads:
        thread.start()
    while len(numbers) < 100 * n_threads:
        assert news.wait(PATIENCE_S)
        news.clear()
        while records := follower.read(7):
            numbers += [record.number for record in records]
    for thread in threads:
        thread.join()
    assert numbers == sorted(set(numbers))


@pytest.mark.parametrize("is_flushed", [True, False])
@pytest.mark.parametrize("limit", [1, 3, 100])
def test_every_kind_comes_once_and_in_order_from_disk_and_memory(store: Store, limit: int, is_flushed: bool) -> None:
    follower, written, seen = store.follow(tuple(KINDS), None, lambda: None), [], []
    for n in range(40):
        written.append(store.write_estimate(make_record(n)) if n % 2 else entry(store, n, ENTRIES[n % 3]))
        if is_flushed and n % 7 == 0:
            assert store.flush(PATIENCE_S)
        if n % 5 == 0:
            seen += [record.cursor for record in follower.read(limit)]
    while records := follower.read(limit):
        seen += [record.cursor for record in records]
    assert seen == written


def test_idle_followers_open_no_database(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    """Uplink and webhook asked SQLite twice a second, 1.7 ms each, to find nothing."""
    for n in range(3):
        store.write_estimate(make_record(n))
    outbox = Outbox(store, "fleet")
    assert len(drained(outbox)) == 3
    assert store.flush(PATIENCE_S)
    outbox.look()
    opened: list[Any] = []
    monkeypatch.setattr(reader, "connect_reader", opened.append)
    for _ in range(50):
        assert outbox.next() is None
        assert outbox.look().n_waiting == 0
    assert opened == []


def test_a_follower_reads_what_the_disk_refuses_from_memory(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    store.write_estimate(make_record(0))
    assert store.flush(PATIENCE_S)
    follower = store.follow(BATCHES, store.head(), lambda: None)
    monkeypatch.setattr(store._database, "add", refuse)
    monkeypatch.setattr(reader, "connect_reader", refuse)
    store.write_estimate(make_record(1))
    assert [record.id for record in follower.read(9)] == [make_record(1)["id"]]


@pytest.mark.parametrize("wall_s", [60.0, 0.0, -7.0 * DAY_S, -50.0 * 365.0 * DAY_S, 7.0 * DAY_S])
def test_after_a_start_of_the_machine_the_age_is_unknown_and_unknown_is_stale(
    tmp_path: Path, wall_s: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the clock of the last shutdown a week-old weight came back as 60 s old and fresh, in 1970 as 0 s."""
    now_ns = [1_790_000_000 * 10**9]
    with closing(Store.open(tmp_path, clock_ns=lambda: now_ns[0])) as store:
        store.write_estimate(make_record(1))
    now_ns[0] += round(wall_s * 1e9)
    monkeypatch.setattr(writer, "_boot_id", lambda: "another start")
    with closing(Store.open(tmp_path, clock_ns=lambda: now_ns[0])) as store:
        latest = store.reader().latest()
    assert latest.estimate is not None
    assert latest.age_s is None
    board = Board()
    board.restore(latest.estimate, latest.rejection, latest.age_s)
    assert board.is_stale()
    shown = board.shown()
    assert (shown.age_s, shown.is_stale) == (None, True)
    assert board.latest()[1].startswith(b'{"age_s":null,"is_stale":true')


def test_within_one_start_of_the_machine_the_age_is_right_whatever_the_clock_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    boot_ns = [5_000 * 10**9]
    monkeypatch.setattr(writer, "boot_ns", lambda: boot_ns[0])
    with closing(Store.open(tmp_path, clock_ns=lambda: 7)) as store:
        store.write_estimate(make_record(1))
        boot_ns[0] += 10 * 10**9
        assert store.reader().latest().age_s == 10.0
    boot_ns[0] += 20 * 10**9
    with closing(Store.open(tmp_path, clock_ns=lambda: 10**18)) as store:
        assert store.reader().latest().age_s == 30.0


def test_followers_go_on_where_the_disk_comes_late(tmp_path: Path) -> None:
    """Records in memory get new numbers then: nobody sees them twice, or misses one."""
    (tmp_path / "mount").write_text("no directory can be made here")
    with closing(Store.open(tmp_path / "mount" / "state")) as store:
        follower = store.follow(BATCHES, store.head(), lambda: None)
        store.write_estimate(make_record(0))
        store.write_estimate(make_record(1))
        assert [record.id for record in follower.read(1)] == [make_record(0)["id"]]
        (tmp_path / "mount").unlink()
        assert store.flush(PATIENCE_S)
        store.write_estimate(make_record(2))
        assert [record.id for record in follower.read(9)] == [make_record(n)["id"] for n in (1, 2)]
