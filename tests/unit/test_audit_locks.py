"""The audit of the locks against a vulnerability service of the test's own: what it says, and when it fails."""

import json
import subprocess
import sys
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest
from audit_locks import LOCKS
from support.commands import ended
from support.locks import ROOT, pins
from support.ports import free_port

SCRIPT = ROOT / "deploy/dist/audit_locks.py"
NAMES = [*pins(LOCKS[0]).items(), *pins(LOCKS[1]).items()]


class Service(ThreadingHTTPServer):
    """Answers as OSV does; ``weak`` maps a package to the version that mends it, ``status`` stands for every answer."""

    weak: dict[str, str | None]
    status = 200
    asked: list[tuple[str, str]]

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_port}/v1/query"


class Answer(BaseHTTPRequestHandler):
    server: Service

    def do_POST(self) -> None:
        question = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        name, version = question["package"]["name"], question["version"]
        self.server.asked.append((name, version))
        said = json.dumps(self.weaknesses(name)).encode()
        self.send_response(self.server.status)
        self.send_header("Content-Length", str(len(said)))
        self.end_headers()
        self.wfile.write(said)

    def weaknesses(self, name: str) -> dict[str, Any]:
        if name not in self.server.weak:
            return {}
        mended = self.server.weak[name]
        events = [{"introduced": "0"}] + ([{"fixed": mended}] if mended else [])
        ranges = [{"type": "ECOSYSTEM", "events": events}]
        affected = [{"package": {"name": name, "ecosystem": "PyPI"}, "ranges": ranges}]
        return {"vulns": [{"id": "GHSA-1", "aliases": ["CVE-2026-1"], "summary": "bad", "affected": affected}]}

    def log_message(self, *_arguments: object) -> None:
        """Quiet."""


@pytest.fixture
def service() -> Iterator[Service]:
    answering = Service(("127.0.0.1", 0), Answer)
    answering.weak, answering.asked = {}, []
    thread = threading.Thread(target=answering.serve_forever)
    thread.start()
    yield answering
    answering.shutdown()
    thread.join()
    answering.server_close()


def audit(url: str, *arguments: str) -> "subprocess.CompletedProcess[str]":
    surroundings = {"NO_PROXY": "127.0.0.1", "PATH": "/usr/bin:/bin"}
    return ended(sys.executable, SCRIPT, f"--service={url}", *arguments, check=False, env=surroundings)


def test_every_locked_package_is_checked_by_its_version(service: Service) -> None:
    run = audit(service.url)
    assert (run.returncode, run.stdout) == (0, f"audit: {len(set(NAMES))} packages checked, 0 weaknesses known\n")
    assert set(service.asked) == set(NAMES)


@pytest.mark.parametrize(("arguments", "code"), [((), 1), (("--advisory",), 0)])
def test_a_known_vulnerability_is_reported_and_fails_only_on_request(
    service: Service, arguments: tuple[str, ...], code: int
) -> None:
    service.weak = {"numpy": "99.1", "fastapi": None}
    run = audit(service.url, *arguments)
    versions = pins("requirements.txt")
    assert run.returncode == code
    assert sorted(run.stdout.splitlines()[:-1]) == [
        f"fastapi {versions['fastapi']}: CVE-2026-1 GHSA-1, not mended yet",
        f"numpy {versions['numpy']}: CVE-2026-1 GHSA-1, mended in 99.1",
    ]
    assert run.stdout.splitlines()[-1].endswith("2 weaknesses known")


@pytest.mark.parametrize(("arguments", "code"), [((), 1), (("--advisory",), 0)])
@pytest.mark.parametrize("status", [None, 503])
def test_without_a_database_nothing_counts_as_checked(
    service: Service, status: int | None, arguments: tuple[str, ...], code: int
) -> None:
    service.status = status or 200
    run = audit(service.url if status else f"http://127.0.0.1:{free_port()}/v1/query", *arguments)
    assert run.returncode == code
    assert run.stdout.startswith("audit: NOT CHECKED: requirements-workbench.txt requirements-build.txt: http://127")
    assert run.stdout.count("\n") == 1
    assert "Traceback" not in run.stdout + run.stderr


def test_a_lock_without_hashes_is_not_taken_for_checked(service: Service, tmp_path: Path) -> None:
    lock = tmp_path / "loose.txt"
    lock.write_text("numpy>=1\n")
    run = audit(service.url, str(lock))
    assert run.returncode == 1
    assert "NOT CHECKED: loose.txt" in run.stdout
    assert service.asked == []
