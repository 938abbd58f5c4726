"""springscale.toml and the environment, faults in the terms of who wrote it, and units at the border."""

import math
import re
from contextlib import closing
from pathlib import Path
from typing import get_args

import pytest
from pydantic import BaseModel, Field
from support.drives import drive
from support.patience import PATIENCE_S

from gateway.config import Settings, load_settings
from gateway.config.sections import SettingsSection
from gateway.core.scheduler import Scheduler
from gateway.errors import ConfigurationError
from gateway.files.toml_file import checked
from gateway.service.parts import store_of
from gateway.units import si_factor

LEAST = 'signals = "signals.toml"\n'


def loaded(tmp_path: Path, text: str = LEAST) -> Settings:
    path = tmp_path / "springscale.toml"
    path.write_text(text)
    return load_settings(path)


def fault_of(tmp_path: Path, text: str) -> str:
    with pytest.raises(ConfigurationError) as caught:
        loaded(tmp_path, text)
    assert caught.value.exit_code == 2
    assert all(line.startswith(f"{tmp_path / 'springscale.toml'}: ") for line in str(caught.value).splitlines())
    return str(caught.value)


def test_paths_are_relative_to_the_file(tmp_path: Path) -> None:
    settings = loaded(tmp_path, LEAST + 'calibration = "van.json"\n[store]\ndirectory = "records"')
    assert settings.calibration == tmp_path / "van.json"
    assert settings.store.directory == tmp_path / "records"
    away = loaded(tmp_path, 'signals = "springscale:aceinna"\n[store]\ndirectory = "/srv/records"')
    assert away.signals == "springscale:aceinna"
    assert away.store.directory == Path("/srv/records")


def test_the_environment_wins_and_leaves_its_neighbours(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SPRINGSCALE_WEB__PORT", "8001")
    monkeypatch.setenv("SPRINGSCALE_ESTIMATOR", "ratio_index")
    settings = loaded(tmp_path, LEAST + '[web]\nhost = "::1"\nport = 9000')
    assert (settings.web.host, settings.web.port) == ("::1", 8001)
    assert settings.estimator == "ratio_index"


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("SPRINGSCALE_WEBB__PORT", "did you mean SPRINGSCALE_WEB__PORT?"),
        ("SPRINGSCALE_CALIBRATON", "did you mean SPRINGSCALE_CALIBRATION?"),
        ("SPRINGSCALE_COLOUR__RED", "remove it"),
    ],
)
def test_a_misspelt_variable_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, meant: str) -> None:
    """It was ignored, and the default held."""
    monkeypatch.setenv("SPRINGSCALE_TOKEN", "spr_of_a_command")
    assert loaded(tmp_path)
    monkeypatch.setenv(name, "8001")
    with pytest.raises(ConfigurationError, match=f"{name} in the environment is no setting; {re.escape(meant)}"):
        loaded(tmp_path)


def test_a_fault_in_the_environment_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SPRINGSCALE_WEB__PORT", "eighty")
    assert "web.port: " in fault_of(tmp_path, LEAST)


FAULTS = [
    ("", "signals: missing"),
    (LEAST + "colour = 1", "colour: unknown key"),
    (LEAST + "[batch]\nwindow = 300", "batch.window: unknown key; did you mean window_s?"),
    (LEAST + '[uplinc]\nbroker = "b"', "uplinc: unknown key; did you mean uplink?"),
    (LEAST + "[limits]\nfront_axle_kg = 1", "limits: unknown key; "),
    (LEAST + "[batch]\nwindow_s = 5.0", "batch.window_s: "),
    (LEAST + "[batch]\nstandstill_s = inf", "batch.standstill_s: "),
    (LEAST + "[batch]\nusable_share_min = 60", "batch.usable_share_min: "),
    (LEAST + "[batch]\nspeed_min_mps = 50.0", "batch: speed_min_mps must be below speed_max_mps"),
    (LEAST + "[batch]\nsilence_s = 300.0", "batch: silence_s must be below window_s"),
    (LEAST + "[batch]\nprovisional_every_s = 0.5", "batch: provisional_every_s must be 0 or at least 1"),
    (LEAST + "[web]\nport = 70000", "web.port: "),
    (LEAST + '[web]\nhost = "x..y"', "web.host: 'x..y' is neither an address nor a name"),
    (LEAST + '[vehicle]\nvin = "TOO-SHORT"', "vehicle.vin: "),
    (LEAST + '[log]\nlevel = "loud"', "log.level: "),
    ('estimator = "guess"\n' + LEAST, "estimator: "),
    ("signals = ", "not valid TOML"),
]


@pytest.mark.parametrize(("text", "said"), FAULTS, ids=[said for _, said in FAULTS])
def test_each_fault_is_named_with_its_key(tmp_path: Path, text: str, said: str) -> None:
    assert said in fault_of(tmp_path, text)


def test_all_faults_are_named_at_once(tmp_path: Path) -> None:
    faults = fault_of(tmp_path, "colour = 1\n[web]\nport = -1\n[batch]\nrate_hz = 0.0")
    assert {line.split(": ")[1] for line in faults.splitlines()} == {"signals", "colour", "web.port", "batch.rate_hz"}


