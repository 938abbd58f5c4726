"""Crowds that ask for much and read nothing: the service stays small, answers others, and makes every estimate."""

import asyncio
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from urllib.parse import urlencode

import httpx
import numpy as np
import pytest
from support.bus_drive import bus_drive
from support.estimates import make_estimate
from support.paper_van import paper_van_config
from support.patience import PATIENCE_S, wait_until
from support.ports import first_answer, free_port
from support.process import TESTS

from gateway.bus.logs import write_candump
from gateway.config import load_settings
from gateway.estimates.as_json import estimate_to_json
from gateway.offline.estimates import estimates_of_logs
from gateway.records import Spectra
from gateway.setup import setup_of
from gateway.store import Store
from gateway.web.pages import LIBRARY_URL

MOST_MB = 250.0
N_STORED = 1200
STRANGERS = ("127.0.0.2", "127.0.0.3", "127.0.0.4", "127.0.0.5")  # 20 connections each: 80 of the 100 that there are
EACH = 20
ASKED = {
    "history": ["/api/v1/estimates?limit=1000", "/api/v1/export.csv"],
    "streams": ["/api/v1/stream"],
    "assets": [LIBRARY_URL, "/swagger/swagger-ui-bundle.js", "/docs"],
}


@pytest.fixture
def config(tmp_path: Path) -> Path:
    return paper_van_config(tmp_path, free_port(), "[batch]\nwindow_s = 20.0")


def fill(directory: Path) -> str:
    """A history of records as large as a service writes them; the cursor of the first."""
    store = Store.open(directory)
    spectra = Spectra(*(np.random.default_rng(k).random(75) for k in range(5)))
    record = replace(make_estimate(0), spectra=spectra)
    cursors = [
        store.write_estimate(estimate_to_json(replace(record, t_end_ns=(n + 1) * 10**9))) for n in range(N_STORED)
    ]
    assert store.close() == 0
    return cursors[0]


@contextmanager
def driven(config: Path, log: Path) -> Iterator["subprocess.Popen[str]"]:
    process = subprocess.Popen(
        [sys.executable, "-m", "support.replayed_service", str(config), str(log), "later"],
        stdin=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        cwd=TESTS,
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def tell(process: "subprocess.Popen[str]") -> None:
    process.stdin.write("go on\n")
    process.stdin.flush()


def most_mb(process: "subprocess.Popen[str]") -> float:
    found = re.search(r"VmHWM:\s+(\d+) kB", Path(f"/proc/{process.pid}/status").read_text())
    return int(found[1]) / 1024


async def ask_and_read_nothing(port: int, paths: list[str], cursor: str) -> list[asyncio.StreamWriter]:
    """Connections that have asked and whose kernel takes as little as it may of what comes."""
    crowd = []
    for n in range(EACH * len(STRANGERS)):
        reader, writer = await asyncio.open_connection(
            "127.0.0.1", port, local_addr=(STRANGERS[n % len(STRANGERS)], 0), limit=1
        )
        del reader
        head = f"GET {paths[n % len(paths)]} HTTP/1.1\r\nHost: localhost\r\nLast-Event-ID: {cursor}\r\n\r\n"
        writer.write(head.encode() if "stream" in paths[0] else re.sub("Last.*\n", "", head).encode())
        crowd.append(writer)
    return crowd


@pytest.mark.parametrize("kind", ASKED)
def test_clients_that_read_nothing_use_bounded_memory_and_delay_no_weighing(config: Path, kind: str) -> None:
    settings = load_settings(config)
    cursor = fill(settings.store.directory)
    log = config.parent / "drive.log"
    write_candump(bus_drive(45.0, seed=5), "can0", log)
    n_expected = len(list(estimates_of_logs([log], setup_of(settings), settings.batch.for_core())))
    url = f"http://127.0.0.1:{settings.web.port}"

    async def attack(process: "subprocess.Popen[str]") -> None:
        crowd = await ask_and_read_nothing(settings.web.port, ASKED[kind], cursor)
        tell(process)
        for _ in range(10):
            answer = await asyncio.to_thread(httpx.get, f"{url}/health/live", timeout=PATIENCE_S)
            assert answer.status_code == 200
            await asyncio.sleep(0.1)
        for writer in crowd:
            writer.transport.abort()

    with driven(config, log) as process:
        assert first_answer(f"{url}/health/live").status_code == 200
        asyncio.run(attack(process))
        assert wait_until(lambda: len(stored(url)) >= n_expected - 1)  # the rest is closed at the end
        assert most_mb(process) < MOST_MB
        tell(process)
        assert process.wait(PATIENCE_S) == 0
    store = Store.open(settings.store.directory)
    assert len(store.reader().estimates(limit=10_000, with_spectra=False).items) == N_STORED + n_expected
    store.close()


def stored(url: str) -> list[object]:
    """The records stored since the year in which the made-up history ends."""
    asked = {"since": "2000-01-01T00:00:00Z", "limit": 1000, "spectra": "false"}
    return first_answer(f"{url}/api/v1/estimates?{urlencode(asked)}").json()["items"]
