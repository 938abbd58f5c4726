"""Wheel, source archive and bills of materials of the last commit, the same bytes wherever they are made: `make dist`.

What is not committed plays no part, nothing is fetched, and every time in the files is that of the commit.
"""

import argparse
import gzip
import hashlib
import io
import json
import os
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

PROJECT: Final = Path(__file__).resolve().parents[2]
LOCKS: Final = {"vehicle": "requirements.txt", "workbench": "requirements-workbench.txt"}
CYCLONEDX: Final = "1.6"


def main() -> None:
    """All files into the output folder, with their hashes; prints these."""
    arguments = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    arguments.add_argument("--output", type=Path, default=PROJECT / "dist")
    output: Path = arguments.parse_args().output
    shutil.rmtree(output, ignore_errors=True)
    output.mkdir(parents=True)
    epoch_s = int(asked("git", "log", "-1", "--format=%ct"))
    with TemporaryDirectory() as folder:
        tree = Path(folder)
        check_out(tree)
        build(tree, output, epoch_s)
        for name, lock in LOCKS.items():
            (output / f"springscale-{name}.cdx.json").write_text(bill_of_materials(tree, lock))
    hashes = "".join(f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {file.name}\n" for file in sorted(output.iterdir()))
    (output / "SHA256SUMS").write_text(hashes)
    print(hashes, end="")


def asked(*command: str) -> str:
    """What a command says of the project."""
    return subprocess.run(command, cwd=PROJECT, capture_output=True, text=True, check=True).stdout.strip()


# Python 3.11.2, Debian 12's, knows no filters yet and takes everything as it stands
_TRUSTED: Final[dict[str, Any]] = {"filter": "tar"} if hasattr(tarfile, "tar_filter") else {}


def check_out(tree: Path) -> None:
    """The committed files, with modes that do not hang on this machine's umask."""
    command = ["git", "-c", "tar.umask=0022", "archive", "HEAD"]
    archive = subprocess.run(command, cwd=PROJECT, capture_output=True, check=True).stdout
    with tarfile.open(fileobj=io.BytesIO(archive)) as packed:
        packed.extractall(tree, **_TRUSTED)


def build(tree: Path, output: Path, epoch_s: int) -> None:
    """Wheel and source archive by the build tools that are installed here, which requirements-build.txt pins."""
    command = [sys.executable, "-m", "build", "--no-isolation", "--sdist", "--wheel", "--outdir", str(output), str(tree)]
    environment = {**os.environ, "SOURCE_DATE_EPOCH": str(epoch_s), "PYTHONHASHSEED": "0"}
    subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL)
    (archive,) = output.glob("*.tar.gz")
    archive.write_bytes(timeless(archive.read_bytes(), epoch_s))


def timeless(archive: bytes, epoch_s: int) -> bytes:
    """The same source archive with its members in order, owned by nobody, of one time (setuptools writes the present)."""
    packed = io.BytesIO()
    with (
        tarfile.open(fileobj=io.BytesIO(archive)) as source,
        gzip.GzipFile("", "wb", fileobj=packed, mtime=epoch_s) as zipped,
        tarfile.open(fileobj=zipped, mode="w", format=tarfile.USTAR_FORMAT) as target,
    ):
        for member in sorted(source.getmembers(), key=lambda each: each.name):
            member.mtime, member.uid, member.gid, member.uname, member.gname = epoch_s, 0, 0, "", ""
            member.pax_headers = {}
            target.addfile(member, source.extractfile(member) if member.isfile() else None)
    return packed.getvalue()


def bill_of_materials(tree: Path, lock: str) -> str:
    """CycloneDX: every locked package with its hashes."""
    command = [sys.executable, "-W", "ignore", "-m", "cyclonedx_py", "requirements", lock, "--pyproject", "pyproject.toml"]
    options = ["--mc-type", "application", "--output-reproducible", "--of", "JSON", "--sv", CYCLONEDX]
    made = subprocess.run([*command, *options], cwd=tree, capture_output=True, text=True, check=True).stdout
    bill: dict[str, Any] = json.loads(made)
    return json.dumps(bill, indent=2, sort_keys=True) + "\n"


if __name__ == "__main__":
    os.umask(0o022)
    main()
