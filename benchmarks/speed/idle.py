"""The cost of the service while the vehicle is parked: processor time and disk writes of an hour, bus asleep.

A thousand batches are in the store; all are delivered to a broker, and as events to a webhook that nobody serves.
It needs Debian's mosquitto.
"""

import json
import os
import shutil
import subprocess
import sys
import time
import urllib.request
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np

from benchmarks.speed.meter import ENVIRONMENT, cpu_of_s, free_port
from gateway.estimates.as_json import estimate_to_json
from gateway.estimates.batch_estimate import Estimate, Quantity
from gateway.records import Spectra
from gateway.store import Store

MOSQUITTO: Final = shutil.which("mosquitto", path="/usr/sbin:/usr/local/sbin:/usr/bin:/usr/local/bin")
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
    io = dict(line.split(": ") for line in Path(f"/proc/{process}/io").read_text().splitlines())
    return cpu_of_s(process), int(io["write_bytes"])


def measure(seconds: float) -> dict[str, Any]:
    """Start broker and service, let them settle, and measure the service's cost over this time."""
    if MOSQUITTO is None:
        return {"skipped": "mosquitto is not installed"}
    quiet = subprocess.DEVNULL
    with TemporaryDirectory(dir=Path.cwd()) as folder:
        here, port = Path(folder), free_port()
        (here / "secret").write_text("whsec_" + "A" * 40 + "\n")
        fill(here / "state")
        service = [sys.executable, "-m", "gateway", "run", "--config", str(here / "springscale.toml")]
        broker_port = free_port()
        (here / "mosquitto.conf").write_text(f"listener {broker_port} 127.0.0.1\nallow_anonymous true\nuser root\n")
        broker = [MOSQUITTO, "-c", str(here / "mosquitto.conf")]
        with subprocess.Popen(broker, stdout=quiet, stderr=quiet) as brokering:
            (here / "springscale.toml").write_text(SETTINGS.format(port=port, broker=broker_port))
            running = subprocess.Popen(service, cwd=here, env=os.environ | ENVIRONMENT, stdout=quiet, stderr=quiet)
            try:
                time.sleep(SETTLE_S)
                with urllib.request.urlopen(f"http://127.0.0.1:{port}/api/v1/status") as answer:
                    delivered = json.load(answer)["uplink"]["n_delivered"]
                before_s, before_bytes = cost_of(running.pid)
                time.sleep(seconds)
                after_s, after_bytes = cost_of(running.pid)
            finally:
                running.terminate()
                running.wait(30.0)
                brokering.terminate()
    per_hour = 3600.0 / seconds
    return {
        "n_delivered": delivered,
        "processor_s_per_hour": round((after_s - before_s) * per_hour, 1),
        "disk_kb_per_hour": round((after_bytes - before_bytes) * per_hour / 1e3, 1),
    }
