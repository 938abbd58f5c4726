"""One bit of a stored record flips: that record is left out, all others go on to history, export and uplink."""

import random
import sqlite3
import time
from contextlib import closing
from pathlib import Path

import pytest
from support.estimates import make_record, texts
from support.log import names
from support.patience import PATIENCE_S, wait_until
from support.sequence import drained, without_sequence

from gateway.errors import StoreError
from gateway.log import Event
from gateway.records import Why, json_line
from gateway.store import Retention, Store, queries, schema
from gateway.store.journal import BATCHES, SERVICE
from gateway.uplink.outbox import Outbox

N_RECORDS = 12
N_FLIPS = 80
RECORDS = [make_record(n, *([Why.GAP] if n % 3 == 0 else []), with_spectra=n % 2 == 0) for n in range(N_RECORDS)]
TEXTS = texts(*RECORDS)
PLAIN = texts(*({key: said for key, said in record.items() if key != "spectra"} for record in RECORDS))


@pytest.fixture(scope="module")
def database(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A good database, all of it in one file."""
    directory = tmp_path_factory.mktemp("good")
    with closing(Store.open(directory)) as store:
        for record in RECORDS:
            store.write_estimate(record)
        assert store.flush(PATIENCE_S)
    return (directory / "springscale.db").read_bytes()


def bits_of_records(database: bytes) -> list[int]:
    """The places of all bits in the rows, their heads included."""
    places = []
    for record, text in zip(RECORDS, TEXTS, strict=True):
        end = database.index(text.encode()) + len(text.encode()) + 4  # and its sum
        begin = database.rindex(record["id"].encode(), 0, end - len(text.encode())) - 16
        places += range(8 * begin, 8 * end)
    return places


def put(directory: Path, database: bytes, bit: int) -> None:
    flipped = bytearray(database)
    flipped[bit // 8] ^= 1 << bit % 8
    directory.mkdir(exist_ok=True)
    (directory / "springscale.db").write_bytes(flipped)


def ask(store: Store) -> set[str]:
    """Everything that history, dashboard and uplink would answer; a question that is refused is asked once more."""
    reader = store.reader()
    told: set[str] = set()
    for newest_first in (False, True):
        told |= set(reader.estimates(limit=5, newest_first=newest_first).items)
    told |= set(reader.estimates(since_ns=0, limit=1000).items)
    latest = reader.latest()
    told |= {text for text in (latest.estimate, latest.rejection) if text is not None}
    messages = drained(Outbox(store, "fleet"))
    reader.delivery("fleet")
    reader.page((SERVICE,))
    assert {without_sequence(message.text) for message in messages} <= set(PLAIN)
    return told


def test_no_flipped_bit_stops_the_others_or_is_served_as_true(tmp_path: Path, database: bytes) -> None:
    dice = random.Random(14)
    n_passed_over = 0
    for n, bit in enumerate(dice.sample(bits_of_records(database), N_FLIPS)):
        directory = tmp_path / str(n)
        put(directory, database, bit)
        with closing(Store.open(directory)) as store:
            try:
                told = ask(store)
            except StoreError:  # the file itself is damaged: it is set aside as a whole, and all goes on
                assert wait_until(lambda store=store: store.flush(PATIENCE_S) and store.health().set_aside is not None)
                told = ask(store)
            assert told <= set(TEXTS)
            new = make_record(100 + n)
            store.write_estimate(new)
            assert store.flush(PATIENCE_S)
            history = store.reader().estimates(limit=1000).items
            assert history[-1] == json_line(new)
            health = store.health()
            if health.set_aside is None:
                assert len(set(TEXTS) - set(history)) <= 1  # where its number flipped it is found no more, nor counted
                assert len(set(TEXTS) - set(history)) >= health.n_bad_records
                n_passed_over += health.n_bad_records
    assert n_passed_over > N_FLIPS / 2


def test_a_bad_record_is_left_out_counted_and_reported_once(
    tmp_path: Path, database: bytes, caplog: pytest.LogCaptureFixture
) -> None:
    place = database.index(TEXTS[4].encode()) + TEXTS[4].index('"payload_kg":104') + len('"payload_kg":10')
    put(tmp_path, database, 8 * place)  # 104 kg becomes 105 kg
    with closing(Store.open(tmp_path)) as store:
        reader = store.reader()
        assert set(reader.estimates().items) == set(TEXTS) - {TEXTS[4]}
        assert set(reader.estimates().items) == set(TEXTS) - {TEXTS[4]}
        assert store.health().n_bad_records == 1
        assert names(caplog) == [Event.STORE_BAD_RECORD]
        assert len(drained(Outbox(store, "fleet"))) == N_RECORDS - 1
        assert store.flush(PATIENCE_S)
        assert reader.delivery("fleet").n_waiting == 0


def test_pages_are_full_and_lead_on_over_bad_records(tmp_path: Path, database: bytes) -> None:
    flipped = bytearray(database)
    for n in (1, 2, 3, 7):
        flipped[database.index(TEXTS[n].encode()) + 30] ^= 1
    (tmp_path / "springscale.db").write_bytes(flipped)
    with closing(schema.connect_reader(tmp_path / "springscale.db")) as connection:
        for newest_first in (False, True):
            bad: list[int] = []
            window = queries.JournalQuery(BATCHES, newest_first=newest_first)
            good = queries.page(connection, window, 5, bad.append)
            assert len(good) == 5
            assert len(bad) == (1 if newest_first else 4)


def test_an_index_that_disagrees_with_its_table_is_rebuilt(tmp_path: Path, database: bytes) -> None:
    (tmp_path / "springscale.db").write_bytes(database)
    with closing(sqlite3.connect(tmp_path / "springscale.db")) as other:
        other.execute("PRAGMA writable_schema = ON")
        page = other.execute("SELECT rootpage FROM sqlite_schema WHERE name = 'journal_by_time'").fetchone()[0]
        size = other.execute("PRAGMA page_size").fetchone()[0]
    spoilt = bytearray((tmp_path / "springscale.db").read_bytes())
    t_end_ns = RECORDS[4]["t_end_ns"].to_bytes(6, "big")
    spoilt[spoilt.index(t_end_ns, (page - 1) * size, page * size) + 5] ^= 1
    (tmp_path / "springscale.db").write_bytes(spoilt)
    now_ns = [time.time_ns()]
    with closing(Store.open(tmp_path, Retention(max_age_s=3600.0), clock_ns=lambda: now_ns[0])) as store:
        now_ns[0] += 7200 * 10**9
        store.write_estimate(make_record(N_RECORDS))  # the older ones are removed; one of them is missing in the index
        assert store.flush(PATIENCE_S)
        health = store.health()
        assert (health.set_aside, health.n_pruned) == (None, N_RECORDS)


def test_only_a_few_damaged_databases_are_kept(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    for n in range(6):
        (tmp_path / "springscale.db").write_bytes(b"no database %d " % n * 200)
        with closing(Store.open(tmp_path)) as store:
            store.write_estimate(make_record(n))
            assert store.flush(PATIENCE_S)
    kept = sorted(file.read_bytes()[:13] for file in tmp_path.glob("springscale.db.damaged-*"))
    assert kept == [b"no database %d" % n for n in (3, 4, 5)]
    assert names(caplog).count(Event.STORE_FORGETS) == 3


@pytest.mark.parametrize("suffixes", [("-wal",), ("-shm",), ("-wal", "-shm")])
def test_a_log_deleted_under_the_running_store_loses_nothing_and_heals(
    tmp_path: Path, suffixes: tuple[str, ...]
) -> None:
    with closing(Store.open(tmp_path)) as store:
        store.write_estimate(RECORDS[0])
        assert store.flush(PATIENCE_S)
        for suffix in suffixes:
            (tmp_path / f"springscale.db{suffix}").unlink()

        def is_whole() -> bool:
            try:
                return store.reader().estimates().items == TEXTS[:1]
            except StoreError:
                return False

        is_whole()  # whoever asks finds out
        store.write_estimate(RECORDS[1])
        assert store.flush(PATIENCE_S)
        assert store.reader().estimates().items == TEXTS[:2]
