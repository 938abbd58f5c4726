"""A recorded sister of the calibrated van at the running service: her empty drive, her commissioning, her loads."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from gateway.calibration.commissioning.answers import vehicle_table

from gateway.calibration.axle_weights import UNSPRUNG_SHARE
from gateway.calibration.campaign import load_campaign
from gateway.core.vehicle import Vehicle
from gateway.stated.facts import VehicleAnswers
from support.configured import service_config
from support.recordings import recordings
from support.running_service import Running, serve, stored

WINDOW_S = 300.0


@dataclass(frozen=True)
class Commissioned:
    """What came of it: the calibration, of how many windows, what the service then weighed of ``logs``, oldest first;
    and a desk's campaign of the same drive.
    """

    calibration: Path
    n_windows: int
    signals: Path
    logs: tuple[Path, ...]
    weighed: list[dict[str, Any]]
    desk_campaign: Path


def commissioned(name: str, sister: Path, folder: Path, n_logs: int) -> Commissioned:
    """An empty drive of a quarter of an hour is replayed into the service, then drives with loads."""
    drives = recordings() / "siblings" / name
    signals, logs = (
        drives / "empty" / "signals_roll.toml",
        tuple(sorted((drives / "test").glob("*/can.log.gz")))[:n_logs],
    )
    config = _settings(folder, signals, sister)
    answers = _typed(load_campaign(drives / "empty" / "campaign_roll.toml").vehicle)
    made: dict[str, Any] = {}

    def meet(running: Running) -> None:
        running.step("", {})
        running.step("vehicle", answers)
        assert running.step("empty", {"is_empty": True})["underway"]["step"] == "drive"
        running.play(drives / "empty" / "01_empty_steady" / "can.log.gz")
        made.update(running.wait_until(lambda told: told["active"] is not None)["active"])
        running.wait_until(lambda told: running.n_starts == 2 and not told["is_pending"])
        for log in logs:
            running.play(log)

    serve(config, meet)
    return Commissioned(
        calibration=next((folder / "state").glob("commissioned-*.json")),
        n_windows=made["n_batches"],
        signals=signals,
        logs=logs,
        weighed=_weighed(config, made["id"]),
        desk_campaign=_campaign(
            folder / "desk.toml",
            vehicle_table(VehicleAnswers(**answers), name),
            drives / "empty",
            made["n_batches"] * WINDOW_S,
        ),
    )


def _settings(folder: Path, signals: Path, sister: Path) -> Path:
    """A service without a calibration on a bus of the test's own; all else as it comes, but for the patience."""
    return service_config(
        folder, signals=str(signals), vehicle__id=folder.name, batch__silence_s=2.0, commissioning__like=str(sister)
    )


def _typed(vehicle: Vehicle) -> dict[str, Any]:
    """What a fitter types who knows this: axle weights in the place of the sprung mass and its share."""
    unsprung_kg = UNSPRUNG_SHARE * vehicle.empty_mass_kg
    front_kg = vehicle.empty_mass_kg * vehicle.empty_front_share_pct / 100.0
    return {
        "kerb_front_axle_kg": round(front_kg + unsprung_kg),
        "kerb_rear_axle_kg": round(vehicle.empty_mass_kg - front_kg + unsprung_kg),
        "wheelbase_m": vehicle.wheelbase_m,
        "sensor_position_m": vehicle.sensor_position_m,
        "sensor_offset_left_m": vehicle.sensor_offset_left_m,
        "track_width_m": vehicle.track_width_m,
    }


def _campaign(path: Path, vehicle: Vehicle, drives: Path, duration_s: float) -> Path:
    """The same vehicle and the same part of the drive, for `springscale calibrate`."""
    typed = {key: value for key, value in asdict(vehicle).items() if value is not None}
    lines = [
        f'signals = "{drives / "signals_roll.toml"}"',
        "identification_fraction = 1.0",
        "[vehicle]",
        *(f"{key} = {json.dumps(value)}" for key, value in typed.items()),
        "[[runs]]",
        f'log = "{drives / "01_empty_steady" / "can.log.gz"}"',
        "payload_kg = 0.0",
        f"end_s = {duration_s}",
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _weighed(config: Path, calibration_id: str) -> list[dict[str, Any]]:
    records = map(json.loads, stored(config))
    return sorted((one for one in records if one["calibration_id"] == calibration_id), key=lambda one: one["t_end_ns"])
