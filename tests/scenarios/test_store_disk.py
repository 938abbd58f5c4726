"""A disk that refuses, a file that is damaged, a directory that is taken: the store goes on or says why not."""

import json
import os
import sqlite3
import sys
from contextlib import closing
from pathlib import Path

import pytest
from support.commands import ended
from support.estimates import make_record, texts
from support.log import fields_of, names
from support.patience import PATIENCE_S

from gateway.errors import StoreError
from gateway.log import Event
from gateway.status import StoreState
from gateway.store import Retention, Store, StoreReader
from gateway.store.journal import BATCHES


def test_a_full_disk_degrades_to_memory_and_heals(tmp_path: Path) -> None:
    run = ended(sys.executable, "-m", "support.full_disk", tmp_path, check=False, cwd=Path(__file__).parents[1])
    assert run.returncode == 0, run.stderr
    said = json.loads(run.stdout)
    assert said["is_written"] == [True, False, True]
    assert said["full"] == said["full"] | {"state": "degraded", "n_held": 6, "n_dropped": 0}
    assert "springscale.db" in said["full"]["reason"]
    assert said["healed"] == said["healed"] | {"state": "ok", "reason": None, "n_held": 0, "n_written": 9}
    assert said["n_lost"] == 0
    everything = list(texts(*(make_record(n) for n in range(9))))
    assert said["seen_while_full"] == everything
    assert said["seen_afterwards"] == everything


def blocked_directory(tmp_path: Path) -> Path:
    """A place where no directory can be made, not even by root: its parent is a file."""
    (tmp_path / "mount").write_text("not a directory")
    return tmp_path / "mount" / "springscale"


