"""Front share and payload position: statics of the sprung mass."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.vehicle import Vehicle, cg_left_m, front_share_pct, left_share_pct, payload_position_m

vehicles = st.builds(
    Vehicle,
    name=st.just("van"),
    empty_mass_kg=st.floats(500.0, 5000.0),
    wheelbase_m=st.floats(2.0, 5.0),
    empty_front_share_pct=st.floats(35.0, 65.0),
)
loads_kg = st.floats(10.0, 3000.0)


def test_an_even_vehicle_obeys_equation_3() -> None:
    van = Vehicle(name="van", empty_mass_kg=1240.0, wheelbase_m=2.8, sensor_position_m=0.0)
    for load_kg, d_m in ((270.0, 0.5), (450.0, 2.8), (90.0, 1.4)):
        expected = 100.0 * (1240.0 / 2.0 + (1.0 - d_m / 2.8) * load_kg) / (1240.0 + load_kg)
        assert front_share_pct(van, load_kg, d_m) == pytest.approx(expected, rel=1e-12)
    assert front_share_pct(van, 100.0, 1.4) == pytest.approx(50.0)  # midway between the axles


@given(van=vehicles, load_kg=loads_kg, position_m=st.floats(-1.0, 6.0))
def test_share_and_position_are_inverse(van: Vehicle, load_kg: float, position_m: float) -> None:
    share = front_share_pct(van, load_kg, position_m)
    assert payload_position_m(van, load_kg, share) == pytest.approx(position_m, abs=1e-6)


@given(van=vehicles, load_kg=loads_kg)
def test_a_load_over_an_axle_rests_on_it_alone(van: Vehicle, load_kg: float) -> None:
    def front_kg(payload_kg: float, position_m: float) -> float:
        return front_share_pct(van, payload_kg, position_m) / 100.0 * (van.empty_mass_kg + payload_kg)

    empty_kg = front_kg(0.0, 0.0)
    assert front_kg(load_kg, 0.0) - empty_kg == pytest.approx(load_kg, rel=1e-6)
    assert front_kg(load_kg, van.wheelbase_m) == pytest.approx(empty_kg, rel=1e-9)


@given(van=vehicles)
def test_without_payload_the_share_is_the_empty_one(van: Vehicle) -> None:
    assert front_share_pct(van, 0.0, None) == van.empty_front_share_pct
    assert front_share_pct(van, 0.0, 1.0) == van.empty_front_share_pct
    with pytest.raises(ZeroDivisionError):
        payload_position_m(van, 0.0, 50.0)


@given(van=vehicles, load_kg=loads_kg, left_m=st.floats(-0.7, 0.7), empty_left_m=st.floats(-0.05, 0.05))
def test_the_wheels_of_a_side_carry_what_the_moments_say(
    van: Vehicle, load_kg: float, left_m: float, empty_left_m: float
) -> None:
    van = replace(van, empty_cg_left_m=empty_left_m)
    track_m, total_kg = 1.5, van.empty_mass_kg + load_kg
    left_kg = left_share_pct(cg_left_m(van, load_kg, left_m), track_m) / 100.0 * total_kg
    moment_kgm = (left_kg - (total_kg - left_kg)) * track_m / 2.0
    assert moment_kgm == pytest.approx(van.empty_mass_kg * empty_left_m + load_kg * left_m, abs=1e-6)


def test_a_load_over_the_left_wheels_rests_on_them_alone() -> None:
    van = Vehicle(name="van", empty_mass_kg=1240.0, wheelbase_m=2.8, sensor_position_m=0.0)
    assert left_share_pct(cg_left_m(van, 0.0, 0.0), 1.5) == 50.0
    assert left_share_pct(cg_left_m(van, 310.0, 0.75), 1.5) == pytest.approx(100.0 * (620.0 + 310.0) / 1550.0)
    assert left_share_pct(cg_left_m(van, 310.0, -0.75), 1.5) == pytest.approx(100.0 * 620.0 / 1550.0)
