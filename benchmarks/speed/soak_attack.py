"""The service weighs at high speed over TLS while crowds connect, ask, and read nothing: small, answering, complete.

Part of `make soak`. Four addresses, each trying 120 connections, again and again: silent ones that never begin a
handshake, ones that ask for the history or its exports and read nothing, streams with an old Last-Event-ID, and unread
assets. It ends with 1 where the process grew beyond its bound, a decent client was refused, or any estimate differs
from those of the same drives without an attack.
"""

import asyncio
import contextlib
import json
import os
import re
import shutil
import signal
import ssl
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import httpx
import numpy as np
import trustme

from benchmarks.speed.endless_drive import serve_when_told
from benchmarks.speed.meter import CALIBRATION, ROOT, command_of, peak_mb, print_and_write
from gateway.store import Store
from gateway.web.pages import LIBRARY_URL
from gateway.workbench.simulate import demo_drive, frames_of

MOST_MB: Final = 250.0  # chosen: bound of the service's memory
N_STORED: Final = 1200  # records before, with spectra
STRANGERS: Final = ("127.0.0.2", "127.0.0.3", "127.0.0.4", "127.0.0.5")
EACH: Final = 120  # chosen: connections per address
HOLD_S: Final = 25.0  # longer than any limit on who is silent or does not read
PAUSE_S: Final = 0.5  # between two questions of the decent client
SILENT: Final = ""
STREAM: Final = "/api/v1/stream"
ASKED: Final = (
    SILENT,
    "/api/v1/estimates?limit=1000",
    "/api/v1/export.jsonl?spectra=true",
    "/api/v1/export.csv",
    STREAM,
    STREAM,
    LIBRARY_URL,
)
UNIT: Final = ROOT / "deploy/springscale.service"
SETTINGS: Final = """\
signals = "springscale:reference"
calibration = "vehicle.json"
[bus]
interface = "virtual"
[web]
port = 0
tls_certificate = "web.pem"
tls_key = "web.key"
[store]
directory = "state"
[log]
level = "error"
"""


