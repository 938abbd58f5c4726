"""Whoever follows the cursor sees every row once, whatever arrives meanwhile."""

import itertools
import json
import tempfile
import threading
from dataclasses import replace
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st
from support.estimates import make_record
from support.patience import PATIENCE_S

from gateway.records import Why
from gateway.store import Store
from gateway.store.schema import JournalRow
from gateway.store.write_buffer import WriteBuffer


def number(text: str) -> int:
    """Which record of the test this is."""
    return int(json.loads(text)["t_end_ns"]) // (300 * 10**9) - 1


@settings(max_examples=15)
@given(bursts=st.lists(st.integers(0, 7), min_size=1, max_size=8), limit=st.integers(1, 5))
def test_the_cursor_misses_and_repeats_nothing_while_rows_arrive(bursts: list[int], limit: int) -> None:
    with tempfile.TemporaryDirectory() as directory:
        store = Store.open(Path(directory))
        reader, seen, cursor, counter = store.reader(), list[int](), None, itertools.count()
        for burst in bursts:
            for n in itertools.islice(counter, burst):  # not flushed: some are on disk, some are not
                store.write_estimate(make_record(n, *([Why.GAP] if n % 3 == 0 else [])))
            page = reader.estimates(limit=limit, cursor=cursor)
            seen += map(number, page.items)
            cursor = page.last_cursor
        while items := (page := reader.estimates(limit=limit, cursor=cursor)).items:
            seen += map(number, items)
            cursor = page.last_cursor
        store.close()
    assert seen == list(range(sum(bursts)))


def test_two_readers_beside_a_writer_see_the_same_once(tmp_path: Path) -> None:
    n_rows = 300
    store = Store.open(tmp_path)

    def follow(seen: list[int]) -> None:
        reader, cursor = store.reader(), None
        while len(seen) < n_rows:
            page = reader.estimates(limit=7, cursor=cursor)
            seen.extend(map(number, page.items))
            cursor = page.last_cursor

    followers = [list[int](), list[int]()]
    threads = [threading.Thread(target=follow, args=(seen,)) for seen in followers]
    for thread in threads:
        thread.start()
    for n in range(n_rows):
        store.write_estimate(make_record(n))
    for thread in threads:
        thread.join(PATIENCE_S)
    store.close()
    assert followers == [list(range(n_rows))] * 2


def row(n: int) -> JournalRow:
    return JournalRow(0, "estimate", str(n), n, 0, 0, "{}")


@given(
    steps=st.lists(st.sampled_from(["add", "event", "take", "settle", "give_back"]), max_size=40),
    capacity=st.integers(1, 6),
)
def test_accepted_records_are_written_held_or_counted(steps: list[str], capacity: int) -> None:
    held = WriteBuffer(capacity, epoch="ab")
    n_accepted = n_written = 0
    in_flight: tuple[object, ...] = ()
    for step in steps:
        if step == "add":
            held.append(row(n_accepted))
        elif step == "event":
            held.append(replace(row(n_accepted), kind="event"))
        elif step == "take" and not in_flight:
            in_flight = held.take()
        elif step == "settle":
            held.settle()
            n_written += len(in_flight)
            in_flight = ()
        elif step == "give_back":
            held.give_back()
            in_flight = ()
        n_accepted += step in ("add", "event")
        seqs = [r.seq for r in held.held().rows]
        assert seqs == sorted(set(seqs))
        assert n_accepted == n_written + len(held) + held.n_dropped
        assert len(held) <= max(capacity, len(in_flight))
