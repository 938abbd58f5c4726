"""From the bus to who must know: an alarm in journal, API and webhook of the real service, and back by who saw it."""

import json
import subprocess
import sys
import threading
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.bus_drive import START_NS, white_noise
from support.calibrated import calibration_file
from support.patience import wait_until
from support.ports import first_answer, free_port
from support.process import TESTS
from support.receiver import SECRET_TEXT, Receiver, cut, status

from gateway.bus.logs import write_candump

CONFIG = """
signals = "springscale:reference"
calibration = "vehicle.json"
estimator = "ratio_index"
vehicle.id = "van-17"
bus.interface = "virtual"
batch.window_s = 20.0
web.port = {web}
store.directory = "state"
alarms.axle_share_max_pct = 50.0
[webhook]
url = "http://127.0.0.1:{receiver}/hook"
secret_file = "secret"
back_off_max_s = 0.1
"""


class Service:
    """On its in-process bus, which carries a drive with 51 % on the front axle."""

    def __init__(self, folder: Path, receiver: int) -> None:
        (folder / "vehicle.json").write_text(calibration_file(payload_kg=12.0, front_share_pct=51.0).to_json())
        (folder / "secret").write_text(SECRET_TEXT)
        config, log = folder / "springscale.toml", folder / "drive.log"
        self.url = f"http://127.0.0.1:{(port := free_port())}"
        config.write_text(CONFIG.format(web=port, receiver=receiver))
        write_candump(white_noise(70.0, START_NS, seed=5), "can0", log)
        self.lines: list[str] = []
        self.process = subprocess.Popen(
            [sys.executable, "-m", "support.replayed_service", str(config), str(log)],
            stdin=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=TESTS,
        )
        self.reading = threading.Thread(target=lambda: self.lines.extend(self.process.stderr or ()))
        self.reading.start()

    def get(self, path: str) -> dict[str, Any]:
        return first_answer(self.url + path).json()

    def stop(self) -> int:
        self.process.stdin.close()
        self.reading.join()
        return self.process.wait()


@pytest.fixture
def receiver() -> Iterator[Receiver]:
    with Receiver([status(500), cut]) as running:
        yield running


@pytest.fixture
def service(tmp_path: Path, receiver: Receiver) -> Iterator[Service]:
    running = Service(tmp_path, receiver.port)
    yield running
    with running.process as process:
        process.kill()
        running.reading.join()


def test_an_alarm_from_the_bus_to_who_must_know_and_back(service: Service, receiver: Receiver) -> None:
    def told() -> dict[str, Any]:
        return receiver.taken[-1][1] if receiver.taken else {}

    assert wait_until(lambda: told().get("type") == "alarm" and told()["data"]["state"] == "final")
    alarm = told()["data"]
    assert (alarm["vehicle_id"], alarm["kind"], alarm["where"]) == ("van-17", "imbalance", "front_rear")
    assert [step["state"] for step in alarm["steps"]] == ["early", "final"]
    assert alarm["sentence"].startswith("One axle bears 51 +- ")
    assert service.get("/api/v1/alarms")["active"] == [alarm]
    request = urllib.request.Request(
        f"{service.url}/api/v1/alarms/{alarm['id']}/acknowledgement",
        b'{"note": "moved back"}',
        {"Content-Type": "application/json"},
        method="POST",
    )
    with urllib.request.urlopen(request, timeout=30.0) as answer:
        seen = json.load(answer)
    assert wait_until(lambda: told()["data"] == seen)
    assert (seen["acknowledged"]["by"], seen["acknowledged"]["note"]) == ("local", "moved back")
    now = service.get("/api/v1/status")
    assert now["alarms"]["standing"] == {"imbalance.front_rear": "final"}
    assert (now["webhook"]["n_failed"], now["webhook"]["n_dead"]) == (2, 0)
    assert service.stop() == 0
    assert receiver.wrong == []
    said = [json.loads(line[3:])["event"] for line in service.lines]
    assert [one for one in said if one.startswith("alarm")] == [
        "alarm raised, provisional", "alarm confirmed", "alarm acknowledged",
    ]  # fmt: skip
    assert "webhook not taken" in said
