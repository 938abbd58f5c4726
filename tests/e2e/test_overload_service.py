"""The real service with a limit of its own settings: what it stores, tells a phone in the cab and writes to its log."""

import asyncio
import logging
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest
from support.bus_drive import START_NS, white_noise
from support.calibrated import calibration_text
from support.configured import service_config
from support.patience import wait_until

from gateway.bus.logs import write_candump
from gateway.bus.signals import shipped_map
from gateway.bus.sink import replay
from gateway.config import load_settings
from gateway.log import LOGGER
from gateway.records import Frames
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
    shipped = shipped_map("reference")
    text = shipped.read_text().replace('dbc = ["', f'dbc = ["{shipped.parent}/')
    (tmp_path / "signals.toml").write_text(text + SATELLITES)
    return service_config(
        tmp_path,
        calibration_text(unsprung_front_kg=80.0, unsprung_rear_kg=80.0),
        signals="signals.toml",
        estimator="ratio_index",
        vehicle__id="van-17",
        vehicle__gross_limit_kg=1550.0,
        vehicle__rear_axle_limit_kg=1000.0,
        batch__window_s=20.0,
    )


class Cab:
    """A running service, and a phone that asks it after each log that it heard."""

    def __init__(self, gateway: Gateway, channel: str, folder: Path) -> None:
        self._gateway, self._channel, self._folder = gateway, channel, folder
        self._n_frames = 0

    def get(self, path: str = "/api/v1/cab") -> Any:
        answer = httpx.get(f"{self._gateway.url}{path}")
        return answer.text if path == "/metrics" else answer.json()

    def after(self, frames: Frames) -> Any:
        """What the cab is told once the service has worked through these."""
        log = self._folder / "drive.log"
        write_candump(frames, "can0", log)
        self._n_frames += replay(log, "virtual", self._channel, speed="max").frames
        assert wait_until(
            lambda: self._gateway.source.counts().frames >= self._n_frames and self._gateway.has_caught_up
        )
        return self.get()


def with_service(config: Path, play: Callable[[Cab], None]) -> None:
    """Runs the service while ``play`` plays; what that raises fails the test."""
    settings = load_settings(config)
    faults: list[BaseException] = []

    def on_started(gateway: Gateway) -> None:
        loop = asyncio.get_running_loop()

        def run() -> None:
            try:
                play(Cab(gateway, settings.bus.channel, config.parent))
            except BaseException as fault:  # noqa: BLE001 - raised again below, in the test's own thread
                faults.append(fault)
            finally:
                loop.call_soon_threadsafe(gateway.request_stop)

        threading.Thread(target=run, daemon=True).start()

    Gateway(settings, setup_of(settings), on_started=on_started).run()
    for fault in faults:
        raise fault


def test_an_overload_by_the_settings_is_told_everywhere(config: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, logger=LOGGER.name)

    def play(cab: Cab) -> None:
        before = cab.get()
        assert (before["load"], before["light"]) == ("never_weighed", "unknown")
        told = cab.after(white_noise(45.0, START_NS, seed=3))
        assert (told["light"], told["light_about"], told["load"]) == ("over", ["gross"], "weighed")
        assert [(room["place"], room["kg"]) for room in told["room"]] == [("gross", -50.0), ("rear_axle", 171.2)]
        [reading] = told["own_readings"]
        assert (reading["signal"], reading["unit"]) == ("axle_weight", "kg")
        weights = cab.get("/api/v1/estimates")["items"][-1]["weights"]
        low_kg, high_kg = weights["gross"].pop("interval95_kg")
        assert low_kg < 1600.0 < high_kg
        assert {**weights["gross"], "std_kg": None} == {
            "kg": 1600.0,
            "std_kg": None,
            "limit_kg": 1550.0,
            "is_over_limit": True,
            "lacks": None,
            "is_unsprung_estimated": False,
        }
        assert weights["rear_axle"]["limit_kg"] == 1000.0
        assert 'springscale_overload{where="gross"} 1.0' in cab.get("/metrics")

    with_service(config, play)
    assert "overload begins" in caplog.text


def test_a_stop_makes_the_load_unknown_until_it_is_weighed_again(config: Path) -> None:
    def play(cab: Cab) -> None:
        t_s = 0.0

        def goes_on(for_s: float, speed_mps: float = 15.0) -> Any:
            nonlocal t_s
            start_ns, t_s = START_NS + round(t_s * 1e9), t_s + for_s
            return cab.after(white_noise(for_s, start_ns, seed=3, speed_mps=speed_mps))

        driven = goes_on(45.0)
        assert (driven["load"], driven["stood_s"]) == ("weighed", None)
        weighed_at = driven["t_end"]
        assert goes_on(5.0, 0.0)["load"] == "weighed"  # a red light
        standing = goes_on(70.0, 0.0)
        assert standing["load"] == "standing"
        assert standing["stood_s"] == pytest.approx(75.0, abs=1.0)
        assert standing["room"] == driven["room"]  # as it was weighed last
        on_the_way = goes_on(5.0)
        assert (on_the_way["load"], on_the_way["t_end"]) == ("not_weighed_yet", weighed_at)
        again = goes_on(45.0)
        assert again["load"] == "weighed"
        assert again["t_end"] > weighed_at

    with_service(config, play)
