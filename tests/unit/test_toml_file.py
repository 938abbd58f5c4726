"""A number beyond its bounds is told in the terms of who wrote it: most often it is right, in another unit."""

from pathlib import Path

import pytest
from pydantic import BaseModel, Field

from gateway.errors import ConfigurationError
from gateway.toml_file import checked


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
def test_a_number_beyond_its_bounds_says_which_unit_it_may_be_in(tables: dict[str, object], said: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        checked(tables, Path("van.toml"), Written)
    assert str(caught.value) == f"van.toml: {said}"
