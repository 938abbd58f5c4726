"""A real PostgreSQL of a test's own, on a socket in its folder; it refuses to be root, so it runs as somebody else."""

import contextlib
import os
import pwd
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import psycopg
import pytest

from support.patience import PATIENCE_S, wait_until


def _binaries() -> Path | None:
    """Where initdb and postgres lie: on the path, or where Debian keeps them, the newest version first."""
    kept = sorted(Path("/usr/lib/postgresql").glob("*/bin"), key=lambda folder: int(folder.parent.name), reverse=True)
    found = shutil.which("initdb", path=os.pathsep.join([*map(str, kept), os.environ.get("PATH", "")]))
    return None if found is None else Path(found).resolve().parent


BINARIES = _binaries()
needs_postgres = pytest.mark.skipif(BINARIES is None, reason="postgresql is not installed")

OWNER = "springscale-subscriber"
ADMINISTRATOR = {"user": "postgres", "dbname": "postgres"}


class Postgres:
    """A PostgreSQL without a network, set up as docs/fleet.md says; ``environment`` has its address.

    ``stop`` and ``start`` as an administrator would.
    """

    def __init__(self, directory: Path) -> None:
        self._directory = directory
        self._process: subprocess.Popen[bytes] | None = None
        self.environment = {"PGHOST": str(directory), "PGUSER": OWNER, "PGDATABASE": "fleet"}
        self._run("initdb", "--auth=trust", "--username=postgres", "--encoding=UTF8", "--no-sync", "-D", self._cluster)
        self.start()
        with self.connect(**ADMINISTRATOR) as connection:
            connection.execute(f'CREATE ROLE "{OWNER}" LOGIN')
            connection.execute(f'CREATE DATABASE fleet OWNER "{OWNER}"')

    @property
    def _cluster(self) -> str:
        return str(self._directory / "cluster")

    def _run(self, name: str, *arguments: str) -> None:
        assert BINARIES is not None
        made = subprocess.run(
            [BINARIES / name, *arguments], check=False, capture_output=True, text=True, cwd="/", **_somebody()
        )
        assert made.returncode == 0, made.stderr

    def start(self) -> None:
        assert BINARIES is not None
        socket = ["-k", str(self._directory), "-c", "listen_addresses=", "-c", "fsync=off"]
        self._process = subprocess.Popen(
            [BINARIES / "postgres", "-D", self._cluster, *socket],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            cwd="/",
            **_somebody(),
        )
        assert wait_until(self._answers), "postgres did not start"

    def stop(self) -> None:
        """At once, clients cut off."""
        if self._process is not None:
            self._process.send_signal(2)  # SIGINT: a fast shutdown
            self._process.wait(PATIENCE_S)
            self._process = None

    def connect(self, **changed: str) -> "psycopg.Connection[tuple[object, ...]]":
        asked = {"host": str(self._directory), "user": OWNER, "dbname": "fleet", "autocommit": True, **changed}
        return psycopg.connect(**asked)

    def _answers(self) -> bool:
        with contextlib.suppress(psycopg.OperationalError), self.connect(**ADMINISTRATOR):
            return True
        return False


def _somebody() -> dict[str, object]:
    if os.getuid() != 0:
        return {}
    nobody = pwd.getpwnam("nobody")
    return {"user": nobody.pw_uid, "group": nobody.pw_gid, "extra_groups": []}


@contextlib.contextmanager
def running_postgres() -> Iterator[Postgres]:
    """Runs PostgreSQL in a folder that its own user may enter, unlike pytest's; the socket's path must be short."""
    directory = Path(tempfile.mkdtemp(prefix="springscale-"))
    try:
        if os.getuid() == 0:
            nobody = pwd.getpwnam("nobody")
            os.chown(directory, nobody.pw_uid, nobody.pw_gid)
        database = Postgres(directory)
        try:
            yield database
        finally:
            database.stop()
    finally:
        shutil.rmtree(directory, ignore_errors=True)
