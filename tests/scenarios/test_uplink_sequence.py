"""Whatever is lost between the store and the back-end leaves a gap that the back-end sees, and nothing else does."""

import json
import random
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import jsonschema
from support.estimates import make_record
from support.patience import PATIENCE_S, wait_until
from support.sequence import BackEnd, drained

from gateway.records import json_line
from gateway.store import Retention, Store
from gateway.uplink.outbox import Outbox, OutboxMessage

ROOT = Path(__file__).parents[2]
SCHEMA = json.loads((ROOT / "docs/uplink.schema.json").read_text())
DAY_NS = 86_400 * 10**9

WRITER = """
import pathlib, sys
from support.estimates import make_record
from gateway.store import Store
store = Store.open(pathlib.Path(sys.argv[1]))
for n in range(int(sys.argv[2]), 1_000_000):
    store.write_estimate(make_record(n))
    if n % 3 == 0:
        store.flush(60.0)
    print(n, flush=True)
"""


def write(store: Store, *numbers: int) -> None:
    for n in numbers:
        store.write_estimate(make_record(n))
    assert store.flush(PATIENCE_S)


def deliver(store: Store, back_end: BackEnd, is_lost: Callable[[OutboxMessage], bool] = lambda message: False) -> None:
    """All that waits; what is lost is lost behind the broker's acknowledgement, or refused."""
    for message in drained(Outbox(store, "fleet")):
        jsonschema.validate(json.loads(message.text), SCHEMA)
        if not is_lost(message):
            back_end.take(message.text)
    assert store.flush(PATIENCE_S)


def test_starts_and_clocks_leave_no_gap(tmp_path: Path) -> None:
    back_end = BackEnd()
    for start, now_ns in enumerate((20_000 * DAY_NS, 5, 30_000 * DAY_NS, 20_001 * DAY_NS)):
        with closing(Store.open(tmp_path, clock_ns=lambda now_ns=now_ns: now_ns)) as store:
            write(store, *range(10 * start, 10 * start + 10))
            deliver(store, back_end)
    assert back_end.missing == []
    assert len(back_end.ids) == 40


def test_a_lost_or_refused_record_leaves_a_gap(tmp_path: Path) -> None:
    dice = random.Random(3)
    lost = sorted(dice.sample(range(1, 99), 20))
    lost_ids = {make_record(n)["id"] for n in lost}
    n_gaps = sum(n - 1 not in lost for n in lost)
    back_end = BackEnd()
    with closing(Store.open(tmp_path)) as store:
        write(store, *range(100))
        deliver(store, back_end, lambda message: message.id in lost_ids)
    assert len(back_end.missing) == n_gaps
    assert len(back_end.ids) == 80


def test_the_first_ones_are_missed_too(tmp_path: Path) -> None:
    back_end = BackEnd()
    with closing(Store.open(tmp_path)) as store:
        write(store, 0, 1, 2)
        deliver(store, back_end, lambda message: message.id == make_record(0)["id"])
    assert len(back_end.missing) == 1


def test_a_record_removed_before_delivery_leaves_a_gap(tmp_path: Path) -> None:
    back_end = BackEnd()
    with closing(Store.open(tmp_path, Retention(max_bytes=1_000_000))) as store:
        write(store, 0)
        deliver(store, back_end)
        ballast = "x" * 50_000
        for n in range(1, 40):
            store.write_estimate(make_record(n) | {"ballast": ballast})
        assert store.flush(PATIENCE_S)
        assert store.health().n_pruned > 0
        deliver(store, back_end)
    assert len(back_end.missing) == 1
    assert len(back_end.ids) < 40


def test_a_record_dropped_from_memory_leaves_a_gap(tmp_path: Path) -> None:
    (tmp_path / "mount").write_text("no directory can be made here")
    back_end = BackEnd()
    with closing(Store.open(tmp_path / "mount" / "state", Retention(max_held=5))) as store:
        for n in range(9):
            store.write_estimate(make_record(n))
        for message in drained(Outbox(store, "fleet")):
            back_end.take(message.text)
    assert (len(back_end.missing), len(back_end.ids)) == (1, 4)  # the queue's own place takes one of five


