"""`make dist` of two clones gives the same bytes, complete and with a bill of what is in them."""

import json
import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest
from make_dist import LOCKS
from support.locks import ROOT, pins
from support.patience import PATIENCE_S

pytestmark = pytest.mark.skipif(shutil.which("git") is None, reason="git is not installed here")


def made(folder: Path, umask: int, zone: str) -> Path:
    """The files that a fresh clone builds from the last commit."""
    subprocess.run(["git", "clone", "--quiet", "--depth=1", ROOT.as_uri(), folder / "clone"], check=True, umask=umask)
    script = folder / "clone/deploy/dist/make_dist.py"
    environment = {**os.environ, "TZ": zone}
    subprocess.run([sys.executable, script], check=True, timeout=PATIENCE_S, env=environment, umask=umask)
    return folder / "clone/dist"


@pytest.fixture(scope="module")
def dist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made(tmp_path_factory.mktemp("one"), 0o022, "UTC")


def test_two_clones_give_the_same_bytes(dist: Path, tmp_path: Path) -> None:
    again = made(tmp_path, 0o077, "Asia/Tokyo")
    assert {file.name: file.read_bytes() for file in dist.iterdir()} == {
        file.name: file.read_bytes() for file in again.iterdir()
    }


def test_the_wheel_holds_code_maps_and_pages(dist: Path) -> None:
    (wheel,) = dist.glob("*.whl")
    names = set(zipfile.ZipFile(wheel).namelist())
    tracked = subprocess.run(["git", "ls-files", "gateway"], cwd=ROOT, capture_output=True, text=True, check=True)
    assert [name for name in tracked.stdout.splitlines() if name not in names] == []
    assert "gateway/dbc/reference.toml" in names


def test_the_source_archive_builds_itself(dist: Path) -> None:
    (archive,) = dist.glob("*.tar.gz")
    with tarfile.open(archive) as packed:
        names = {name.partition("/")[2] for name in packed.getnames()}
        assert {member.uid for member in packed.getmembers()} == {0}
    assert {"pyproject.toml", "README.md", "LICENSE", "dbc/reference.toml"} <= names


@pytest.mark.parametrize("name", LOCKS)
def test_the_bill_names_every_locked_package(dist: Path, name: str) -> None:
    bill = json.loads((dist / f"springscale-{name}.cdx.json").read_text())
    assert (bill["bomFormat"], bill["metadata"]["component"]["name"]) == ("CycloneDX", "springscale")
    named = {each["name"]: each["version"] for each in bill["components"]}
    assert named.items() >= pins(LOCKS[name]).items()
