"""The whole service on a live drive with roll: CPU of one core and memory, provisional estimates included.

The demo's drive comes in real time, as CAN datagrams over a loopback socket with kernel stamps (live.py): what a kernel
filter lets through of a bus of 2500 frames/s. The first provisional estimates come after a minute; what a whole batch
costs is measured by weigh.py.
"""

import json
import os
import shutil
import socket
import struct
import subprocess
import tempfile
import time
import urllib.request
from functools import partial
from pathlib import Path
from typing import Any, Final

from benchmarks.speed.live import listening_socket
from benchmarks.speed.meter import CALIBRATION, ENVIRONMENT, command_of, cpu_of_s, in_own_process, peak_mb
from benchmarks.speed.start import SETTINGS
from gateway.bus.receiver import open_channel
from gateway.config import load_settings
from gateway.model.allocator import keep_freed_memory
from gateway.service.gateway import Gateway
from gateway.setup import setup_of
from gateway.units import NS_PER_S

BEGIN_S: Final = 60.0  # chosen: of the drive, which is at speed by then


def serve(folder: str) -> None:
    """The service in a process of its own; prints where its bus and its web are."""
    keep_freed_memory()  # as the command does
    settings = load_settings(Path(folder) / "springscale.toml")
    wire = listening_socket()

    def on_started(gateway: Gateway) -> None:
        print(json.dumps({"port": wire.getsockname()[1], "url": gateway.url}), flush=True)

    opener = partial(open_channel, "socketcan", "bench", (), 8, {})
    Gateway(settings, setup_of(settings), on_started=on_started, open_receiver=opener).run()


def send(port: int, seconds: float) -> int:
    """Send the drive in real time, in groups of five milliseconds -> the number of frames."""
    from gateway.workbench.simulated_drives import demo_drive, frames_of  # noqa: PLC0415 # nothing that the service's process should hold

    drive = frames_of(demo_drive())
    since_s = (drive.t_ns - drive.t_ns[0]) / NS_PER_S - BEGIN_S
    rows = [i for i in range(len(drive)) if 0.0 <= since_s[i] < seconds]
    fields = zip(drive.can_id[rows], drive.length[rows], drive.payload[rows], strict=True)
    frames = [struct.pack("=IB3x8s", int(can_id), int(n), payload.tobytes()) for can_id, n, payload in fields]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as wire:
        wire.connect(("127.0.0.1", port))
        begun_s, n_sent = time.monotonic(), 0
        while n_sent < len(frames):
            while n_sent < len(frames) and since_s[rows[n_sent]] <= time.monotonic() - begun_s:
                wire.send(frames[n_sent])
                n_sent += 1
            time.sleep(0.005)
    return n_sent


def measure(seconds: float) -> dict[str, Any]:
    """One drive of this many seconds."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copy(CALIBRATION, folder / "vehicle.json")
        (folder / "springscale.toml").write_text(SETTINGS)
        environment, quiet = os.environ | ENVIRONMENT, subprocess.DEVNULL
        service = subprocess.Popen(
            command_of(serve, folder), stdout=subprocess.PIPE, stderr=quiet, text=True, env=environment
        )
        assert service.stdout is not None
        try:
            where = json.loads(service.stdout.readline())
            begun_s, begun_cpu_s = time.monotonic(), cpu_of_s(service.pid)
            n_sent = in_own_process(send, where["port"], seconds)
            time.sleep(1.0)
            cpu_s, taken_s = cpu_of_s(service.pid) - begun_cpu_s, time.monotonic() - begun_s
            with urllib.request.urlopen(f"{where['url']}/api/v1/status") as answer:
                bus = json.load(answer)["bus"]
            with urllib.request.urlopen(f"{where['url']}/api/v1/estimates/latest") as answer:
                latest = json.load(answer)
            found = {"cpu_pct": 100 * cpu_s / min(taken_s, seconds), "peak_mb": peak_mb(service.pid)}
        finally:
            service.terminate()
            service.wait(30.0)
    lost = n_sent - bus["n_frames"]
    return {**found, "seconds": seconds, "frames": bus["n_frames"], "lost": lost, "payload_kg": latest["payload_kg"]}
