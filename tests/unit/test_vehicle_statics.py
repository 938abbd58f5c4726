"""Statics of the sprung mass: front share, payload position, and what axle weights say."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.paper_van import paper_van

from gateway.calibration.axle_weights import sprung_keys
from gateway.core.vehicle import Vehicle, front_share_pct, payload_position_m
from gateway.errors import CampaignError
from gateway.model.table import UNSPRUNG_SHARE

vehicles = st.builds(
    Vehicle,
    name=st.just("van"),
    empty_mass_kg=st.floats(500.0, 5000.0),
    wheelbase_m=st.floats(2.0, 5.0),
    empty_front_share_pct=st.floats(35.0, 65.0),
)
loads_kg = st.floats(10.0, 3000.0)


def test_an_even_vehicle_obeys_equation_3() -> None:
    van = paper_van()
    for load_kg, d_m in ((270.0, 0.5), (450.0, 2.8), (90.0, 1.4)):
        expected = 100.0 * (1240.0 / 2.0 + (1.0 - d_m / 2.8) * load_kg) / (1240.0 + load_kg)
        assert front_share_pct(van, load_kg, d_m) == pytest.approx(expected, rel=1e-12)
    assert front_share_pct(van, 100.0, 1.4) == pytest.approx(50.0)  # midway between the axles


@given(van=vehicles, load_kg=loads_kg, position_m=st.floats(-1.0, 6.0))
def test_share_and_position_are_inverse(van: Vehicle, load_kg: float, position_m: float) -> None:
    share = front_share_pct(van, load_kg, position_m)
    assert payload_position_m(van, load_kg, share) == pytest.approx(position_m, abs=1e-6)


@given(van=vehicles)
def test_without_payload_the_share_is_the_empty_one(van: Vehicle) -> None:
    assert front_share_pct(van, 0.0, None) == van.empty_front_share_pct
    assert front_share_pct(van, 0.0, 1.0) == van.empty_front_share_pct
    with pytest.raises(ZeroDivisionError):
        payload_position_m(van, 0.0, 50.0)


masses_kg = st.floats(400.0, 5000.0)
shares = st.floats(0.3, 0.7)
unsprung_shares = st.floats(0.03, 0.1)


@given(mass_kg=masses_kg, share=shares, front=unsprung_shares, rear=unsprung_shares)
def test_given_unsprung_masses_lead_back_to_the_body(mass_kg: float, share: float, front: float, rear: float) -> None:
    front_u, rear_u = front * mass_kg, rear * mass_kg
    body = sprung_keys(share * mass_kg + front_u, (1.0 - share) * mass_kg + rear_u, front_u, rear_u)
    assert body["empty_mass_kg"] == pytest.approx(mass_kg, abs=0.06)
    assert body["empty_front_share_pct"] == pytest.approx(100.0 * share, abs=0.006)
    assert (body["unsprung_front_kg"], body["unsprung_rear_kg"]) == (front_u, rear_u)


@given(mass_kg=masses_kg, share=shares)
def test_an_unstated_unsprung_mass_is_the_documented_share(mass_kg: float, share: float) -> None:
    kg = UNSPRUNG_SHARE * mass_kg
    weights = (share * mass_kg + kg, (1.0 - share) * mass_kg + kg)
    for known in ((None, None), (kg, None), (None, kg)):
        body = sprung_keys(*weights, *known)
        assert body["empty_mass_kg"] == pytest.approx(mass_kg, abs=0.06)
        assert ("unsprung_front_kg" in body, "unsprung_rear_kg" in body) == tuple(one is not None for one in known)


def test_the_share_is_as_sure_as_the_readings_carried_through() -> None:
    """M = 1240, s = 670 / 1240: readings in steps of 200 kg, and unsprung masses of 90 and 70 kg known to 10 %."""
    body = sprung_keys(760.0, 640.0, 90.0, 70.0, division_kg=200.0)
    front_std, rear_std = (math.hypot(200.0 / math.sqrt(12.0), 0.1 * kg) for kg in (90.0, 70.0))
    std_pct = 100.0 * math.hypot(570.0 * front_std, 670.0 * rear_std) / 1240.0**2
    assert body["empty_front_share_std_pct"] == pytest.approx(std_pct, abs=0.006)
    guessed = sprung_keys(760.0, 640.0, division_kg=200.0)
    assert guessed["empty_front_share_std_pct"] > body["empty_front_share_std_pct"]


def test_weights_without_a_body_are_refused() -> None:
    with pytest.raises(CampaignError, match="no more than the unsprung masses 90 and 80 kg alone"):
        sprung_keys(85.0, 640.0, 90.0, 80.0)
