"""The service as a process of its own, which ends with its test whatever happens."""

import json
import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from gateway.bus.logs import write_candump
from support.bus_drive import START_NS, white_noise
from support.calibrated import calibration_file, calibration_text
from support.configured import service_config

TESTS = Path(__file__).parents[1]


@contextmanager
def running_service(config: Path, *options: str, **environment: str) -> Iterator["subprocess.Popen[str]"]:
    """springscale run, unhurried (see support.unhurried); its output is to be read with ``communicate``."""
    process = subprocess.Popen(
        [sys.executable, "-m", "support.unhurried", "run", "--config", str(config), *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=TESTS,
        env={**os.environ, **environment},
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


class ReplayedService:
    """The service and a drive on its bus, in a process of its own; every line it writes, read as it comes.

    It weighs 12 kg with 51 % on the front axle, in windows of 20 s; ``keys`` are further settings. With ``is_later`` it
    drives when it is told to.
    """

    def __init__(self, folder: Path, *, is_later: bool = False, **keys: str | float) -> None:
        weighs = calibration_file(payload_kg=12.0, front_share_pct=51.0)
        calibration = calibration_text(weighs, unsprung_front_kg=80.0, unsprung_rear_kg=80.0)
        weighing = {"estimator": "ratio_index", "vehicle__id": "van-17", "batch__window_s": 20.0}
        config, log = service_config(folder, calibration, **weighing, **keys), folder / "drive.log"
        write_candump(white_noise(70.0, START_NS, seed=5), "can0", log)
        self.lines: list[str] = []
        self.process = subprocess.Popen(
            [sys.executable, "-m", "support.replayed_service", str(config), str(log), *["later"] * is_later],
            stdin=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=TESTS,
        )
        self._reading = threading.Thread(target=lambda: self.lines.extend(self.process.stderr))
        self._reading.start()

    def __enter__(self) -> "ReplayedService":
        return self

    def __exit__(self, *_: object) -> None:
        with self.process:  # closes its pipes
            self.process.kill()
            self._reading.join()

    def entries(self) -> list[dict[str, Any]]:
        """Every line without the priority before it."""
        return [json.loads(line[3:]) for line in list(self.lines)]

    def drive(self) -> None:
        self.process.stdin.write("drive\n")
        self.process.stdin.flush()

    def events(self) -> list[str]:
        return [entry["event"] for entry in self.entries()]

    def stop(self) -> int:
        """Tell it to end -> its exit code."""
        self.process.stdin.close()
        self._reading.join()
        return self.process.wait()
