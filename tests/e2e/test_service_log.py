"""What the journal of a running service shows: read from the standard error of a process of its own."""

import json
import subprocess
import sys
import threading
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from support.bus_drive import START_NS, white_noise
from support.calibrated import calibration_file
from support.patience import wait_until
from support.ports import free_port
from support.process import TESTS

from gateway.bus.logs import write_candump

CONFIG = """
signals = "springscale:reference"
calibration = "vehicle.json"
estimator = "ratio_index"
[vehicle]
id = "van-17"
[bus]
interface = "virtual"
silence_s = 0.5
[batch]
window_s = 20.0
provisional_every_s = 10.0
[web]
port = 0
stale_after_s = 1.0
[store]
directory = "state"
[uplink]
host = "127.0.0.1"
port = {port}
tls = false
[log]
level = "{level}"
"""


class Journal:
    """The service on its in-process bus; every line it writes, read as it comes."""

    def __init__(self, folder: Path, level: str) -> None:
        (folder / "vehicle.json").write_text(calibration_file(payload_kg=12.0, front_share_pct=51.0).to_json())
        config, log = folder / "springscale.toml", folder / "drive.log"
        config.write_text(CONFIG.format(port=free_port(), level=level))
        write_candump(white_noise(70.0, START_NS, seed=5), "can0", log)
        self.lines: list[str] = []
        self.process = subprocess.Popen(
            [sys.executable, "-m", "support.replayed_service", str(config), str(log)],
            stdin=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=TESTS,
        )
        self.reading = threading.Thread(target=self._read)
        self.reading.start()

    def _read(self) -> None:
        for line in self.process.stderr:
            self.lines.append(line)

    def entries(self) -> list[dict[str, Any]]:
        """Every line without the priority before it."""
        return [json.loads(line[3:]) for line in list(self.lines)]

    def events(self) -> list[str]:
        return [entry["event"] for entry in self.entries()]

    def stop(self) -> int:
        """Tell it to end -> its exit code."""
        self.process.stdin.write("\n")
        self.process.stdin.close()
        self.reading.join()
        return self.process.wait()


@pytest.fixture
def journal(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Journal]:
    """At the level the test names."""
    running = Journal(tmp_path, getattr(request, "param", "info"))
    yield running
    with running.process as process:  # closes its pipes
        process.kill()
        running.reading.join()


def test_every_change_of_state_is_a_line(journal: Journal) -> None:
    wanted = {"bus silent", "estimate stale", "uplink not reached"}
    assert wait_until(lambda: wanted <= set(journal.events()) or journal.process.poll() is not None)
    assert journal.stop() == 0, journal.lines
    entries, events = journal.entries(), journal.events()
    assert all(line[:3] in {"<6>", "<4>"} for line in journal.lines)
    assert events[0] == "started"
    assert events[-1] == "stopped"
    assert events.index("ready") < events.index("bus receiving") < events.index("estimate")
    assert events.count("estimate") == 3  # of 20 s each; what is left of the drive is too short
    assert {entry["payload_kg"] for entry in entries if entry["event"] == "estimate"} == {12.0}
    assert "reasons of rejection changed" not in events
    assert events.count("uplink not reached") == 1  # tried again and again, told once
    states = [entry["state"] for entry in entries if entry["event"] == "state"]
    assert all(one != other for one, other in pairwise(states))
    assert not {"batch rejected", "provisional estimate"} & set(events)


@pytest.mark.parametrize("journal", ["warning"], indirect=True)
def test_one_level_holds_for_every_room(journal: Journal) -> None:
    assert wait_until(lambda: "uplink not reached" in journal.events() or journal.process.poll() is not None)
    assert journal.stop() == 0, journal.lines
    assert {entry["level"] for entry in journal.entries()} == {"warning"}
