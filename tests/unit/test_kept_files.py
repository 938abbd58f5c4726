"""Files there whole or not at all, in a directory that somebody made hostile."""

import os
import shutil
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from support.commands import ended

from gateway.files.owned import KeptFiles
from gateway.files.whole import write_whole, written_whole

NOBODY = 65_534


def link(path: Path) -> None:
    path.with_name("target").write_text("not yours")
    path.symlink_to(path.with_name("target"))


@pytest.mark.parametrize("lay", [link, os.mkfifo, Path.mkdir, lambda path: path.symlink_to("nowhere")])
def test_only_plain_files_are_read(tmp_path: Path, lay: Callable[[Path], None]) -> None:
    lay(tmp_path / "kept")
    with pytest.raises(OSError, match=r"'kept'"):
        KeptFiles(tmp_path).read("kept")


@pytest.mark.parametrize("name", ["kept", ".kept.new"])
def test_a_link_is_replaced_and_its_target_left_alone(tmp_path: Path, name: str) -> None:
    link(tmp_path / name)
    KeptFiles(tmp_path).write("kept", b"mine")
    assert (tmp_path / "target").read_text() == "not yours"
    assert not (tmp_path / "kept").is_symlink()
    assert KeptFiles(tmp_path).read("kept") == b"mine"
    assert {entry.name for entry in tmp_path.iterdir()} == {"kept", "target"}


def test_files_set_aside_keep_their_bytes_under_unique_names(tmp_path: Path) -> None:
    files, asides = KeptFiles(tmp_path), []
    for n in range(3):
        files.write("kept", b"%d" % n)
        asides.append(files.set_aside("kept"))
    assert [files.read(aside) for aside in asides] == [b"0", b"1", b"2"]


def test_waiting_for_a_lock_has_a_time_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gateway.files.owned.LOCK_TIMEOUT_S", 0.05)
    with (
        KeptFiles(tmp_path).locked(),
        pytest.raises(TimeoutError, match="another process"),
        KeptFiles(tmp_path).locked(),
    ):
        pass


@pytest.fixture
def of_nobody() -> Iterator[Path]:
    """A service's directory that belongs to a user without rights, in a place that it can reach."""
    place = Path(tempfile.mkdtemp(dir="/tmp"))
    place.chmod(0o755)
    state = place / "state"
    state.mkdir(mode=0o750)
    os.chown(state, NOBODY, NOBODY)
    (place / "springscale.toml").write_text(f'signals = "springscale:reference"\n[store]\ndirectory = "{state}"\n')
    yield place
    shutil.rmtree(place)


def token(place: Path, *arguments: str) -> "subprocess.CompletedProcess[str]":
    of_place = ("--config", place / "springscale.toml")
    return ended(sys.executable, "-m", "gateway", "token", *arguments, *of_place, check=False)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root has rights to give up")
@pytest.mark.parametrize("name", ["tokens.json", ".tokens.json.new"])
def test_root_makes_a_token_with_the_rights_of_the_directorys_owner(of_nobody: Path, name: str) -> None:
    target, state = of_nobody / "of root", of_nobody / "state"
    target.write_text("of root")
    target.chmod(0o644)
    (state / name).symlink_to(target)
    made = token(of_nobody, "create", "fleet")
    assert (target.read_text(), target.stat().st_uid) == ("of root", 0)
    kept = state / "tokens.json"
    if name == kept.name:
        assert (made.returncode, "is no token file" in made.stderr) == (2, True)
        kept.unlink()
        made = token(of_nobody, "create", "fleet")
    assert (made.returncode, made.stderr) == (0, "")
    assert not kept.is_symlink()
    assert (kept.stat().st_uid, kept.stat().st_mode & 0o777) == (NOBODY, 0o600)


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


def test_two_that_write_one_output_each_leave_it_whole(tmp_path: Path) -> None:
    output = tmp_path / "campaign.zip"
    with written_whole(output) as first:
        first.write(b"the fir")
        with written_whole(output) as second:
            second.write(b"the second")
        assert output.read_bytes() == b"the second"
        first.write(b"st")
    assert output.read_bytes() == b"the first"
    assert [path.name for path in tmp_path.iterdir()] == ["campaign.zip"]


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
