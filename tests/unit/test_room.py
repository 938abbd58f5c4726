"""How much more may go in, and how near it is to too much."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.vehicle import Vehicle
from gateway.core.weights.limits import Light, nearness, rooms_of
from gateway.core.weights.on_the_road import weights_of
from gateway.estimate import Z95, Weight, Weights
from gateway.posterior import Posterior

VAN = Vehicle(
    name="van",
    empty_mass_kg=1240.0,
    wheelbase_m=2.8,
    sensor_position_m=0.0,
    unsprung_front_kg=80.0,
    unsprung_rear_kg=80.0,
    gross_limit_kg=2000.0,
    front_axle_limit_kg=1000.0,
    rear_axle_limit_kg=1050.0,
)
WITHIN = st.floats(0.0, 1.0)


def aboard(payload_kg: float, front_share_pct: float, std_kg: float = 6.0) -> Weights:
    return weights_of(VAN, Posterior(np.array([payload_kg, front_share_pct]), np.diag([std_kg**2, 0.04])))


def test_every_limit_leaves_its_own_room_the_tightest_first() -> None:
    """300 kg, 48 % of 1540 kg in front: 819 and 881 kg on the axles, 1700 kg in all."""
    rooms = rooms_of(aboard(300.0, 48.0))
    assert [room.place for room in rooms] == ["rear_axle", "front_axle", "gross"]
    assert [room.left.number for room in rooms] == pytest.approx([169.2, 180.8, 300.0])
    assert rooms[2].left.std == pytest.approx(6.0)
    assert rooms[2].surely_kg == pytest.approx(300.0 - Z95 * 6.0)


@given(WITHIN, st.floats(0.0, 450.0), st.floats(44.0, 54.0))
def test_the_tightest_room_fits_wherever_between_the_axles_it_is_put(
    front_part: float, payload_kg: float, front_share_pct: float
) -> None:
    before = aboard(payload_kg, front_share_pct)
    more_kg = rooms_of(before)[0].left.number
    if more_kg <= 0.0:
        return
    front_kg = front_share_pct / 100.0 * (1240.0 + payload_kg) + front_part * more_kg
    after = aboard(payload_kg + more_kg, 100.0 * front_kg / (1240.0 + payload_kg + more_kg))
    assert all(weight.kg <= weight.limit_kg + 1e-6 for _, weight in after.items() if weight.limit_kg is not None)
    tightest = {room.place: room.left.number for room in rooms_of(after)}
    assert min(tightest.values()) >= -1e-6


def test_an_overloaded_axle_leaves_less_than_nothing() -> None:
    assert rooms_of(aboard(500.0, 40.0))[0].place == "rear_axle"
    assert rooms_of(aboard(500.0, 40.0))[0].left.number == pytest.approx(1050.0 - 0.6 * 1740.0 - 80.0)


def test_no_limit_or_no_weight_leaves_nothing_to_tell() -> None:
    assert rooms_of(Weights()) == ()
    assert rooms_of(Weights(gross=Weight(1700.0, 6.0, None, None))) == ()
    assert rooms_of(Weights(gross=Weight(limit_kg=2000.0))) == ()
    assert nearness(Weights()).light is Light.UNKNOWN
    assert nearness(Weights()).places() == ()


def test_how_sure_it_is_unknown_still_leaves_room() -> None:
    [room] = rooms_of(Weights(gross=Weight(1700.0, math.nan, 2000.0, None)))
    assert room.surely_kg == 300.0


@pytest.mark.parametrize(
    ("kg", "light"),
    [(1900.0, Light.GO), (1980.3, Light.GO), (1980.5, Light.NEAR), (1999.9, Light.NEAR), (2000.1, Light.OVER)],
)
def test_the_light_turns_where_the_limit_enters_the_interval_and_at_the_limit(kg: float, light: Light) -> None:
    """10 kg of standard deviation: the upper end of the interval is 19.6 kg above."""
    found = nearness(Weights(gross=Weight(kg, 10.0, 2000.0, None), rear_axle=Weight(500.0, 5.0, 1000.0, None)))
    assert found.light is light
    assert found.places() == (() if light is Light.GO else ("gross",))


def test_a_wheel_can_be_what_the_light_is_about() -> None:
    found = nearness(Weights(gross=Weight(1900.0, 6.0, 2000.0, None), rear_left=Weight(560.0, 5.0, 550.0, None)))
    assert (found.light, found.places()) == (Light.OVER, ("rear_left",))
