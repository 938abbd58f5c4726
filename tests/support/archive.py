"""A fleet's archive, made up: short drives of white noise, a calibration that answers them, and where to keep them."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import httpx
import pytest

from gateway.archive import Location, place_of, slots_done
from gateway.archive.workers import Workers
from gateway.bus.frames import take
from gateway.bus.logs import write_candump
from gateway.records import Frames
from support.bus_drive import white_noise
from support.calibrated import calibration_file
from support.patience import PATIENCE_S
from support.ports import first_answer, free_port

Answer = TypeVar("Answer")

MIDNIGHT_NS = 1_793_491_200_000_000_000  # 2026-11-01T00:00:00Z, where a month ends
S = 1_000_000_000
WINDOW_S = 20.0
MANIFEST = f"""
signals = "springscale:reference"
calibration = "vehicle.json"
estimator = "ratio_index"
batch.window_s = {WINDOW_S}
"""


class Here(Workers):
    """Does at once, in this process, what is submitted."""

    n_workers = 1

    def __init__(self) -> None:
        """Remembers the arguments and starts nothing."""

    def submit(self, fn: Callable[..., Answer], /, *args: Any, **kwargs: Any) -> Future[Answer]:
        future: Future[Answer] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as fault:  # noqa: BLE001 - it belongs to who asked
            future.set_exception(fault)
        return future


def write_manifest(folder: Path, *vehicles: str, more: str = "") -> Path:
    """archive.toml and its calibration; each vehicle is the TOML of its entry, or its name alone."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "vehicle.json").write_text(calibration_file().to_json())
    entries = [one if "=" in one else f'id = "{one}"' for one in vehicles]
    path = folder / "archive.toml"
    path.write_text(MANIFEST + more + "".join(f"\n[[vehicles]]\n{entry}\n" for entry in entries))
    return path


def write_drive(path: Path, start_ns: int, duration_s: float, seed: int = 1) -> Frames:
    """One log of white noise."""
    frames = white_noise(duration_s, start_ns, seed)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_candump(frames, "can0", path)
    return frames


def write_cut_drive(folder: Path, start_ns: int, duration_s: float, cut_ns: int, seed: int = 1) -> Frames:
    """One drive in two logs, as a logger that begins a new one at an instant leaves it; all frames of both."""
    frames = white_noise(duration_s, start_ns, seed)
    folder.mkdir(parents=True, exist_ok=True)
    write_candump(take(frames, frames.t_ns < cut_ns), "can0", folder / "1.log")
    write_candump(take(frames, frames.t_ns >= cut_ns), "can0", folder / "2.log")
    return frames


def write_fleet(folder: Path, n_vehicles: int) -> Path:
    """A day of many vehicles: a drive each, of every fifth in two logs that follow one another within a batch."""
    names = [f"van-{n:03}" for n in range(n_vehicles)]
    for n, name in enumerate(names):
        start_ns = MIDNIGHT_NS + n * S
        if n % 5 == 0:
            write_cut_drive(folder / name, start_ns, 22.0, start_ns + 12 * S, seed=n)
        else:
            write_drive(folder / name / "1.log", start_ns, 22.0, seed=n)
    return write_manifest(folder, *names)


def uploaded(folder: Path, place: Location) -> None:
    """Every file of a folder, in a place."""
    for item in place_of(folder).items():
        place.create(item.path, (folder / item.path).read_bytes())


def tables_of(dataset: Location) -> dict[str, bytes]:
    """The tables that receipts name, byte by byte."""
    return {slot.table: dataset.read(slot.table) for slot in slots_done(dataset)}


@contextmanager
def object_store() -> Iterator[str]:
    """An S3 server of the test's own, in a process of its own, with one bucket; its URL.

    obstore finds it by the environment.
    """
    port = free_port()
    address, bucket = f"http://127.0.0.1:{port}", f"fleet-{port}"  # a process keeps its connections by their names
    told = {"ENDPOINT_URL": address, "ACCESS_KEY_ID": "x", "SECRET_ACCESS_KEY": "x", "REGION": "us-east-1"}
    command = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)]
    with (
        subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as server,
        pytest.MonkeyPatch.context() as environment,
    ):
        for name, text in (*told.items(), ("ALLOW_HTTP", "true")):
            environment.setenv(f"AWS_{name}", text)
        try:
            first_answer(address)
            httpx.put(f"{address}/{bucket}", timeout=PATIENCE_S).raise_for_status()
            yield f"s3://{bucket}"
        finally:
            server.kill()


def die(reached: str) -> None:
    """Ends the worker as if it ran out of memory; the first time only if ``reached`` names a file."""
    if reached and Path(reached).exists():
        return
    if reached:
        Path(reached).write_text("once")
    os.kill(os.getpid(), signal.SIGKILL)
