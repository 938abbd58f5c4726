"""The cost of the service while the vehicle is parked: processor time and disk writes of an hour, bus asleep.

A thousand batches are in the store; all are delivered to a broker, and as events to a webhook that nobody serves.
``python -m benchmarks.speed.idle`` prints one JSON object; it needs Debian's mosquitto. Another version is measured
with this file by ``PYTHONPATH=ITS_FOLDER python benchmarks/speed/idle.py``.
"""

import argparse
import json
import os
import shutil
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import numpy as np

from gateway.estimate import Estimate, Quantity
from gateway.estimate_json import estimate_to_json
from gateway.records import Spectra
from gateway.store import Store

N_BATCHES: Final = 1000  # chosen: a month of driving
WINDOW_NS: Final = 300 * 10**9  # BatchSettings.window_s
SETTLE_S: Final = 40.0  # chosen: everything is delivered and acknowledged within it
SETTINGS: Final = """
signals = "springscale:reference"
[vehicle]
id = "van-17"
[bus]
interface = "virtual"
channel = "idle-{port}"
[web]
port = {port}
[store]
directory = "state"
[uplink]
host = "127.0.0.1"
port = {broker}
tls = false
[webhook]
url = "http://127.0.0.1:9/hook"
secret_file = "secret"
"""


def fill(directory: Path) -> None:
    """Write batches with spectra, in the time of the history."""
    numbers = np.linspace(1.0, 15.0, 75)
    spectra = Spectra(*[numbers] * 5)
    store = Store.open(directory)
    for n in range(N_BATCHES):
        end_ns = 1_790_000_000 * 10**9 + n * WINDOW_NS
        made = Estimate(
            end_ns - WINDOW_NS, end_ns, "cross_spectrum", payload=Quantity.normal(300.0, 6.0), spectra=spectra
        )
        store.write_estimate(estimate_to_json(made))
        if n % 100 == 99:
            store.flush(60.0)
    store.close()


def cost_of(process: int) -> tuple[float, int]:
    """Seconds of processor time and bytes written to disk so far."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    seconds = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    io = dict(line.split(": ") for line in Path(f"/proc/{process}/io").read_text().splitlines())
    return seconds, int(io["write_bytes"])


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port: int = listener.getsockname()[1]
        return port


def measured(seconds: float) -> dict[str, float]:
    """Start broker and service, let them settle, and measure the service's cost over this time."""
    with TemporaryDirectory(dir=Path.cwd()) as folder:
        here, port, broker = Path(folder), free_port(), free_port()
        (here / "mosquitto.conf").write_text(f"listener {broker} 127.0.0.1\nallow_anonymous true\n")
        (here / "springscale.toml").write_text(SETTINGS.format(port=port, broker=broker))
        (here / "secret").write_text("whsec_" + "A" * 40 + "\n")
        fill(here / "state")
        service = [sys.executable, "-m", "gateway", "run", "--config", str(here / "springscale.toml")]
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        with (
            subprocess.Popen(["mosquitto", "-c", str(here / "mosquitto.conf")], **quiet) as mosquitto,  # type: ignore[call-overload]
            subprocess.Popen(service, cwd=here, **quiet) as running,  # type: ignore[call-overload]
        ):
            try:
                time.sleep(SETTLE_S)
                with urllib.request.urlopen(f"http://127.0.0.1:{port}/api/v1/status") as answer:
                    delivered = json.load(answer)["uplink"]["n_delivered"]
                before_s, before_bytes = cost_of(running.pid)
                time.sleep(seconds)
                after_s, after_bytes = cost_of(running.pid)
            finally:
                running.terminate()
                mosquitto.terminate()
    per_hour = 3600.0 / seconds
    return {
        "n_delivered": delivered,
        "processor_s_per_hour": round((after_s - before_s) * per_hour, 1),
        "disk_kb_per_hour": round((after_bytes - before_bytes) * per_hour / 1e3, 1),
    }


def main() -> None:
    """Print the figures as JSON."""
    arguments = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    arguments.add_argument("--seconds", type=float, default=120.0, help="how long to look")
    arguments.add_argument(
        "--json", action="store_true", help="as every part of the bench has it: nothing else is printed"
    )
    seconds = arguments.parse_args().seconds
    print(json.dumps(measured(seconds) if shutil.which("mosquitto") else {"skipped": "mosquitto is not installed"}))


if __name__ == "__main__":
    main()
