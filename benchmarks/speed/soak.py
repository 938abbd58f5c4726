"""A simulated week in the real service at high speed: memory, file handles, threads and database stay flat.

`make soak` runs it and prints one line a simulated day; it ends with 1 where something grew. Each day has hours of
driving and a night of silence; a client asks for the latest estimate all the while. The bus is replaced by a receiver
that hands out the frames of one simulated drive again and again, stamped later and later; everything behind it is the
service as it runs in a vehicle.
"""

import argparse
import asyncio
import json
import shutil
import sys
import threading
import time
import urllib.request
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from benchmarks.speed.endless_drive import EndlessDrive
from gateway.config import load_settings
from gateway.service.gateway import Gateway
from gateway.setup import setup_of
from gateway.workbench import demo_drive, frames_of

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
[log]
level = "error"
"""
# What may grow from the end of the first day to the end of the last: caches fill, then nothing more; and one connection
# more or less is open at any moment.
GROWTH_ALLOWED: Final = {"memory_mb": 15.0, "handles": 2, "threads": 0}
# The limit set above and a batch of rows; and the write-ahead log, which SQLite keeps below 4.2 MB.
MOST_ALLOWED: Final = {"database_mb": 4.5 + 4.2}


def footprint(state: Path) -> dict[str, float]:
    """What the process holds now."""
    status = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return {
        "memory_mb": round(int(status["VmRSS"].split()[0]) / 1024, 1),
        "handles": sum(1 for _ in Path("/proc/self/fd").iterdir()),
        "threads": int(status["Threads"]),
        "database_mb": round(sum(file.stat().st_size for file in state.glob("springscale.db*")) / 1e6, 2),
    }


def watch(gateway: Gateway, receiver: EndlessDrive, state: Path, days: list[dict[str, float]]) -> None:
    """Ask for the latest estimate all the time; note the footprint at every day's end."""
    while not (receiver.is_over and gateway.has_caught_up):
        urllib.request.urlopen(f"{gateway.url}/api/v1/estimates/latest", timeout=30.0).read()
        if receiver.days_done > len(days):
            counts = gateway.status().batches
            done = {"day": receiver.days_done, "estimates": counts.n_estimates, "rejected": counts.n_rejected}
            days.append(done | footprint(state))
            print(json.dumps(days[-1]), flush=True)
        time.sleep(0.1)


def soak(hours_a_day: float, n_days: int) -> list[dict[str, float]]:
    """The footprint at the end of each day."""
    drive = frames_of(demo_drive())
    receiver = EndlessDrive(drive, hours_a_day, n_days)
    days: list[dict[str, float]] = []
    with TemporaryDirectory() as folder:
        config = Path(folder) / "springscale.toml"
        config.write_text(SETTINGS)
        shutil.copy(Path(__file__).parents[2] / "gateway/demo/paper_van.json", Path(folder) / "vehicle.json")
        settings = load_settings(config)

        def on_started(gateway: Gateway) -> None:
            loop = asyncio.get_running_loop()

            def watch_and_stop() -> None:
                try:
                    watch(gateway, receiver, settings.store.directory, days)
                finally:
                    loop.call_soon_threadsafe(gateway.request_stop)

            threading.Thread(target=watch_and_stop).start()

        Gateway(settings, setup_of(settings), on_started=on_started, open_receiver=lambda: receiver).run()
    return days


def what_grew(days: list[dict[str, float]]) -> list[str]:
    """Sentences about everything that is not flat."""
    first, last = days[0], days[-1]
    allowed = {what: first[what] + growth for what, growth in GROWTH_ALLOWED.items()} | MOST_ALLOWED
    return [f"{what} is {last[what]}, at most {most} is allowed" for what, most in allowed.items() if last[what] > most]


def main() -> None:
    """Print the days; exit with 1 where something grew."""
    arguments = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    arguments.add_argument("--days", type=int, default=7)
    arguments.add_argument("--hours", type=float, default=4.0, help="of driving a day")
    arguments.add_argument("--output", type=Path, help="JSON file for the figures")
    asked = arguments.parse_args()
    begun_s = time.monotonic()
    days = soak(asked.hours, asked.days)
    took_s = time.monotonic() - begun_s
    if asked.output:
        asked.output.parent.mkdir(exist_ok=True)
        bounds = {"growth_allowed": GROWTH_ALLOWED, "most_allowed": MOST_ALLOWED}
        asked.output.write_text(json.dumps({"hours_a_day": asked.hours, "days": days, **bounds}, indent=1) + "\n")
    print(f"{asked.days} days of {asked.hours:g} h driving in {took_s:.0f} s")
    grown = what_grew(days)
    if grown:
        sys.exit("\n".join(grown))


if __name__ == "__main__":
    main()
