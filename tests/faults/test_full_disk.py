"""Accepted means on disk: a full disk costs no record that was shown, or the service says so and ends with a fault."""

import json
import os
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
from support.estimates import make_estimate, make_record
from support.patience import PATIENCE_S, wait_until
from support.ports import first_answer, free_port
from support.process import ReplayedService

from gateway.files import reserve
from gateway.files.reserve import RESERVE_BYTES, Reserve, require_room
from gateway.status import StoreState
from gateway.store import Store
from gateway.web.live.board import Board

needs_root = pytest.mark.skipif(os.geteuid() != 0, reason="only root can mount a disk of its own")


@contextmanager
def small_disk(place: Path, size_mb: int) -> Iterator[Path]:
    place.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size_mb}m", "small", place], check=True)
    try:
        yield place
    finally:
        subprocess.run(["umount", "--lazy", place], check=True)


def fill(disk: Path) -> Path:
    """A file that takes all the room that is left."""
    filler = disk / "filler"
    with filler.open("wb", buffering=0) as file, suppress(OSError):
        while True:
            file.write(bytes(4096))
    return filler


def test_the_reserve_is_given_up_for_a_full_disk_alone_and_made_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    held, room = Reserve(tmp_path), [1 << 30]
    monkeypatch.setattr(reserve, "free_bytes", lambda directory: room[0])
    held.keep()
    (file,) = tmp_path.iterdir()
    assert file.stat().st_blocks * 512 >= RESERVE_BYTES
    assert not held.give_up()  # another fault than a full disk
    room[0] = 0
    assert (held.give_up(), held.is_in_use, list(tmp_path.iterdir())) == (True, True, [])
    assert not held.give_up()  # there is none any more
    held.keep()
    assert held.is_in_use
    room[0] = 1 << 30
    held.keep()
    assert (held.is_in_use, file.stat().st_size) == (False, RESERVE_BYTES)


def test_a_reserve_that_a_kill_left_half_made_is_made_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reserve, "free_bytes", lambda directory: 1 << 30)
    file = tmp_path / reserve.FILE_NAME
    file.touch()
    Reserve(tmp_path).keep()
    assert file.stat().st_blocks * 512 >= RESERVE_BYTES


def test_dispensable_files_are_deleted_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reserve, "free_bytes", lambda directory: 20 << 20)
    require_room(tmp_path / "not made yet", 1 << 20)
    with pytest.raises(OSError, match="16 MB would be left"):
        require_room(tmp_path, 5 << 20)


@pytest.mark.parametrize(
    ("estimate", "is_on_disk", "told"),
    [
        (make_estimate(1), True, True),
        (make_estimate(1), False, False),
        (make_estimate(1, is_provisional=True), False, None),
    ],
)
def test_the_latest_estimate_shows_whether_it_is_stored(estimate: Any, is_on_disk: bool, told: bool | None) -> None:
    board = Board(is_stored=lambda estimate_id: is_on_disk)
    assert json.loads(board.latest()[1])["is_stored"] is None
    board.publish(estimate)
    tag, body = board.latest()
    assert json.loads(body)["is_stored"] is told
    assert tag.endswith(".held") is (told is False)


@needs_root
def test_a_store_on_a_full_disk_writes_into_its_reserve(tmp_path: Path) -> None:
    with small_disk(tmp_path / "disk", 24) as disk:
        store = Store.open(disk / "state")
        store.write_estimate(make_record(0))
        assert store.flush(PATIENCE_S)
        filler = fill(disk)
        for n in range(1, 50):
            store.write_estimate(make_record(n))
        assert store.flush(PATIENCE_S)
        assert (store.health().state, store.health().is_reserve_in_use) == (StoreState.OK, True)
        filler.unlink()
        store.write_estimate(make_record(50))
        assert store.flush(PATIENCE_S)
        assert not store.health().is_reserve_in_use
        assert len(store.reader().estimates().items) == 51
        assert store.close() == 0


@needs_root
@pytest.mark.parametrize(("size_mb", "is_stored"), [(24, True), (12, False)], ids=["with reserve", "without"])
def test_a_stop_with_a_full_disk_loses_nothing_that_was_shown_or_ends_with_a_fault(
    size_mb: int, is_stored: bool, tmp_path: Path
) -> None:
    """Ten of thirteen estimates that had been shown were lost, and the exit code was 0."""
    with small_disk(tmp_path / "disk", size_mb) as disk:
        keys: dict[str, Any] = {"store__directory": str(disk / "state"), "web__port": free_port()}
        (tmp_path / "service").mkdir()
        with ReplayedService(tmp_path / "service", is_later=True, **keys) as service:
            url = f"http://127.0.0.1:{keys['web__port']}"
            first_answer(f"{url}/health/live")
            filler = fill(disk)
            service.drive()
            shown = wait_until(lambda: len(first_answer(f"{url}/api/v1/estimates").json()["items"]) >= 3)
            assert shown
            assert wait_until(lambda: first_answer(f"{url}/api/v1/estimates/latest").json()["is_stored"] is is_stored)
            status = first_answer(f"{url}/api/v1/status").json()
            assert status["is_ready"] is is_stored
            assert any(("last megabytes" if is_stored else "are not stored") in one for one in status["warnings"])
            told = [record["id"] for record in first_answer(f"{url}/api/v1/estimates").json()["items"]]
            service.process.send_signal(signal.SIGTERM)
            assert service.process.wait(PATIENCE_S) == (0 if is_stored else 1)
        filler.unlink()
        store = Store.open(disk / "state")
        found = "".join(store.reader().estimates().items)
        assert [one in found for one in told] == [is_stored] * len(told)
        assert store.close() == 0
