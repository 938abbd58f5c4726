"""A calibration file that breaks under a running service: told at the reload, and the next start weighs on."""

import logging
from collections.abc import Iterator
from pathlib import Path

import pytest
from support.calibrated import calibration_file
from support.configured import service_config
from support.web import Gateway as Web

from gateway.config import Settings, load_settings
from gateway.errors import CalibrationFileError, ConfigurationError
from gateway.log import LOGGER
from gateway.service.calibration_in_use import keep_copy, setup_or_last_good
from gateway.service.gateway import Gateway
from gateway.service.reload import Reloader
from gateway.setup import setup_of
from gateway.web.access.serving import server_config

BROKEN = ["", "{", "gone", "changed"]


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    (tmp_path / "map.toml").write_text(_map(tmp_path))
    calibration = calibration_file().to_json()
    return load_settings(service_config(tmp_path, calibration, signals="map.toml", estimator="ratio_index"))


def _map(folder: Path) -> str:
    dbc = Path(__file__).parents[2] / "dbc"
    (folder / "springscale_reference.dbc").write_bytes((dbc / "springscale_reference.dbc").read_bytes())
    return (dbc / "reference.toml").read_text()


def spoil(folder: Path, how: str) -> None:
    file = folder / "vehicle.json"
    if how == "gone":
        file.unlink()
    elif how == "changed":
        file.write_text(file.read_text().replace('"empty_mass_kg": ', '"empty_mass_kg": 1'))
    else:
        file.write_text(how)


@pytest.mark.parametrize("how", BROKEN)
def test_a_start_with_a_broken_file_takes_the_last_good_copy_and_says_so(
    how: str, settings: Settings, tmp_path: Path
) -> None:
    good, fault = setup_or_last_good(settings)
    assert fault is None
    keep_copy(settings, good.calibration)
    spoil(tmp_path, how)
    with pytest.raises(CalibrationFileError):
        setup_of(settings)  # what check-config and the offline tools say stays as it was
    setup, fault = setup_or_last_good(settings)
    assert setup.calibration.id == good.calibration.id
    assert "vehicle.json" in str(fault)
    assert "last good copy" in str(fault)


def test_the_service_keeps_the_copy_and_shows_the_fault(settings: Settings, tmp_path: Path) -> None:
    first = Gateway(settings, setup_of(settings))
    first.store.close()
    spoil(tmp_path, "{")
    setup, fault = setup_or_last_good(settings)
    second = Gateway(settings, setup, setup_fault=fault)
    try:
        status = second.status()
        assert status.calibration_id == first.status().calibration_id
        assert status.warnings == (fault,)
        assert "last good copy" in status.state_in_words
    finally:
        second.store.close()


def test_without_a_copy_a_broken_file_ends_the_start(settings: Settings, tmp_path: Path) -> None:
    spoil(tmp_path, "{")
    with pytest.raises(CalibrationFileError, match=r"vehicle\.json"):
        setup_or_last_good(settings)


def test_another_path_never_gets_the_copy(settings: Settings, tmp_path: Path) -> None:
    keep_copy(settings, calibration_file())
    other = settings.model_copy(update={"calibration": tmp_path / "other.json"})
    with pytest.raises(CalibrationFileError, match=r"other\.json"):
        setup_or_last_good(other)


def test_a_broken_copy_is_none(settings: Settings, tmp_path: Path) -> None:
    keep_copy(settings, calibration_file())
    (copy,) = (tmp_path / "state").glob("calibration-*.json")
    copy.write_text("{")
    spoil(tmp_path, "{")
    with pytest.raises(CalibrationFileError, match=r"vehicle\.json"):
        setup_or_last_good(settings)


def test_another_vehicle_s_file_is_refused_and_no_copy_taken(settings: Settings) -> None:
    keep_copy(settings, calibration_file())
    vehicle = settings.vehicle.model_copy(update={"calibrated_as": "somebody else"})
    with pytest.raises(ConfigurationError, match="somebody else"):
        setup_or_last_good(settings.model_copy(update={"vehicle": vehicle}))


@pytest.fixture
def reload(settings: Settings, tmp_path: Path) -> Iterator[Reloader]:
    with Web(tmp_path / "web") as web:
        config = server_config(web.app, "127.0.0.1", 0, None)
        yield Reloader(settings, lambda: load_settings(tmp_path / "springscale.toml"), config, setup_of(settings))


def waiting(caplog: pytest.LogCaptureFixture) -> list[str]:
    return caplog.records[-1].fields["waits_for_restart"]


@pytest.mark.parametrize("how", BROKEN)
def test_a_reload_says_that_the_file_cannot_be_used_and_later_that_it_can(
    how: str, reload: Reloader, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """It was silent: the next start then failed for good."""
    caplog.set_level(logging.INFO, LOGGER.name)
    assert reload()
    assert reload.fault is None
    before = (tmp_path / "vehicle.json").read_text()
    spoil(tmp_path, how)
    assert not reload()
    assert "vehicle.json" in str(reload.fault)
    assert any(record.levelno == logging.ERROR for record in caplog.records)
    (tmp_path / "vehicle.json").write_text(before)
    assert reload()
    assert reload.fault is None


def test_a_reload_compares_what_the_files_hold(
    reload: Reloader, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, LOGGER.name)
    reload()
    assert waiting(caplog) == []
    changed = calibration_file().model_copy(update={"warnings": ("driven anew",)})
    (tmp_path / "vehicle.json").write_text(changed.to_json())
    reload()
    assert waiting(caplog) == ["calibration"]
    (tmp_path / "map.toml").write_text(_map(tmp_path).replace("sign = 1", "sign = -1", 1))
    reload()
    assert waiting(caplog) == ["calibration", "signals"]
