"""The real service with a limit of its own settings: what it stores, tells a phone in the cab and writes to its log."""

import logging
from pathlib import Path
from typing import Any

import pytest
from support.bus_drive import START_NS, white_noise
from support.calibrated import calibration_text
from support.configured import service_config
from support.ports import first_answer
from support.running_service import Running, serve

from gateway.bus.logs import write_candump
from gateway.bus.signals import shipped_map
from gateway.log import LOGGER
from gateway.records import Frames

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


def told(service: Running, path: str = "/api/v1/cab") -> Any:
    """The cab page as a phone shows it."""
    answer = first_answer(service.gateway.url + path)
    return answer.text if path == "/metrics" else answer.json()


def after(service: Running, frames: Frames, log: Path) -> Any:
    """The cab page once the service has worked through these frames."""
    write_candump(frames, "can0", log)
    service.play(log)
    return told(service)


def test_an_overload_by_the_settings_reaches_every_channel(config: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, logger=LOGGER.name)

    def play(service: Running) -> None:
        before = told(service)
        assert (before["load"], before["light"]) == ("never_weighed", "unknown")
        cab = after(service, white_noise(45.0, START_NS, seed=3), config.parent / "drive.log")
        assert (cab["light"], cab["light_about"], cab["load"]) == ("over", ["gross"], "weighed")
        assert [(spare["place"], spare["kg"]) for spare in cab["spare"]] == [("gross", -50.0), ("rear_axle", 171.2)]
        [reading] = cab["own_readings"]
        assert (reading["signal"], reading["unit"]) == ("axle_weight", "kg")
        weights = told(service, "/api/v1/estimates")["items"][-1]["weights"]
        low_kg, high_kg = weights["gross"].pop("interval95_kg")
        assert low_kg < 1600.0 < high_kg
        known = {"kg": 1600.0, "std_kg": None, "limit_kg": 1550.0, "is_over_limit": True}
        known |= {"lacks": None, "is_unsprung_estimated": False}
        assert {**weights["gross"], "std_kg": None} == known
        assert weights["rear_axle"]["limit_kg"] == 1000.0
        assert "springscale_weights_gross_is_over_limit 1.0" in told(service, "/metrics")

    serve(config, play)
    assert "alarm raised" in caplog.text


def test_a_stop_makes_the_load_unknown_until_it_is_weighed_again(config: Path) -> None:
    def play(service: Running) -> None:
        t_s = 0.0

        def goes_on(for_s: float, speed_mps: float = 15.0) -> Any:
            nonlocal t_s
            start_ns, t_s = START_NS + round(t_s * 1e9), t_s + for_s
            frames = white_noise(for_s, start_ns, seed=3, speed_mps=speed_mps)
            return after(service, frames, config.parent / "drive.log")

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

    serve(config, play)
