"""A simulated week in the real service at high speed: memory, file handles, threads and database do not grow.

`make soak` runs it and prints one line per simulated day; it exits with 1 if something grew. The service weighs by a
calibration file; each day has hours of driving and a night of silence. A client polls the latest estimate, and every
frame is recorded. The bus is replaced by a receiver that repeats the frames of one simulated drive with later stamps;
everything behind it is the service as in a vehicle.
"""

import json
import shutil
import sys
import threading
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final, cast

from benchmarks.speed.endless_drive import EndlessDrive
from benchmarks.speed.meter import CALIBRATION, print_and_write
from gateway.config import load_settings
from gateway.service.gateway import Gateway
from gateway.service.lifecycle import live
from gateway.workbench.simulated_drives import demo_drive, frames_of

SETTINGS: Final = """\
signals = "springscale:reference"
calibration = "vehicle.json"
[bus]
interface = "virtual"
[web]
port = 0
[store]
directory = "state"
max_size_mb = 4.0
[record]
enabled = true
max_size_mb = 16.0
[log]
level = "error"
"""
# What may grow from the end of the first day to the end of the last: caches fill, then nothing more; and one connection
# more or less is open at any moment.
GROWTH_ALLOWED: Final = {"memory_mb": 15.0, "handles": 2, "threads": 0}
# The limits set above; of the database also a batch of rows, and the write-ahead log, which SQLite keeps below 4.2 MB.
MOST_ALLOWED: Final = {"database_mb": 4.5 + 4.2, "record_mb": 16.0}


def footprint(state: Path) -> dict[str, float]:
    """The current resources of the process."""
    status = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return {
        "memory_mb": round(int(status["VmRSS"].split()[0]) / 1024, 1),
        "handles": sum(1 for _ in Path("/proc/self/fd").iterdir()),
        "threads": int(status["Threads"]),
        "database_mb": round(sum(file.stat().st_size for file in state.glob("springscale.db*")) / 1e6, 2),
        "record_mb": round(sum(file.stat().st_size for file in (state / "record").iterdir()) / 1e6, 2),
    }


class Service:
    """The running gateway, which restarts when it has learnt another calibration."""

    def __init__(self) -> None:
        self.gateway: Gateway | None = None
        self.n_starts = 0
        self.stop: Callable[[], object] = lambda: None

    def started(self, gateway: Gateway) -> None:
        """Called once it runs."""
        self.gateway, self.n_starts = gateway, self.n_starts + 1
        self.stop = gateway.request_stop

    @property
    def now(self) -> Gateway:
        """The running gateway."""
        assert self.gateway is not None
        return self.gateway

    def ask(self, path: str, said: object = None) -> bytes:
        """The service's answer to a GET, or to a POST of ``said``."""
        content = None if said is None else json.dumps(said).encode()
        request = urllib.request.Request(self.now.url + path, content, {"Content-Type": "application/json"})
        with urllib.request.urlopen(request, timeout=30.0) as answer:
            told: bytes = answer.read()
        return told


def watch(service: Service, week: EndlessDrive, state: Path, days: list[dict[str, float]]) -> None:
    """Ask for the latest estimate all the time; note the footprint at every day's end."""
    is_over = False
    while not is_over:
        is_over = week.is_over and service.now.has_caught_up  # once more after it: the last day ends with the week
        service.ask("/api/v1/estimates/latest")
        if week.days_done > len(days):
            counts = service.now.status().batches
            done = {"day": week.days_done, "estimates": counts.n_estimates, "rejected": counts.n_rejected}
            days.append(done | footprint(state))
            print(json.dumps(days[-1]), flush=True)
        time.sleep(0.1)


def soak(hours_a_day: float, n_days: int) -> list[dict[str, float]]:
    """The footprint at the end of each day."""
    week = EndlessDrive(frames_of(demo_drive()), hours_a_day, n_days)
    service, faults = Service(), list[BaseException]()
    days: list[dict[str, float]] = []
    with TemporaryDirectory() as folder:
        config = Path(folder) / "springscale.toml"
        config.write_text(SETTINGS)
        shutil.copy(CALIBRATION, Path(folder) / "vehicle.json")
        settings = load_settings(config)

        def on_started(gateway: Gateway) -> None:
            service.started(gateway)
            if service.n_starts == 1:
                threading.Thread(target=meet).start()

        def meet() -> None:
            try:
                watch(service, week, settings.store.directory, days)
            except BaseException as fault:  # noqa: BLE001 - raised again where the service has ended
                faults.append(fault)
            service.stop()

        while live(settings, on_started=on_started, open_receiver=lambda: cast(Any, week)):
            pass
    if faults:
        raise faults[0]
    return days


def what_grew(days: list[dict[str, float]]) -> list[str]:
    """A sentence about each resource that grew."""
    first, last = days[0], days[-1]
    allowed = {what: first[what] + growth for what, growth in GROWTH_ALLOWED.items()} | MOST_ALLOWED
    return [f"{what} is {last[what]}, at most {most} is allowed" for what, most in allowed.items() if last[what] > most]


def measure(days: int, hours: float) -> dict[str, Any]:
    """The days with this many hours of driving, and their bounds; each day is printed when it is over."""
    bounds = {"growth_allowed": GROWTH_ALLOWED, "most_allowed": MOST_ALLOWED}
    return {"hours_a_day": hours, "days": soak(hours, days), **bounds}


def main() -> None:
    """Print the days; exit with 1 if something grew."""
    found = print_and_write(__doc__, measure, days=7, hours=4.0)
    if grown := what_grew(found["days"]):
        sys.exit("\n".join(grown))


if __name__ == "__main__":
    main()