def test_a_damaged_record_leaves_a_gap(tmp_path: Path) -> None:
    back_end = BackEnd()
    with closing(Store.open(tmp_path)) as store:
        write(store, *range(6))
    path = tmp_path / "springscale.db"
    content = bytearray(path.read_bytes())
    content[content.index(json_line(make_record(3)).encode()) + 9] ^= 1
    path.write_bytes(content)
    with closing(Store.open(tmp_path)) as store:
        deliver(store, back_end)
    assert len(back_end.ids) == 5
    assert len(back_end.missing) == 1


def test_a_record_whose_very_number_flipped_leaves_a_gap(tmp_path: Path) -> None:
    """It is found no more under its number; the one behind it still names that."""
    with closing(Store.open(tmp_path)) as store:
        numbers = [int(store.write_estimate(make_record(n)).partition("-")[2]) for n in range(6)]
        assert store.flush(PATIENCE_S)
    path = tmp_path / "springscale.db"
    content = bytearray(path.read_bytes())
    as_varint = bytes([0x80 | numbers[3] >> 14, 0x80 | numbers[3] >> 7 & 0x7F, numbers[3] & 0x7F])
    place = content.rindex(as_varint, 0, content.index(json_line(make_record(3)).encode()))
    content[place + 2] ^= 0x10
    path.write_bytes(content)
    back_end = BackEnd()
    with closing(Store.open(tmp_path)) as store:
        deliver(store, back_end)
    assert list(back_end.ids) == [make_record(n)["id"] for n in (0, 1, 2, 4, 5)]
    assert len(back_end.missing) == 1


def test_a_damaged_link_is_a_damaged_record(tmp_path: Path) -> None:
    with closing(Store.open(tmp_path)) as store:
        write(store, *range(4))
    with closing(sqlite3.connect(tmp_path / "springscale.db")) as other:
        other.execute("UPDATE journal SET previous = previous + 1 WHERE seq = (SELECT max(seq) FROM journal)")
        other.execute("UPDATE journal SET previous = 1 WHERE seq = (SELECT min(seq) FROM journal)")
        other.commit()
    back_end = BackEnd()
    with closing(Store.open(tmp_path)) as store:
        deliver(store, back_end)
        assert wait_until(lambda: store.health().n_bad_records == 2)
    assert len(back_end.ids) == 2


def test_a_database_that_was_replaced_is_another_stream(tmp_path: Path) -> None:
    back_end = BackEnd()
    for directory in ("a", "b"):
        with closing(Store.open(tmp_path / directory)) as store:
            write(store, *(range(3) if directory == "a" else range(3, 6)))
            deliver(store, back_end)
    assert back_end.missing == []
    assert len(back_end.ids) == 6


def test_kills_leave_no_gap_and_what_is_lost_afterwards_does(tmp_path: Path) -> None:
    """Each start writes what the one before may have left unwritten, as a bus that is heard again would not."""
    dice = random.Random(11)
    back_end = BackEnd()
    begin = 0
    for kill in range(6):
        process = subprocess.Popen(
            [sys.executable, "-c", WRITER, str(tmp_path), str(begin)],
            stdout=subprocess.PIPE,
            text=True,
            cwd=ROOT / "tests",
        )
        for _ in range(dice.randint(1, 40)):
            begin = int(process.stdout.readline()) + 1
        process.kill()
        process.wait()
        process.stdout.close()
        with closing(Store.open(tmp_path)) as store:
            newest = store.reader().estimates(newest_first=True, limit=1).items
            deliver(store, back_end, lambda message, kill=kill: kill == 3)
        begin = max(begin, int(json.loads(newest[0])["t_end_ns"]) // (300 * 10**9)) if newest else begin
    assert len(back_end.missing) == 1
    assert len(back_end.ids) > 6