def test_a_directory_that_cannot_be_made_is_waited_for(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO", "gateway")
    directory = blocked_directory(tmp_path)
    store = Store.open(directory)
    assert store.health().state is StoreState.DEGRADED
    held_cursor = store.write_estimate(make_record(0))
    reader = store.reader()
    assert reader.estimates().items == texts(make_record(0))
    assert reader.latest().estimate == texts(make_record(0))[0]

    directory.parent.unlink()
    assert store.flush(PATIENCE_S)
    store.write_estimate(make_record(1))
    assert store.flush(PATIENCE_S)
    assert store.health().state is StoreState.OK
    assert reader.estimates(cursor=held_cursor).items == texts(make_record(1))
    assert store.close() == 0
    assert names(caplog) == [Event.STORE_HOLDS, Event.STORE_RECOVERED]
    assert str(directory.parent) in fields_of(caplog, Event.STORE_HOLDS)["reason"]
    assert fields_of(caplog, Event.STORE_RECOVERED) == {"n_held": 1}


def test_held_records_are_stored_after_those_of_an_earlier_run(tmp_path: Path) -> None:
    earlier = Store.open(tmp_path / "volume" / "springscale")
    earlier.write_estimate(make_record(0))
    assert earlier.close() == 0

    directory = blocked_directory(tmp_path)
    store = Store.open(directory)
    cursor = store.write_estimate(make_record(1))
    directory.parent.unlink()
    (tmp_path / "volume").rename(directory.parent)  # in one step: the store looks at any moment
    assert store.flush(PATIENCE_S)
    assert store.reader().estimates().items == texts(make_record(0), make_record(1))
    # the cursor was of the memory alone: rather all again than a row missed
    assert len(store.reader().estimates(cursor=cursor).items) == 2
    store.close()


def test_memory_is_bounded_and_dropped_records_are_counted(tmp_path: Path) -> None:
    store = Store.open(blocked_directory(tmp_path), Retention(max_held=3))
    for n in range(5):
        store.write_estimate(make_record(n))
    assert store.health().n_dropped == 2
    assert store.reader().estimates().items == texts(*(make_record(n) for n in (2, 3, 4)))
    assert store.close() == 3


def test_a_database_deleted_under_the_running_store_is_recreated(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    store = Store.open(tmp_path)
    assert not store.health().is_replaced
    cursor = store.write_estimate(make_record(0))
    assert store.flush(PATIENCE_S)
    for leftover in tmp_path.glob("springscale.*"):
        leftover.unlink()
    store.write_estimate(make_record(1))
    assert store.flush(PATIENCE_S)
    assert store.reader().estimates(cursor=cursor).items == texts(make_record(1))
    assert store.health().is_replaced
    assert fields_of(caplog, Event.STORE_REPLACED) == {"path": str(tmp_path / "springscale.db")}
    with pytest.raises(StoreError, match="another Springscale uses"):
        Store.open(tmp_path)
    assert store.close() == 0
    assert (tmp_path / "springscale.db").exists()


def test_a_directory_that_is_mounted_over_the_present_one_keeps_its_records(tmp_path: Path) -> None:
    """Both databases begin with the same numbers, and a record with the number of another one took its place."""
    volume, directory = tmp_path / "volume", tmp_path / "springscale"
    earlier = Store.open(volume)
    for n in range(20):
        earlier.write_estimate(make_record(n))
    assert earlier.close() == 0
    store = Store.open(directory)
    store.write_estimate(make_record(20))
    assert store.flush(PATIENCE_S)
    follower = store.follow(BATCHES, store.head(), lambda: None)

    directory.rename(tmp_path / "hidden")
    volume.rename(directory)
    for n in range(21, 24):
        store.write_estimate(make_record(n))
        assert store.flush(PATIENCE_S)
    assert store.reader().estimates().items == texts(*(make_record(n) for n in range(24) if n != 20))
    assert [one.text for one in follower.read(10)] == list(texts(*(make_record(n) for n in range(21, 24))))
    store.close()


def damage(path: Path) -> None:
    """Overwrite all but the header: what a dying flash card does."""
    content = bytearray(path.read_bytes())
    content[100:] = os.urandom(len(content) - 100)
    path.write_bytes(content)


def test_a_damaged_database_is_set_aside(tmp_path: Path) -> None:
    first = Store.open(tmp_path)
    first.write_estimate(make_record(0))
    assert first.close() == 0
    path = tmp_path / "springscale.db"
    damage(path)
    kept = path.read_bytes()

    store = Store.open(tmp_path)
    store.write_estimate(make_record(1))
    assert store.flush(PATIENCE_S)
    health = store.health()
    assert health.state is StoreState.OK
    assert health.set_aside is not None
    assert (tmp_path / health.set_aside).read_bytes() == kept
    assert store.reader().estimates().items == texts(make_record(1))
    store.close()


def test_damage_found_while_reading_sets_the_file_aside_and_keeps_the_numbering(tmp_path: Path) -> None:
    store = Store.open(tmp_path)
    cursors = [store.write_estimate(make_record(n)) for n in range(50)]
    assert store.flush(PATIENCE_S)
    with closing(sqlite3.connect(tmp_path / "springscale.db", timeout=PATIENCE_S)) as other:
        assert other.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()[0] == 0
    damage(tmp_path / "springscale.db")
    with pytest.raises(StoreError, match="cannot be read"):
        store.reader().estimates()
    store.write_estimate(make_record(50))
    assert store.flush(PATIENCE_S)
    assert store.health().set_aside is not None
    assert store.reader().estimates(cursor=cursors[-1]).items == texts(make_record(50))
    store.close()


@pytest.mark.parametrize(
    ("is_ours", "changed", "told"),
    [
        (True, "PRAGMA user_version = 6", "schema 6"),
        (True, "PRAGMA user_version = 99", "schema 99"),
        (False, "CREATE TABLE songs (title)", "another program"),
    ],
)
def test_a_newer_schema_is_refused_and_left_unchanged(tmp_path: Path, is_ours: bool, changed: str, told: str) -> None:
    path = tmp_path / "springscale.db"
    if is_ours:
        Store.open(tmp_path).close()
    with closing(sqlite3.connect(path)) as database:
        database.execute(changed)
    before = path.read_bytes()
    with pytest.raises(StoreError, match=told):
        Store.open(tmp_path)
    assert path.read_bytes() == before


def test_a_directory_in_use_is_refused(tmp_path: Path) -> None:
    store = Store.open(tmp_path)
    with pytest.raises(StoreError, match="another Springscale"):
        Store.open(tmp_path)
    store.close()
    Store.open(tmp_path).close()


def test_a_question_that_takes_too_long_is_ended(tmp_path: Path) -> None:
    store = Store.open(tmp_path)
    for n in range(5000):
        store.write_estimate(make_record(n))
    assert store.flush(PATIENCE_S)
    reader = StoreReader(store, limit_s=-1.0)
    with pytest.raises(TimeoutError, match="ask for less"):
        reader.estimates(limit=5000, with_spectra=False)
    store.close()