class Driven:
    """The service in a process of its own, and its records at the end."""

    def __init__(self, folder: Path, drive: Path, hours: float, days: int) -> None:
        self.state = folder / "state"
        self._process = subprocess.Popen(
            command_of(serve_when_told, folder / "springscale.toml", drive, hours, days),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=ROOT,
            env={**os.environ, **dict(re.findall(r"^Environment=(\w+)=(\S+)$", UNIT.read_text(), re.MULTILINE))},
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._tell, self._told = self._process.stdin, self._process.stdout
        self.url = self._told.readline().strip()
        if not self.url:
            sys.exit("the service did not start")

    def drive(self) -> float:
        """Begin, and wait until all is driven -> seconds it took."""
        begun_s = time.monotonic()
        self._tell.write("begin\n")
        self._tell.flush()
        if self._told.readline() != "over\n":
            sys.exit("the service ended before the drive was over")
        return time.monotonic() - begun_s

    def most_mb(self) -> float:
        """Its peak memory."""
        return round(peak_mb(self._process.pid), 1)

    def stop(self) -> None:
        """End it and wait. Raises CalledProcessError where it did not end well."""
        self._process.send_signal(signal.SIGTERM)
        self._process.communicate()
        if self._process.returncode:
            raise subprocess.CalledProcessError(self._process.returncode, "the service")


def set_up(folder: Path, certificate: trustme.LeafCert, earlier: list[dict[str, Any]]) -> str | None:
    """Configuration, certificate and a history of before; the cursor of its first record."""
    folder.mkdir()
    (folder / "springscale.toml").write_text(SETTINGS)
    shutil.copy(CALIBRATION, folder / "vehicle.json")
    certificate.private_key_pem.write_to_path(folder / "web.key")
    certificate.cert_chain_pems[0].write_to_path(folder / "web.pem")
    with contextlib.closing(Store.open(folder / "state")) as store:
        cursors = [store.write_estimate(record) for record in earlier]
        store.flush(60.0)
    return cursors[0] if cursors else None


def records_of(state: Path) -> dict[str, str]:
    """Every record in a database, by its id."""
    found: dict[str, str] = {}
    with contextlib.closing(Store.open(state)) as store:
        cursor = None
        while (page := store.reader().estimates(limit=1000, cursor=cursor)).items:
            found |= {json.loads(text)["id"]: text for text in page.items}
            cursor = page.last_cursor
    return found


def long_ago(records: dict[str, str]) -> list[dict[str, Any]]:
    """As many records as a history has, of the size they have: those of one drive over and over, long before it."""
    templates = [json.loads(text) for text in records.values() if "spectra" in text]
    chosen = (templates[n % len(templates)] for n in range(N_STORED))
    return [record | {"id": f"before-{n}", "t_end_ns": (n + 1) * 10**9} for n, record in enumerate(chosen)]


async def crowd(url: httpx.URL, context: ssl.SSLContext, cursor: str) -> list[asyncio.StreamWriter]:
    """Connections of every kind; those that asked are given room for as little as may be."""

    async def one(n: int) -> asyncio.StreamWriter | None:
        path = ASKED[n % len(ASKED)]
        is_silent = path == SILENT
        with contextlib.suppress(OSError, TimeoutError):  # refused: its address has too many
            async with asyncio.timeout(HOLD_S):
                _, writer = await asyncio.open_connection(
                    url.host,
                    url.port,
                    local_addr=(STRANGERS[n % len(STRANGERS)], 0),
                    limit=1,
                    ssl=None if is_silent else context,
                    server_hostname=None if is_silent else "localhost",
                )
            last = f"Last-Event-ID: {cursor}\r\n" if path == STREAM else ""
            if not is_silent:
                writer.write(f"GET {path} HTTP/1.1\r\nHost: localhost\r\n{last}\r\n".encode())
            return writer
        return None

    made = await asyncio.gather(*(one(n) for n in range(EACH * len(STRANGERS))))
    return [writer for writer in made if writer is not None]


async def attack(url: httpx.URL, context: ssl.SSLContext, cursor: str, over: asyncio.Event) -> tuple[int, int]:
    """Crowd after crowd until it is over -> crowds, and connections that got in."""
    n_crowds = n_connections = 0
    while not over.is_set():
        members = await crowd(url, context, cursor)
        n_crowds, n_connections = n_crowds + 1, n_connections + len(members)
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(over.wait(), HOLD_S)
        for member in members:
            member.transport.abort()
    return n_crowds, n_connections


async def ask_decently(url: httpx.URL, context: ssl.SSLContext, over: asyncio.Event) -> list[float]:
    """Seconds that each answer took. Raises httpx.HTTPError where one was refused."""
    took_s = []
    async with httpx.AsyncClient(verify=context, timeout=60.0, trust_env=False) as client:
        while not over.is_set():
            for path in ("/health/live", "/api/v1/estimates/latest"):
                begun_s = time.monotonic()
                (await client.get(url.join(path))).raise_for_status()
                took_s.append(time.monotonic() - begun_s)
            await asyncio.sleep(PAUSE_S)
    return took_s


async def under_attack(service: Driven, context: ssl.SSLContext, cursor: str) -> dict[str, float]:
    """The figures of a drive under attack."""
    over, url = asyncio.Event(), httpx.URL(service.url)
    attacking = asyncio.create_task(attack(url, context, cursor, over))
    asking = asyncio.create_task(ask_decently(url, context, over))
    await asyncio.sleep(2.0)  # the first crowd is there
    try:
        drove_s = await asyncio.to_thread(service.drive)
    finally:
        over.set()
    (n_crowds, n_connections), took_s = await attacking, await asking
    return {
        "drove_s": round(drove_s, 1),
        "crowds": n_crowds,
        "connections": n_connections,
        "answers": len(took_s),
        "answer_median_ms": round(1e3 * float(np.median(took_s)), 1),
        "answer_slowest_ms": round(1e3 * max(took_s), 1),
        "memory_mb": service.most_mb(),
    }


@contextlib.contextmanager
def recorded_drive() -> Iterator[Path]:
    """A simulated drive as a file: the simulator stays out of the process that is measured."""
    frames = frames_of(demo_drive())
    with TemporaryDirectory() as folder:
        path = Path(folder) / "drive.npz"
        np.savez(path, t_ns=frames.t_ns, can_id=frames.can_id, length=frames.length, payload=frames.payload)
        yield path


def soak_attack(hours: float, days: int) -> dict[str, Any]:
    """The figures of both drives, and how many estimates differ."""
    authority = trustme.CA()
    certificate, context = authority.issue_cert("localhost", "127.0.0.1"), ssl.create_default_context()
    authority.configure_trust(context)
    with recorded_drive() as drive, TemporaryDirectory() as folder:
        set_up(Path(folder) / "calm", certificate, [])
        calm = Driven(Path(folder) / "calm", drive, hours, days)
        calm_s, calm_mb = calm.drive(), calm.most_mb()
        calm.stop()
        expected = records_of(calm.state)
        earlier = long_ago(expected)
        cursor = set_up(Path(folder) / "attacked", certificate, earlier)
        assert cursor is not None
        attacked = Driven(Path(folder) / "attacked", drive, hours, days)
        figures = asyncio.run(under_attack(attacked, context, cursor))
        attacked.stop()
        found = records_of(attacked.state)
    for record in earlier:
        del found[record["id"]]
    n_different = len(found.keys() - expected) + sum(found.get(name) != text for name, text in expected.items())
    calm_figures = {"calm_s": round(calm_s, 1), "calm_mb": calm_mb}
    return figures | calm_figures | {"estimates": len(expected), "different": n_different}


def measure(days: int, hours: float) -> dict[str, Any]:
    """The figures of days with this many hours of driving, and their bound."""
    return soak_attack(hours, days) | {"hours": hours * days, "memory_allowed_mb": MOST_MB}


def main() -> None:
    """Print the figures; exit with 1 if a bound was exceeded."""
    figures = print_and_write(__doc__, measure, days=3, hours=4.0)
    if figures["memory_mb"] > MOST_MB:
        sys.exit(f"{figures['memory_mb']} MB, at most {MOST_MB:g} is allowed")
    if figures["different"] or not figures["estimates"]:
        sys.exit(f"{figures['different']} of {figures['estimates']} estimates are not as without an attack")


if __name__ == "__main__":
    main()