def test_only_the_live_service_looks_early(tmp_path: Path) -> None:
    batch = loaded(tmp_path).batch
    assert batch.for_core(is_live=True).provisional_every_s == 60.0
    assert batch.for_core().provisional_every_s == 0.0
    assert batch.for_core(window_s=120.0).window_s == 120.0
    assert batch.for_core().window_s == 300.0


@pytest.mark.parametrize(
    ("quantity", "unit", "factor"),
    [
        ("acceleration", "g", 9.80665),
        ("acceleration", " M/S^2 ", 1.0),
        ("acceleration", "mg", 0.00980665),
        ("angular_rate", "deg/s", math.pi / 180.0),
        ("angular_rate", "rad/s", 1.0),
        ("speed", "km/h", 1000.0 / 3600.0),
        ("speed", "mph", 1609.344 / 3600.0),
        ("speed", "kn", 1852.0 / 3600.0),
        ("mass", "t", 1000.0),
        ("state", "", 1.0),
    ],
)
def test_units(quantity: str, unit: str, factor: float) -> None:
    assert si_factor(quantity, unit) == pytest.approx(factor, rel=1e-12)


NUMBERS = ("inf", "-inf", "nan", "1e308", "-1e308", "1e18", "1e10", "-1", "0", "5e-324", "9" * 40)


def numeric_keys() -> list[tuple[str, str]]:
    """Section and key of every number there is to set."""
    sections = {name: field.annotation for name, field in Settings.model_fields.items()}
    return [
        (name, key)
        for name, section in sections.items()
        if isinstance(section, type) and issubclass(section, SettingsSection)
        for key, field in section.model_fields.items()
        if {field.annotation, *get_args(field.annotation)} & {int, float}
    ]


@pytest.mark.parametrize(("section", "key"), numeric_keys())
def test_a_number_out_of_all_bounds_is_refused_in_words_or_can_be_used(tmp_path: Path, section: str, key: str) -> None:
    refusals = []
    for n, number in enumerate(NUMBERS):
        try:
            settings = loaded(tmp_path, f'{LEAST}vehicle.id = "van-17"\n{section}.{key} = {number}\n')
        except ConfigurationError as fault:
            refusals.append(str(fault))
            continue
        scheduler = Scheduler(settings.batch.for_core(is_live=True), {})
        list(scheduler.feed(drive(1.0)))
        list(scheduler.flush())
        kept = settings.store.model_copy(update={"directory": tmp_path / str(n)})
        with closing(store_of(kept)) as store:
            store.write_event("started", {})
            assert store.flush(PATIENCE_S)
    assert refusals
    assert all(f"{section}.{key}: " in refusal or f": {section}: " in refusal for refusal in refusals)


class Length(BaseModel):
    length_m: float = Field(ge=0.8, le=20.0)


class Written(BaseModel):
    sensor_position_m: float = Field(0.0, ge=-10.0, le=30.0)
    empty_mass_kg: float = Field(1000.0, ge=100.0, le=100_000.0)
    share_pct: float = Field(50.0, ge=1.0, le=99.0)
    speed_mps: float = Field(10.0, gt=0.0, lt=60.0)
    port: int = Field(8000, le=65535)
    bounds_m: tuple[Length, Length] = (1.0, 1.0)


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        ({"sensor_position_m": 1240}, "sensor_position_m: 1240 is above 30: millimetres?"),
        ({"sensor_position_m": 320.0}, "sensor_position_m: 320.0 is above 30: centimetres?"),
        ({"sensor_position_m": -12.0}, "sensor_position_m: -12.0 is below -10"),
        ({"sensor_position_m": -1200.0}, "sensor_position_m: -1200.0 is below -10: millimetres?"),
        ({"empty_mass_kg": 1.24}, "empty_mass_kg: 1.24 is below 100: tonnes?"),
        ({"empty_mass_kg": 1_240_000}, "empty_mass_kg: 1240000 is above 100000: grams?"),
        ({"empty_mass_kg": -3}, "empty_mass_kg: -3 is below 100"),
        ({"share_pct": 0.52}, "share_pct: 0.52 is below 1: a fraction?"),
        ({"share_pct": 120}, "share_pct: 120 is above 99"),
        ({"speed_mps": 80.0}, "speed_mps: 80.0 is not below 60: km/h?"),
        ({"speed_mps": 0}, "speed_mps: 0 is not above 0"),
        ({"port": 70000}, "port: 70000 is above 65535"),
        ({"speed_mps": float("nan")}, "speed_mps: nan is no number"),
        ({"bounds_m": [{"length_m": 2800}, {"length_m": 1}]}, "bounds_m[1].length_m: 2800 is above 20: millimetres?"),
    ],
)
def test_a_number_out_of_bounds_gets_a_suggested_unit(tables: dict[str, object], said: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        checked(tables, Path("van.toml"), Written)
    assert str(caught.value) == f"van.toml: {said}"
