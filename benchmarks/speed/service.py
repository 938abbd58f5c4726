"""The whole service on a live drive with roll: CPU of one core and memory, provisional estimates included.

    python -m benchmarks.speed.service [--seconds 75] [--json]

The demo's drive comes in real time, as CAN datagrams over a loopback socket with kernel stamps (live.py): what a kernel
filter lets through of a bus of 2500 frames/s. The first provisional estimates come after a minute; what a whole batch
costs is measured by weigh.py.
"""

import argparse
import json
import os
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path
from typing import Any, Final

from benchmarks.speed.live import listening_socket
from benchmarks.speed.meter import ONE_THREAD, cpu_of_s, peak_mb
from benchmarks.speed.start import REPOSITORY, SETTINGS
from gateway.bus.live.socketcan import SocketCanReceiver
from gateway.config import load_settings
from gateway.service.gateway import Gateway
from gateway.setup import setup_of
from gateway.units import NS_PER_S

PROGRAM: Final = (sys.executable, "-m", "benchmarks.speed.service")
BEGIN_S: Final = 60.0  # chosen: of the drive, which is at speed by then


def serve(folder: Path) -> None:
    """The service in a process of its own; prints where its bus and its web are."""
    settings = load_settings(folder / "springscale.toml")
    wire = listening_socket()

    def on_started(gateway: Gateway) -> None:
        print(json.dumps({"port": wire.getsockname()[1], "url": gateway.url}), flush=True)

    receiver = SocketCanReceiver(wire, 8)
    Gateway(settings, setup_of(settings), on_started=on_started, open_receiver=lambda: receiver).run()


def send(port: int, seconds: float) -> None:
    """Send the drive in real time, in groups of five milliseconds; print the number of frames."""
    from gateway.workbench import demo_drive, frames_of  # noqa: PLC0415 # nothing that the service's process should hold

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
    print(n_sent)


def measure(seconds: float) -> dict[str, Any]:
    """One drive of this many seconds."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copy(REPOSITORY / "gateway/demo/paper_van.json", folder / "vehicle.json")
        (folder / "springscale.toml").write_text(SETTINGS)
        command = [*PROGRAM, "--serve", str(folder)]
        service = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=os.environ | ONE_THREAD
        )
        assert service.stdout is not None
        try:
            where = json.loads(service.stdout.readline())
            begun_s, begun_cpu_s = time.monotonic(), cpu_of_s(service.pid)
            sender = [*PROGRAM, "--send", str(where["port"]), "--seconds", str(seconds)]
            sent = subprocess.run(sender, check=True, stdout=subprocess.PIPE, text=True)
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
    lost = int(sent.stdout) - bus["n_frames"]
    return {**found, "seconds": seconds, "frames": bus["n_frames"], "lost": lost, "payload_kg": latest["payload_kg"]}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=75.0)
    parser.add_argument("--json", action="store_true", help="print the figures for machines")
    parser.add_argument("--serve", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--send", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.serve:
        serve(options.serve)
    elif options.send:
        send(options.send, options.seconds)
    else:
        print(json.dumps(measure(options.seconds), indent=None if options.json else 1))


if __name__ == "__main__":
    main()
