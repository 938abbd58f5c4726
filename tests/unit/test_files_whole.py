"""Files that a person asked for: there whole or not at all, and what was there before stays until then."""

import os
import threading
from pathlib import Path

import pytest

from gateway.files.whole import write_whole, written_whole


def test_a_disk_that_fills_leaves_the_file_that_was_there(tmp_path: Path) -> None:
    output = tmp_path / "vehicle.json"
    write_whole(output, "old")
    with pytest.raises(OSError, match="full"):
        _filling(output)
    assert output.read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["vehicle.json"]


def _filling(output: Path) -> None:
    with written_whole(output) as file:
        file.write(b"half of the ne")
        raise OSError("the disk is full")


def test_the_new_one_has_the_rights_of_the_old_and_a_link_stays_one(tmp_path: Path) -> None:
    output, link = tmp_path / "vehicle.json", tmp_path / "current.json"
    write_whole(output, "old")
    output.chmod(0o640)
    link.symlink_to(output)
    write_whole(link, "ö")
    assert (output.read_bytes(), output.stat().st_mode & 0o777) == ("ö".encode(), 0o640)
    assert link.is_symlink()


def test_a_pipe_is_written_to_and_stays_one(tmp_path: Path) -> None:
    pipe, heard = tmp_path / "pipe", []
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: heard.append(pipe.read_text()))
    reader.start()
    write_whole(pipe, "new")
    reader.join(10.0)
    assert heard == ["new"]
    assert pipe.is_fifo()


def test_a_folder_that_is_not_there_is_an_error_of_the_system(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        write_whole(tmp_path / "none" / "vehicle.json", "new")
