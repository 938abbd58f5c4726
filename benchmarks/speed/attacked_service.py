"""The service of soak_attack in a process of its own, without the simulator: CONFIG FRAMES HOURS DAYS.

Drives as fast as it can once a line has come on standard input, says "over" when it has worked through everything, and
serves until SIGTERM.
"""

import sys
import threading
import time
from pathlib import Path

import numpy as np

from benchmarks.speed.endless_drive import EndlessDrive
from gateway.bus.live.receiver import Burst
from gateway.config import load_settings
from gateway.log import set_up_log
from gateway.records import Frames
from gateway.service.gateway import Gateway
from gateway.setup import setup_of


class WaitingDrive(EndlessDrive):
    """An endless drive that begins on request."""

    begin = threading.Event()

    def receive(self, timeout_s: float) -> Burst:
        """As EndlessDrive, once it has begun."""
        self.begin.wait()
        return super().receive(timeout_s)


def main(config: Path, frames: Path, hours_a_day: float, n_days: int) -> None:
    """Serve."""
    settings = load_settings(config)
    set_up_log(settings.log.level, under_journald=True)
    with np.load(frames) as kept:
        drive = WaitingDrive(Frames(**kept), hours_a_day, n_days)

    def tell(gateway: Gateway) -> None:
        print(gateway.url, flush=True)
        sys.stdin.readline()
        drive.begin.set()
        while not (drive.is_over and gateway.has_caught_up):
            time.sleep(0.05)
        print("over", flush=True)

    def on_started(gateway: Gateway) -> None:
        threading.Thread(target=tell, args=(gateway,), daemon=True).start()

    Gateway(settings, setup_of(settings), on_started=on_started, open_receiver=lambda: drive).run()


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), float(sys.argv[3]), int(sys.argv[4]))
