"""Weights obey statics: wheels and axles add up to the whole, loads move where the payload is, errors add up."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.paper_van import paper_van

from gateway.core.vehicle import Vehicle, cg_left_m, front_share_pct, left_share_pct
from gateway.core.weights.on_the_road import PayloadPlace, place_of, unsprung_kg, weighed, weights_of
from gateway.estimates.batch_estimate import Z95, Estimate, Lack, Quantity, Weights
from gateway.estimates.posterior import FRONT_SHARE, PAYLOAD, Posterior, Source, exactly

VAN = paper_van(empty_front_share_pct=52.0, unsprung_front_kg=90.0, unsprung_rear_kg=110.0)

payloads = st.floats(0.0, 800.0)
positions = st.floats(-0.5, 3.5)
shares = st.floats(20.0, 80.0)
deviations = st.floats(0.0, 50.0)


def believed(mean: Sequence[float], std: Sequence[float], correlation: float = 0.0) -> Posterior:
    """Payload (kg), front share (%) and, if given, lateral place (m); the correlation is of the first two."""
    together = np.eye(len(mean))
    together[PAYLOAD, FRONT_SHARE] = together[FRONT_SHARE, PAYLOAD] = correlation
    return Posterior(np.array(mean, float), np.outer(std, std) * together)


def axle_loads(
    vehicle: Vehicle, kg: float, std_kg: float, share_pct: float, share_std_pct: float, correlation: float = 0.0
) -> Weights:
    return weights_of(vehicle, believed([kg, share_pct], [std_kg, share_std_pct], correlation))


def placed(
    vehicle: Vehicle, kg: float, std_kg: float, share_pct: float, share_std_pct: float, correlation: float = 0.0
) -> PayloadPlace | None:
    return place_of(vehicle, believed([kg, share_pct], [std_kg, share_std_pct], correlation))


@given(payloads, deviations, shares, st.floats(0.0, 3.0))
def test_the_axles_carry_the_whole(payload_kg: float, std_kg: float, share_pct: float, share_std_pct: float) -> None:
    weights = axle_loads(VAN, payload_kg, std_kg, share_pct, share_std_pct)
    assert weights.gross.kg == pytest.approx(1240.0 + 200.0 + payload_kg)
    assert weights.front_axle.kg + weights.rear_axle.kg == pytest.approx(weights.gross.kg)
    assert weights.gross.std_kg == pytest.approx(std_kg)


@given(payloads, positions)
def test_moments_about_the_rear_axle_balance(payload_kg: float, position_m: float) -> None:
    share_pct = front_share_pct(VAN, payload_kg, position_m)
    front_kg = axle_loads(VAN, payload_kg, 0.0, share_pct, 0.0).front_axle.kg
    levers = 0.52 * 1240.0 * 2.8 + payload_kg * (2.8 - position_m)
    assert front_kg == pytest.approx(levers / 2.8 + 90.0)


def test_an_unsprung_mass_follows_from_the_kerb_weight() -> None:
    kerb = paper_van(empty_front_share_pct=52.0, kerb_front_axle_kg=0.52 * 1240.0 + 90.0, kerb_rear_axle_kg=705.2)
    assert unsprung_kg(kerb) == pytest.approx((90.0, 110.0))


def test_unstated_figures_are_unknown_and_never_zero() -> None:
    half = paper_van(unsprung_front_kg=90.0)
    weights = axle_loads(half, 100.0, 5.0, 50.0, 0.5)
    assert weights.front_axle.is_known
    assert not weights.rear_axle.is_known
    assert not weights.gross.is_known
    assert math.isnan(weights.gross.std_kg)


def test_an_error_of_the_empty_share_moves_no_place() -> None:
    """It is in the share of the empty vehicle too, and drops out."""
    own = believed([270.0, 48.0], [8.0, 0.3], -0.6)
    with_empty_share = own.with_source(Source.EMPTY_SHARE, np.array([[0.0, 0.5]]))
    assert place_of(VAN, with_empty_share) == place_of(VAN, own)


@given(st.floats(-100.0, 100.0), st.floats(0.1, 50.0), shares)
def test_a_payload_that_may_be_zero_has_no_place(payload_kg: float, std_kg: float, share_pct: float) -> None:
    place = placed(VAN, payload_kg, std_kg, share_pct, 0.3)
    assert (place is None) == (payload_kg - Z95 * std_kg <= 0.0)


TRACKED = replace(VAN, track_width_m=1.5, empty_cg_left_m=0.02, front_wheel_limit_kg=500.0, rear_wheel_limit_kg=480.0)
WHEELS = ("front_left", "front_right", "rear_left", "rear_right")
offsets = st.floats(-0.5, 0.5)
roll_shares = st.floats(0.0, 1.0)


def on_wheels(payload_kg: float, share_pct: float, left_m: float, roll_share: float) -> Weights:
    posterior = believed([payload_kg, share_pct, left_m], [6.0, 0.3, 0.004], 0.1)
    return weights_of(TRACKED, posterior, Quantity(roll_share, 0.05))


@given(payloads, shares, offsets, roll_shares)
def test_wheels_carry_their_axles(payload_kg: float, share_pct: float, left_m: float, roll_share: float) -> None:
    weights = on_wheels(payload_kg, share_pct, left_m, roll_share)
    assert weights.front_left.kg + weights.front_right.kg == pytest.approx(weights.front_axle.kg)
    assert weights.rear_left.kg + weights.rear_right.kg == pytest.approx(weights.rear_axle.kg)
    assert sum(getattr(weights, wheel).kg for wheel in WHEELS) == pytest.approx(weights.gross.kg)


@given(payloads, shares, offsets, roll_shares)
def test_left_less_right_is_the_moment_and_the_axles_divide_it(
    payload_kg: float, share_pct: float, left_m: float, roll_share: float
) -> None:
    weights = on_wheels(payload_kg, share_pct, left_m, roll_share)
    front_kgm = 0.75 * (weights.front_left.kg - weights.front_right.kg)
    rear_kgm = 0.75 * (weights.rear_left.kg - weights.rear_right.kg)
    moment_kgm = (1240.0 + payload_kg) * left_m
    assert front_kgm + rear_kgm == pytest.approx(moment_kgm, abs=1e-6)
    assert front_kgm == pytest.approx(roll_share * moment_kgm, abs=1e-6)


@given(payloads, offsets)
def test_the_left_share_is_that_of_the_wheels_without_axles(payload_kg: float, left_m: float) -> None:
    bare = replace(TRACKED, unsprung_front_kg=0.0, unsprung_rear_kg=0.0)
    weights = weights_of(bare, exactly(payload_kg, 51.0, left_m), Quantity(0.6, 0.0))
    share_pct = 100.0 * (weights.front_left.kg + weights.rear_left.kg) / weights.gross.kg
    assert left_share_pct(left_m, 1.5) == pytest.approx(share_pct)


@given(st.floats(20.0, 800.0), positions, offsets)
def test_the_estimated_place_is_the_loaded_place(payload_kg: float, position_m: float, left_m: float) -> None:
    share_pct, whole_left_m = front_share_pct(TRACKED, payload_kg, position_m), cg_left_m(TRACKED, payload_kg, left_m)
    place = place_of(TRACKED, believed([payload_kg, share_pct, whole_left_m], [1.0, 0.0, 0.0]))
    assert (place.position_m, place.left_m) == pytest.approx((position_m, left_m), abs=1e-6)


def test_without_a_word_from_the_side_the_place_is_known_along_alone() -> None:
    place = placed(TRACKED, 270.0, 8.0, 48.0, 0.4)
    assert math.isfinite(place.std_m)
    assert [math.isnan(x) for x in (place.left_m, place.left_std_m, place.correlation)] == [True] * 3


ANSWER = Estimate(0, 0, "", roll_share_front=0.58, roll_share_front_std=0.05).answered(
    believed([270.0, 48.0, 0.08], [6.0, 0.3, 0.004])
)
WITHOUT_PLACE = believed([270.0, 48.0], [6.0, 0.3])
PAYLOAD_ALONE = Posterior(np.array([270.0]), np.array([[36.0]]))


@pytest.mark.parametrize(
    ("estimate", "vehicle", "lacks"),
    [
        (ANSWER, TRACKED, None),
        (ANSWER, None, Lack.CALIBRATION),
        (Estimate(0, 0, ""), TRACKED, Lack.ESTIMATE),
        (ANSWER, replace(TRACKED, unsprung_front_kg=None), Lack.UNSPRUNG_MASS),
        (ANSWER, replace(TRACKED, track_width_m=None), Lack.TRACK_WIDTH),
        (ANSWER.answered(WITHOUT_PLACE), TRACKED, Lack.ROLL_RATE),
        (replace(ANSWER, roll_share_front=math.nan), TRACKED, Lack.ROLL_RATE),
    ],
)
def test_an_unknown_wheel_names_the_missing_signal(
    estimate: Estimate, vehicle: Vehicle | None, lacks: Lack | None
) -> None:
    wheel = weighed(estimate, vehicle).weights.front_left
    assert wheel.lacks is lacks
    assert wheel.is_known is (lacks is None)
    assert math.isnan(wheel.std_kg) is (lacks is not None)
    assert wheel.limit_kg == (None if vehicle is None else 500.0)


def test_the_front_share_is_nothing_that_the_gross_weight_lacks() -> None:
    """It follows from the payload and what the axles weigh below their springs."""
    no_share = ANSWER.answered(PAYLOAD_ALONE)
    assert weighed(no_share, TRACKED).weights.gross.is_known
    weights = weighed(no_share, replace(TRACKED, unsprung_front_kg=None)).weights
    assert weights.gross.lacks is Lack.UNSPRUNG_MASS
    assert {weights.front_axle.lacks, weights.rear_axle.lacks, weights.front_left.lacks} == {Lack.ESTIMATE}


def test_an_unsure_roll_share_alone_makes_the_wheels_deviations_unknown() -> None:
    weights = weighed(replace(ANSWER, roll_share_front_std=math.nan), TRACKED).weights
    assert weights.front_left.is_known
    assert math.isnan(weights.front_left.std_kg)
    assert math.isfinite(weights.front_axle.std_kg)


def test_a_wheel_may_be_over_its_limit_where_its_axle_is_not() -> None:
    weights = weighed(ANSWER, replace(TRACKED, front_axle_limit_kg=900.0, front_wheel_limit_kg=450.0)).weights
    over = [place for place, one in weights.items() if one.limit_kg is not None and one.kg > one.limit_kg]
    assert over == ["front_left", "rear_left"]
