"""A service learns its vehicle from drives on its bus and from delivery notes: the same file as from the logs."""

import json
import os
import signal
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
from support.configured import service_config
from support.half_car_road import VAN
from support.known_load_logs import START_NS, write_known_loads
from support.patience import wait_until
from support.running_service import Running, serve

from gateway.calibration.file.calibration_file import load_calibration
from gateway.core.vehicle import Vehicle
from gateway.records import iso_utc
from gateway.service.learner import learner

WINDOW_S = 100.0
DRIVEN_S = 210.0
LOADS = ((0.0, None), (300.0, 1.4), (150.0, 1.8))
ANSWERS: dict[str, Any] = {
    "kerb_front_axle_kg": 725.0,
    "kerb_rear_axle_kg": 683.0,
    "wheelbase_m": VAN.wheelbase_m,
    "sensor_position_m": VAN.sensor_position_m,
    "empty_mass_kg": VAN.empty_mass_kg,
    "empty_front_share_pct": VAN.empty_front_share_pct,
    "empty_front_share_std_pct": VAN.empty_front_share_std_pct,
    "gross_limit_kg": 1900.0,
}
LEARNING = "/api/v1/learning"
STATEMENTS = "/api/v1/statements"


def begun(number: int) -> str:
    """When the drive of this number begins."""
    return f"{iso_utc(START_NS + number * 10**13)[:19]}Z"


@pytest.fixture
def config(tmp_path: Path) -> Path:
    """A service without a calibration on a bus of the test's own."""
    batch = {"batch__window_s": WINDOW_S, "batch__provisional_every_s": 0.0, "batch__silence_s": 2.0}
    return service_config(tmp_path, vehicle__id="van-17", **batch)


@pytest.fixture(autouse=True)
def _impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Learning that was ended from outside begins anew at once."""
    monkeypatch.setattr(learner, "FIRST_RETRY_S", 0.2)


def logs(folder: Path, loads: Any = LOADS) -> list[Path]:
    write_known_loads(folder, loads, DRIVEN_S)
    return [folder / f"{number:02d}.log" for number in range(1, len(loads) + 1)]


def settle(running: Running) -> dict[str, Any]:
    """Until everything was learnt, and the service weighs by it."""

    def is_settled() -> bool:
        try:
            part = running.gateway.learner
            return part.has_settled and not part.is_due and running.http(LEARNING)["takes_effect"] is None
        except Exception:  # noqa: BLE001 - between two starts nobody answers
            return False

    assert any(wait_until(is_settled) for _ in range(5)), running.http(LEARNING)  # it learns at the lowest priority
    return running.http(LEARNING)


def van_toml(folder: Path, vehicle: Vehicle) -> Path:
    """The vehicle that the service stated, as a file of `springscale learn`."""
    told = {name: value for name, value in asdict(vehicle).items() if value is not None}
    lines = [
        f"{name} = {json.dumps(list(value) if isinstance(value, tuple) else value)}" for name, value in told.items()
    ]
    path = folder / "van.toml"
    path.write_text("\n".join(["[vehicle]", *lines, ""]))
    return path


def learnt_file(folder: Path, calibration_id: str) -> Path:
    return folder / "state" / f"learnt-{calibration_id.removeprefix('sha256:')[:16]}.json"


def test_from_no_configuration_to_the_calibration_that_the_logs_give(config: Path, tmp_path: Path) -> None:
    drives = logs(tmp_path)
    notes = tmp_path / "notes.csv"
    notes.write_text(
        f"from;source;payload_kg;plus_minus_kg;ref\n{begun(1)};empty;;;E\n{begun(2)};delivery_note;300;20;N\n"
    )
    said: dict[str, Any] = {}

    def meet(running: Running) -> None:
        assert running.http(LEARNING)["lacks"] == ["vehicle", "drives"]
        dry = running.told("state", "import", str(notes), "--dry-run")
        assert dry["text"] == "2 rows: 0 match a drive, 2 wait"
        running.told("state", "import", str(notes))
        for log in drives:
            running.play(log)
        running.http("/api/v1/vehicle", ANSWERS, "PUT")
        said["learning"] = settle(running)
        said["status"] = running.http("/api/v1/status")
        said["statements"] = running.http(STATEMENTS)
        said["listed"] = running.ask("state", "list").stdout

    serve(config, meet)

    learning, version = said["learning"], said["learning"]["versions"][0]
    assert version["state"] == "in_use"
    assert said["status"]["calibration_id"] == version["id"]
    assert learning["plus_minus_kg"] > 0.0
    states = {one["ref"]: one["state"] for one in said["statements"]["items"]}
    assert states == {"E": "used", "N": "used"}
    assert "found without it" in said["listed"]
    (tmp_path / "said.json").write_text(json.dumps(said["statements"]))
    file = learnt_file(tmp_path, version["id"])
    van = van_toml(tmp_path, load_calibration(file).vehicle)
    options = ["--vehicle", van, "--statements", tmp_path / "said.json", "--signals", "springscale:reference"]
    options += ["--window-s", "100", "--output", tmp_path / "desk.json", "--json"]
    subprocess.run([sys.executable, "-m", "gateway", "learn", *drives, *options], check=True, capture_output=True)
    assert (tmp_path / "desk.json").read_bytes() == file.read_bytes()


def test_a_withdrawn_statement_leaves_no_trace(config: Path, tmp_path: Path) -> None:
    drives = logs(tmp_path, LOADS[:2])
    said: dict[str, Any] = {}

    def meet(running: Running) -> None:
        running.told("state", "empty", "--from", begun(1), "--ref", "E")
        for log in drives:
            running.play(log)
        running.http("/api/v1/vehicle", ANSWERS, "PUT")
        said["before"] = settle(running)["versions"][0]["id"]
        running.told("state", "note", "300", "--from", begun(2), "--ref", "N")
        said["with"] = settle(running)["versions"][0]["id"]
        running.told("state", "withdraw", "N")
        said["after"] = settle(running)["versions"][0]["id"]

    serve(config, meet)

    assert said["with"] != said["before"]
    assert said["after"] == said["before"]


def test_a_kill_during_learning_loses_nothing(config: Path, tmp_path: Path) -> None:
    drives = logs(tmp_path, LOADS[:2])
    said: dict[str, Any] = {}

    def meet(running: Running) -> None:
        running.told("state", "empty", "--from", begun(1))
        for log in drives:
            running.play(log)
        running.http("/api/v1/vehicle", ANSWERS, "PUT")
        worker = running.gateway.learner._worker
        assert wait_until(lambda: worker.pid is not None)
        pid = worker.pid
        assert pid is not None
        os.kill(pid, signal.SIGKILL)
        assert wait_until(lambda: worker.pid != pid)
        said["learning"] = settle(running)

    serve(config, meet)

    assert said["learning"]["versions"][0]["state"] == "in_use"
    assert said["learning"]["statements"]["used"] == 1
