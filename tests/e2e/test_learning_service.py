"""A service learns its vehicle from drives on its bus and from delivery notes: the same file as from the logs."""

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import httpx
import pytest
from support.configured import service_config
from support.half_car_road import VAN
from support.known_load_logs import START_NS, van_toml, write_known_loads
from support.patience import wait_until
from support.ports import first_answer, free_port
from support.process import running_service
from support.running_service import Running, estimated, serve

from gateway.calibration.file import load_calibration
from gateway.records import iso_utc
from gateway.service.learner import learner

WINDOW_S = 100.0
BATCH: dict[str, Any] = {"batch__window_s": WINDOW_S, "batch__provisional_every_s": 0.0, "batch__silence_s": 2.0}
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
    return service_config(tmp_path, vehicle__id="van-17", **BATCH)


@pytest.fixture(autouse=True)
def _impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Learning that was ended from outside begins anew at once."""
    monkeypatch.setattr(learner, "FIRST_RETRY_S", 0.2)


def logs(folder: Path, loads: Any = LOADS) -> list[Path]:
    write_known_loads(folder, loads, DRIVEN_S)
    return [folder / f"{number:02d}.log" for number in range(1, len(loads) + 1)]


def has_settled(part: learner.Learner) -> bool:
    """Whether everything that teaches was learnt from, or cannot be."""
    with part._book.lock:
        job, last = part._job(), part._book.record.last
        is_done = job is None or (last is not None and last.key == job.key)
        return is_done and not part.is_busy and part._waiting.unfinished_tasks == 0


def settle(running: Running) -> dict[str, Any]:
    """Until everything was learnt, and the service weighs by it."""

    def is_settled() -> bool:
        try:
            part = running.gateway.learner
            return has_settled(part) and not part.learnt.is_due and running.http(LEARNING)["takes_effect"] is None
        except httpx.HTTPError:  # between two starts nobody answers
            return False

    assert any(wait_until(is_settled) for _ in range(5)), running.http(LEARNING)  # it learns at the lowest priority
    return running.http(LEARNING)


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
    file = learnt_file(tmp_path, version["id"])
    assert learnt_at_a_desk(drives, file, said["statements"]) == file.read_bytes()
    again = [json.loads(line) for line in estimated(config, drives[1])]
    assert {one["calibration_id"] for one in again} == {version["id"]}


def learnt_at_a_desk(drives: list[Path], file: Path, statements: Any, *more: object) -> bytes:
    """What `springscale learn` makes of the logs and statements for the vehicle of this file."""
    folder = drives[0].parent
    (folder / "said.json").write_text(json.dumps(statements))
    van = van_toml(folder, load_calibration(file).vehicle)
    options = ["--vehicle", van, "--statements", folder / "said.json", "--signals", "springscale:reference"]
    options += ["--window-s", "100", "--output", folder / "desk.json", "--json", *more]
    subprocess.run([sys.executable, "-m", "gateway", "learn", *drives, *options], check=True, capture_output=True)
    return (folder / "desk.json").read_bytes()


def state_and_drive(running: Running, drives: list[Path], *more: str) -> None:
    """The first drive is said to be empty, all are driven, and the vehicle is stated."""
    running.told("state", "empty", "--from", begun(1), *more)
    for log in drives:
        running.play(log)
    running.http("/api/v1/vehicle", ANSWERS, "PUT")


def test_with_a_sister_handed_in_it_learns_the_calibration_that_the_logs_give(config: Path, tmp_path: Path) -> None:
    """Its own first calibration serves as that of a vehicle of the same model. Taken back, it leaves no trace."""
    drives = logs(tmp_path, LOADS[:2])
    said: dict[str, Any] = {}

    def meet(running: Running) -> None:
        state_and_drive(running, drives)
        said["alone"] = settle(running)["versions"][0]["id"]
        sister = learnt_file(tmp_path, said["alone"]).read_bytes()
        (tmp_path / "sister.json").write_bytes(sister)
        httpx.put(f"{running.gateway.url}/api/v1/vehicle/sister", content=sister).raise_for_status()
        said["like"] = settle(running)["versions"][0]["id"]
        said["statements"] = running.http(STATEMENTS)
        running.http("/api/v1/vehicle/sister", method="DELETE")
        said["taken back"] = settle(running)["versions"][0]["id"]

    serve(config, meet)

    file = learnt_file(tmp_path, said["like"])
    like = ("--like", tmp_path / "sister.json")
    assert learnt_at_a_desk(drives, file, said["statements"], *like) == file.read_bytes()
    assert said["like"] != said["alone"]
    assert said["taken back"] == said["alone"]


def processes_of(pid: int) -> list[int]:
    """A process and its children."""
    children = Path(f"/proc/{pid}/task").glob("*/children")
    return [pid, *(int(child) for listed in children for child in listed.read_text().split())]


def learnt_by(config: Path, folder: Path) -> tuple[dict[str, Any], bytes]:
    """What a service in this folder has learnt at last, and the file."""
    said: dict[str, Any] = {}
    serve(config, lambda running: said.update(settle(running), listed=running.http(STATEMENTS)["items"]))
    return said, learnt_file(folder, said["versions"][0]["id"]).read_bytes()


def test_after_a_power_cut_during_learning_it_learns_the_same_once(config: Path, tmp_path: Path) -> None:
    """Service and process are killed together; a copy of the folder that nobody cut learns the same file."""
    drives = logs(tmp_path, LOADS[:2])

    def drive(running: Running) -> None:
        running.told("state", "empty", "--from", begun(1), "--ref", "E")
        for log in drives:
            running.play(log)

    serve(config, drive)
    for name in ("cut", "whole"):
        shutil.copytree(tmp_path / "state", tmp_path / name / "state")
    port = free_port()
    url = f"http://127.0.0.1:{port}"
    cut = service_config(tmp_path / "cut", vehicle__id="van-17", web__port=port, **BATCH)
    with running_service(cut) as service:
        assert first_answer(f"{url}{LEARNING}").json()["lacks"] == ["vehicle"]
        httpx.put(f"{url}/api/v1/vehicle", json=ANSWERS).raise_for_status()
        note = {"from": begun(2), "source": "delivery_note", "ref": "N", "load": {"payload_kg": 300.0}}
        httpx.post(f"{url}{STATEMENTS}", json=note).raise_for_status()
        assert wait_until(lambda: httpx.get(f"{url}{LEARNING}").json()["is_learning"])
        for pid in reversed(processes_of(service.pid)):
            os.kill(pid, signal.SIGKILL)
    (tmp_path / "whole/state/learning.json").write_bytes((tmp_path / "cut/state/learning.json").read_bytes())
    whole = service_config(tmp_path / "whole", vehicle__id="van-17", **BATCH)

    after, file = learnt_by(cut, tmp_path / "cut")
    _, expected = learnt_by(whole, tmp_path / "whole")

    assert {one["ref"]: one["state"] for one in after["listed"]} == {"E": "used", "N": "used"}
    assert len(after["listed"]) == 2
    assert [(one["n_drives"], one["n_statements"]) for one in after["versions"]] == [(2, 2)]
    assert file == expected


def test_a_kill_during_learning_loses_nothing(config: Path, tmp_path: Path) -> None:
    drives = logs(tmp_path, LOADS[:2])
    said: dict[str, Any] = {}

    def meet(running: Running) -> None:
        state_and_drive(running, drives)
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
