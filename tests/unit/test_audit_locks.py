"""The audit of the locks asks for every locked package, and fails where something is known or nobody answers."""

import json
import re
import shlex
import subprocess
import sys
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest
from support.commands import ended
from support.locks import ROOT, pins
from support.ports import free_port

WEAKNESS = {
    "id": "GHSA-1",
    "aliases": ["CVE-2026-1"],
    "summary": "bad",
    "affected": [
        {
            "package": {"name": "numpy", "ecosystem": "PyPI"},
            "ranges": [{"type": "ECOSYSTEM", "events": [{"introduced": "0"}]}],
        }
    ],
}


class Answer(BaseHTTPRequestHandler):
    """Answers as OSV does: numpy alone has a weakness."""

    asked: set[str]

    def do_POST(self) -> None:
        name = json.loads(self.rfile.read(int(self.headers["Content-Length"])))["package"]["name"]
        self.asked.add(name)
        said = json.dumps({"vulns": [WEAKNESS]} if name == "numpy" else {}).encode()
        self.send_response(200)
        self.send_header("Content-Length", str(len(said)))
        self.end_headers()
        self.wfile.write(said)

    def log_message(self, *_arguments: object) -> None:
        """Quiet."""


@pytest.fixture
def port() -> Iterator[int]:
    Answer.asked = set()
    with ThreadingHTTPServer(("127.0.0.1", 0), Answer) as service:
        threading.Thread(target=service.serve_forever).start()
        yield service.server_port
        service.shutdown()


def audit(port: int) -> "subprocess.CompletedProcess[str]":
    """`make audit` with another service."""
    makefile = (ROOT / "Makefile").read_text().replace("\\\n", "")
    (command,) = re.findall(r"^AUDIT = (.*)", makefile, re.MULTILINE)
    url = f"http://127.0.0.1:{port}/v1/query"
    words = shlex.split(command.replace("$(BIN)/python", sys.executable).replace("$(OSV)", url))
    return ended(*words, check=False, env={"NO_PROXY": "127.0.0.1", "PATH": "/usr/bin:/bin"}, cwd=ROOT)


def test_every_locked_package_is_asked_for_and_a_known_weakness_fails(port: int) -> None:
    run = audit(port)
    assert run.returncode == 1
    assert Answer.asked == {*pins("requirements-workbench.txt"), *pins("requirements-build.txt")}
    assert "CVE-2026-1" in run.stdout
    assert "Found 1 known vulnerability in 1 package" in run.stderr


def test_where_nobody_answers_nothing_counts_as_checked() -> None:
    run = audit(free_port())
    assert run.returncode == 1
    assert "No known vulnerabilities" not in run.stdout + run.stderr
