"""A vehicle commissioned at a running service over HTTP: the same numbers as calibrated from logs at a desk."""

import json
from pathlib import Path
from typing import Any

import pytest
from support.configured import service_config
from support.half_car_road import VAN
from support.known_load_logs import write_known_loads
from support.running_service import COMMISSIONING, Running, serve, stored

from gateway.calibration.calibrate import calibrate_inspected
from gateway.calibration.campaign import load_campaign
from gateway.calibration.file.calibration_file import CalibrationFile, load_calibration
from gateway.core.settings import BatchSettings
from gateway.estimate_json import estimate_to_json
from gateway.offline.campaigns import calibrate, inspect
from gateway.offline.estimates import estimates_of_logs
from gateway.setup import load_setup

WINDOW_S = 100.0
DRIVEN_S = 250.0  # two windows, and a part of one
SETTINGS = BatchSettings(window_s=WINDOW_S)
LOADS = ((0.0, None), (300.0, 1.4))
SISTERS = ((0.0, None), (400.0, 2.6))
ANSWERS = {
    "kerb_front_axle_kg": 725.0,
    "kerb_rear_axle_kg": 683.0,
    "wheelbase_m": VAN.wheelbase_m,
    "sensor_position_m": VAN.sensor_position_m,
    "empty_mass_kg": VAN.empty_mass_kg,
    "empty_front_share_pct": VAN.empty_front_share_pct,
    "empty_front_share_std_pct": VAN.empty_front_share_std_pct,
}


@pytest.fixture
def sister(tmp_path: Path) -> CalibrationFile:
    return a_sister(tmp_path / "sister")


@pytest.fixture
def config(tmp_path: Path, sister: CalibrationFile) -> Path:
    """A service without a calibration of its own on a bus of the test's own; it knows a sister."""
    (tmp_path / "sister.json").write_text(sister.to_json())
    batch = {"batch__window_s": WINDOW_S, "batch__provisional_every_s": 0.0, "batch__silence_s": 2.0}
    return service_config(tmp_path, vehicle__id="van-17", commissioning__like="sister.json", **batch)


def a_sister(folder: Path) -> CalibrationFile:
    """Calibrated with known loads."""
    folder.mkdir()
    campaign = load_campaign(write_known_loads(folder, SISTERS, 110.0, identification_fraction=1.0))
    return calibrate(campaign, SETTINGS, estimators=("cross_spectrum",)).file


def calibrated_at_a_desk(campaign_path: Path, sister: CalibrationFile) -> CalibrationFile:
    """As `springscale calibrate --runs 1 --like` does."""
    campaign = load_campaign(campaign_path)
    inspection = inspect(campaign, SETTINGS, numbers=[1])
    return calibrate_inspected(campaign, inspection, estimators=("cross_spectrum",), like=sister).file


def test_commissioned_over_http_it_weighs_as_calibrated_at_a_desk(
    config: Path, sister: CalibrationFile, tmp_path: Path
) -> None:
    campaign = write_known_loads(tmp_path, LOADS, DRIVEN_S, identification_fraction=1.0)
    said: dict[str, Any] = {}

    def meet(running: Running) -> None:
        assert running.http(COMMISSIONING)["is_offered"]
        assert running.step("vehicle", ANSWERS)["reason"] == "not_begun"
        assert running.step("", {"note": "in the yard"})["underway"]["step"] == "vehicle"
        assert running.step("empty", {"is_empty": True})["reason"] == "wrong_step"
        other = running.step("vehicle", {**ANSWERS, "wheelbase_m": 3.5})
        assert (other["reason"], "another model" in other["detail"]) == ("not_its_sister", True)
        assert running.step("vehicle", ANSWERS)["underway"]["step"] == "empty"
        assert running.step("empty", {"is_empty": True})["underway"]["step"] == "drive"
        assert running.step("fit", {})["reason"] == "no_batch"
        running.play(tmp_path / "01.log")
        said["made"] = running.wait_until(lambda told: told["active"] is not None)
        running.wait_until(lambda told: running.n_starts == 2 and not told["is_pending"])
        said["status"] = running.http("/api/v1/status")
        running.play(tmp_path / "02.log")
        said["undone"] = running.step("undo", {})
        running.wait_until(lambda told: running.n_starts == 3 and not told["is_pending"])
        said["after"] = running.http("/api/v1/status")

    serve(config, meet)

    desk = calibrated_at_a_desk(campaign, sister)
    made = said["made"]["active"]
    box = load_calibration(next((tmp_path / "state").glob("commissioned-*.json")))
    assert box.id == made["id"] == said["status"]["calibration_id"]
    assert (made["by"], made["note"], made["n_batches"]) == ("local", "in the yard", 2)
    assert box.cross_spectrum is not None
    assert desk.cross_spectrum is not None
    assert box.model_dump_json(include={"cross_spectrum"}) == desk.model_dump_json(include={"cross_spectrum"})
    assert box.warnings == desk.warnings
    assert said["undone"]["active"] is None
    assert said["after"]["calibration_id"] is None
    assert_weighs_the_same(config, tmp_path, desk)


def assert_weighs_the_same(config: Path, folder: Path, desk: CalibrationFile) -> None:
    """What the service stored of the loaded drive is what its log gives with the desk's calibration."""
    weighed = [
        one for one in map(json.loads, stored(config)) if one["calibration_id"] is not None and not one["rejected"]
    ]
    (folder / "desk.json").write_text(desk.to_json())
    setup = load_setup("springscale:reference", folder / "desk.json")
    offline = list(estimates_of_logs([folder / "02.log"], setup, SETTINGS))
    told = [numbers(estimate_to_json(one)) for one in offline if one.counted]
    assert weighed
    assert [numbers(one) for one in weighed] == told


def numbers(record: dict[str, Any]) -> tuple[Any, ...]:
    return tuple(record[key] for key in ("t_end_ns", "payload_kg", "payload_std_kg", "front_share_pct"))
