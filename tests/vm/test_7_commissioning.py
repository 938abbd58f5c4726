"""Commissioned on the machine that weighs, inside its unit's walls, the plug pulled in the middle; frames recorded."""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import httpx
import pytest
from vm.harness.drives import empty_drive, loaded_drive, log_of
from vm.harness.vehicle import CONFIG, SETTINGS, Vehicle

PATH = "calibration/commissioning"
UNCALIBRATED = SETTINGS.replace('calibration = "vehicle.json"\n', "") + (
    '[record]\nenabled = true\n[commissioning]\nlike = "vehicle.json"\n'
)
ANSWERS = {
    "kerb_front_axle_kg": 700.0,
    "kerb_rear_axle_kg": 700.0,
    "unsprung_front_kg": 80.0,
    "unsprung_rear_kg": 80.0,
    "wheelbase_m": 2.8,
    "sensor_position_m": 3.2,
    "sensor_offset_left_m": 0.15,
}
WINDOW_S = 20.0
TRIES = 3


class Fitter:
    """Somebody with a token that may operate."""

    def __init__(self, vehicle: Vehicle) -> None:
        self._vehicle = vehicle
        self._token = vehicle.run(f"springscale token create fitter --scope operate --config {CONFIG}").strip()

    def say(self, step: str, body: dict[str, Any]) -> dict[str, Any]:
        """One step; what is underway then."""
        response = httpx.post(
            f"{self._vehicle.url}/api/v1/{PATH}{step}",
            verify=self._vehicle.trust,
            json=body,
            headers={"authorization": f"Bearer {self._token}"},
            timeout=30.0,
        )
        assert response.is_success, response.text
        return response.json()


def state(vehicle: Vehicle) -> dict[str, Any]:
    return vehicle.get(PATH)


def drive_a_batch(vehicle: Vehicle, log: str) -> None:
    """Drive one window until it counts: a stall of a busy host is a gap, which is rightly refused."""
    n_wanted = state(vehicle)["underway"]["n_batches"] + 1
    for _ in range(TRIES):
        vehicle.play(log)
        with suppress(TimeoutError):
            vehicle.wait_for(lambda: state(vehicle)["underway"]["n_batches"] == n_wanted, timeout_s=60.0)
            return
    raise TimeoutError(f"{TRIES} drives made no batch: {state(vehicle)}")


@pytest.fixture
def fitter(vehicle: Vehicle) -> Fitter:
    """Of a service without a calibration that records."""
    vehicle.configure(UNCALIBRATED)
    vehicle.restart()
    return Fitter(vehicle)


def test_commissioned_through_a_power_cut_it_weighs_by_what_it_made(
    vehicle: Vehicle, fitter: Fitter, tmp_path: Path, measured: Callable[..., None]
) -> None:
    fitter.say("", {"note": "in the yard"})
    fitter.say("/vehicle", ANSWERS)
    fitter.say("/empty", {"is_empty": True})
    empty = vehicle.put_log(log_of(empty_drive(WINDOW_S + 4.0, 11), tmp_path / "empty.log"))
    vehicle.run("sync")
    drive_a_batch(vehicle, empty)

    vehicle.machine.cut_power()
    vehicle.machine.boot()
    vehicle.wait_until(lambda status: True)
    kept = state(vehicle)["underway"]
    assert (kept["step"], kept["n_batches"], kept["note"]) == ("drive", 1, "in the yard")

    drive_a_batch(vehicle, empty)
    vehicle.wait_for(lambda: not state(vehicle)["underway"]["is_fitting"])
    fitter.say("/fit", {})
    fitted_s = vehicle.wait_for(lambda: state(vehicle)["active"] is not None)
    made = state(vehicle)["active"]
    assert made["n_batches"] == 2
    vehicle.wait_until(lambda status: bool(status["calibration_id"] == made["id"]))
    measured(commissioning_fit_s=round(fitted_s, 1))

    vehicle.play(vehicle.put_log(log_of(loaded_drive(WINDOW_S + 4.0, 12), tmp_path / "loaded.log")))
    vehicle.wait_for(lambda: vehicle.records()[-1]["calibration_id"] == made["id"])
    assert vehicle.status()["record"]["n_frames_written"] > 0
