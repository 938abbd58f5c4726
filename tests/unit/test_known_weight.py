"""What a weighbridge's ticket makes known of a load: statics, and refusals that say how to mend them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.calibration.known_weight import WeightRefusal, load_of
from gateway.core.vehicle import Vehicle, front_share_pct
from gateway.core.weights.on_the_road import NOT_CALIBRATED, Unsprung, weights_of
from gateway.errors import WeightRefusedError
from gateway.estimate import Quantity
from gateway.posterior import exactly
from gateway.stated.facts import StatedWeight

AT = "2026-11-21T04:00:00Z"
VAN = Vehicle(
    name="van",
    empty_mass_kg=1240.0,
    wheelbase_m=2.8,
    empty_front_share_pct=52.0,
    sensor_position_m=0.0,
    unsprung_front_kg=80.0,
    unsprung_rear_kg=95.0,
)
BARE = Vehicle(name="van", empty_mass_kg=1240.0, wheelbase_m=2.8, empty_front_share_pct=52.0, sensor_position_m=0.0)


@given(payload_kg=st.floats(0.0, 1200.0), position_m=st.floats(0.3, 3.2))
def test_axle_weights_are_the_inverse_of_weights_on_the_road(payload_kg: float, position_m: float) -> None:
    share = front_share_pct(VAN, payload_kg, position_m)
    road = weights_of(VAN, exactly(payload_kg, share))
    known = load_of(
        StatedWeight(AT, front_axle_kg=road.front_axle.kg, rear_axle_kg=road.rear_axle.kg), VAN, NOT_CALIBRATED
    )
    assert known.payload_kg == pytest.approx(payload_kg, abs=1e-6)
    assert known.front_share_pct == pytest.approx(share, abs=1e-6)
    assert (known.gross_kg, known.front_axle_kg) == pytest.approx((road.gross.kg, road.front_axle.kg))
    by_gross = load_of(StatedWeight(AT, gross_kg=road.gross.kg), VAN, NOT_CALIBRATED)
    assert by_gross.payload_kg == pytest.approx(payload_kg, abs=1e-6)
    assert (by_gross.front_share_pct, by_gross.front_axle_kg) == (None, None)


def test_a_payload_needs_its_place_for_a_share_but_an_empty_vehicle_does_not() -> None:
    assert load_of(StatedWeight(AT, payload_kg=270.0), VAN, NOT_CALIBRATED).front_share_pct is None
    placed = load_of(StatedWeight(AT, payload_kg=270.0, position_m=1.4), VAN, NOT_CALIBRATED)
    assert placed.front_share_pct == pytest.approx(front_share_pct(VAN, 270.0, 1.4))
    assert load_of(StatedWeight(AT, payload_kg=0.0), VAN, NOT_CALIBRATED).front_share_pct == 52.0


def test_without_unsprung_masses_only_a_payload_is_known() -> None:
    known = load_of(StatedWeight(AT, payload_kg=100.0), BARE, NOT_CALIBRATED)
    assert (known.payload_kg, known.gross_kg, known.rear_axle_kg) == (100.0, None, None)
    for stated in (StatedWeight(AT, gross_kg=1500.0), StatedWeight(AT, front_axle_kg=700.0, rear_axle_kg=800.0)):
        with pytest.raises(WeightRefusedError, match="state the payload instead") as refused:
            load_of(stated, BARE, NOT_CALIBRATED)
        assert refused.value.reason == WeightRefusal.NO_UNSPRUNG_MASS


def test_those_that_calibration_found_do() -> None:
    found = Unsprung(Quantity(80.0, 5.0), Quantity(95.0, 5.0), 0.3)
    assert load_of(StatedWeight(AT, gross_kg=1515.0), BARE, found).payload_kg == pytest.approx(100.0)


@pytest.mark.parametrize(
    ("stated", "why"),
    [
        (StatedWeight(AT, gross_kg=900.0), "another unit"),
        (StatedWeight(AT, gross_kg=40_000.0), "another vehicle's"),
        (StatedWeight(AT, front_axle_kg=1700.0, rear_axle_kg=100.0), "are axles or place mixed up"),
        (StatedWeight(AT, payload_kg=1000.0, position_m=9.0), "are axles or place mixed up"),
    ],
)
def test_what_cannot_be_is_refused_in_words(stated: StatedWeight, why: str) -> None:
    with pytest.raises(WeightRefusedError, match=why) as refused:
        load_of(stated, VAN, NOT_CALIBRATED)
    assert refused.value.reason == WeightRefusal.IMPOSSIBLE_WEIGHT
