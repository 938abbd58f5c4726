"""The real service with a limit of its own settings: what it stores, tells the cab and writes to its log."""

import asyncio
import logging
import threading
from pathlib import Path
from typing import Any

import httpx
import pytest
from support.bus_drive import START_NS, white_noise
from support.calibrated import calibration_text
from support.patience import wait_until

from gateway.bus.logs import write_candump
from gateway.bus.signals import shipped_map
from gateway.bus.sink import replay
from gateway.config import load_settings
from gateway.log import LOGGER
from gateway.service.gateway import Gateway
from gateway.setup import setup_of

SATELLITES = """
[signals.axle_weight] # stands in for a load sensor
message = "GPS_SPEED"
signal = "Satellites"
unit = "t"
"""


@pytest.fixture
def config(tmp_path: Path) -> Path:
    """A calibration that always answers 200 kg of a vehicle of 1400 kg, and a limit below that."""
    (tmp_path / "vehicle.json").write_text(calibration_text(unsprung_front_kg=80.0, unsprung_rear_kg=80.0))
    shipped = shipped_map("reference")
    text = shipped.read_text().replace('dbc = ["', f'dbc = ["{shipped.parent}/')
    (tmp_path / "signals.toml").write_text(text + SATELLITES)
    path = tmp_path / "springscale.toml"
    path.write_text(
        f"""
        signals = "signals.toml"
        calibration = "vehicle.json"
        estimator = "ratio_index"
        [vehicle]
        id = "van-17"
        gross_limit_kg = 1550.0
        rear_axle_limit_kg = 1000.0
        [bus]
        interface = "virtual"
        channel = "{tmp_path.name}"
        [batch]
        window_s = 20.0
        [web]
        port = 0
        [store]
        directory = "state"
        """
    )
    return path


def told_after(config: Path, log: Path) -> dict[str, Any]:
    """The cab's answer, the record and the metrics of a running service that heard the log."""
    settings = load_settings(config)
    told: dict[str, Any] = {}

    def on_started(gateway: Gateway) -> None:
        loop = asyncio.get_running_loop()

        def play() -> None:
            try:
                told["cab before"] = httpx.get(f"{gateway.url}/api/v1/cab").json()
                report = replay(log, "virtual", settings.bus.channel, speed="max")
                assert wait_until(lambda: gateway.source.counts().frames >= report.frames and gateway.has_caught_up)
                told["cab"] = httpx.get(f"{gateway.url}/api/v1/cab").json()
                told["record"] = httpx.get(f"{gateway.url}/api/v1/estimates").json()["items"][-1]
                told["metrics"] = httpx.get(f"{gateway.url}/metrics").text
            finally:
                loop.call_soon_threadsafe(gateway.request_stop)

        threading.Thread(target=play, daemon=True).start()

    Gateway(settings, setup_of(settings), on_started=on_started).run()
    return told


def test_an_overload_by_the_settings_is_told_everywhere(config: Path, caplog: pytest.LogCaptureFixture) -> None:
    log = config.parent / "drive.log"
    write_candump(white_noise(45.0, START_NS, seed=3), "can0", log)
    caplog.set_level(logging.INFO, logger=LOGGER.name)
    told = told_after(config, log)
    assert (told["cab before"]["load"], told["cab before"]["light"]) == ("never_weighed", "unknown")
    cab = told["cab"]
    assert (cab["light"], cab["light_about"], cab["load"]) == ("over", ["gross"], "weighed")
    assert [(room["place"], room["kg"]) for room in cab["room"]] == [("gross", -50.0), ("rear_axle", 171.2)]
    [reading] = cab["own_readings"]
    assert (reading["signal"], reading["unit"]) == ("axle_weight", "kg")
    weights = told["record"]["weights"]
    assert (weights["gross"]["kg"], weights["gross"]["limit_kg"], weights["gross"]["is_over_limit"]) == (
        1600.0,
        1550.0,
        True,
    )
    assert weights["rear_axle"]["limit_kg"] == 1000.0
    assert 'springscale_overload{where="gross"} 1.0' in told["metrics"]
    assert "overload begins" in caplog.text
