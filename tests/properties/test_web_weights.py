"""Weights obey statics: axles add up to the whole, loads move where the payload is, errors add as they must."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.vehicle import Vehicle, front_share_pct
from gateway.core.weights import RELEASE_SHARE, Place, Weights, is_over_limit, place_of, unsprung_kg, weights_of
from gateway.estimate import Z95, Quantity
from gateway.records import F64

VAN = Vehicle("van", 1240.0, 2.8, empty_front_share_pct=52.0, unsprung_front_kg=90.0, unsprung_rear_kg=110.0)

payloads = st.floats(0.0, 800.0)
positions = st.floats(-0.5, 3.5)
shares = st.floats(20.0, 80.0)
deviations = st.floats(0.0, 50.0)


def weighed(
    vehicle: Vehicle, kg: float, std_kg: float, share_pct: float, share_std_pct: float, correlation: float = 0.0
) -> Weights:
    return weights_of(vehicle, Quantity(kg, std_kg), Quantity(share_pct, share_std_pct), correlation)


def placed(
    vehicle: Vehicle, kg: float, std_kg: float, share_pct: float, share_std_pct: float, correlation: float = 0.0
) -> Place | None:
    return place_of(vehicle, Quantity(kg, std_kg), Quantity(share_pct, share_std_pct), correlation)


@given(payloads, deviations, shares, st.floats(0.0, 3.0))
def test_the_axles_carry_the_whole(payload_kg: float, std_kg: float, share_pct: float, share_std_pct: float) -> None:
    weights = weighed(VAN, payload_kg, std_kg, share_pct, share_std_pct)
    assert weights.gross.kg == pytest.approx(1240.0 + 200.0 + payload_kg)
    assert weights.front_axle.kg + weights.rear_axle.kg == pytest.approx(weights.gross.kg)
    assert weights.gross.std_kg == std_kg


@given(payloads, positions)
def test_moments_about_the_rear_axle_balance(payload_kg: float, position_m: float) -> None:
    share_pct = front_share_pct(VAN, payload_kg, position_m)
    front_kg = weighed(VAN, payload_kg, 0.0, share_pct, 0.0).front_axle.kg
    levers = 0.52 * 1240.0 * 2.8 + payload_kg * (2.8 - position_m)
    assert front_kg == pytest.approx(levers / 2.8 + 90.0)


@given(payloads, shares)
def test_the_front_share_is_of_the_sprung_mass(payload_kg: float, share_pct: float) -> None:
    weights = weighed(VAN, payload_kg, 0.0, share_pct, 0.0)
    sprung_kg = 1240.0 + payload_kg
    assert weights.front_axle.kg - 90.0 == pytest.approx(share_pct / 100.0 * sprung_kg)
    assert weights.rear_axle.kg - 110.0 == pytest.approx((1.0 - share_pct / 100.0) * sprung_kg)


def draws(payload_std_kg: float, share_pct: float, share_std_pct: float, correlation: float) -> tuple[F64, F64]:
    """Payloads about 270 kg and shares whose errors go together."""
    common = correlation * payload_std_kg * share_std_pct
    covariance = [[payload_std_kg**2, common], [common, share_std_pct**2]]
    drawn = np.random.default_rng(7).multivariate_normal([270.0, share_pct], covariance, 20_000)
    return drawn[:, 0], drawn[:, 1]


@pytest.mark.parametrize("correlation", [0.0, -0.97, 0.93])
def test_deviations_are_those_of_many_draws(correlation: float) -> None:
    payload_kg, share_pct = draws(8.0, 48.0, 0.4, correlation)
    drawn = [weighed(VAN, p, 0.0, s, 0.0) for p, s in zip(payload_kg, share_pct, strict=True)]
    told = weighed(VAN, 270.0, 8.0, 48.0, 0.4, correlation)
    for name in ("gross", "front_axle", "rear_axle"):
        spread = float(np.std([getattr(weights, name).kg for weights in drawn]))
        assert getattr(told, name).std_kg == pytest.approx(spread, rel=0.03)


def test_an_unsprung_mass_follows_from_the_kerb_weight() -> None:
    kerb = Vehicle("van", 1240.0, 2.8, 52.0, kerb_front_axle_kg=0.52 * 1240.0 + 90.0, kerb_rear_axle_kg=705.2)
    assert unsprung_kg(kerb) == pytest.approx((90.0, 110.0))


def test_what_is_not_stated_is_unknown_and_never_zero() -> None:
    half = Vehicle("van", 1240.0, 2.8, unsprung_front_kg=90.0)
    weights = weighed(half, 100.0, 5.0, 50.0, 0.5)
    assert weights.front_axle.is_known
    assert not weights.rear_axle.is_known
    assert not weights.gross.is_known
    assert math.isnan(weights.gross.std_kg)


@given(st.lists(st.floats(1500.0, 2500.0), max_size=30), st.floats(1800.0, 2200.0))
def test_a_warning_has_hysteresis(series_kg: list[float], limit_kg: float) -> None:
    was_over = False
    for n in range(1, len(series_kg) + 1):
        is_over = is_over_limit(series_kg[:n], limit_kg)
        newest_kg = series_kg[n - 1]
        if newest_kg > limit_kg:
            assert is_over
        elif newest_kg <= limit_kg * (1.0 - RELEASE_SHARE):
            assert not is_over
        else:
            assert is_over is was_over
        was_over = is_over


def test_an_unknown_weight_changes_no_warning() -> None:
    assert is_over_limit([2100.0, math.nan], 2000.0)
    assert not is_over_limit([math.nan], 2000.0)
    assert not is_over_limit([], 2000.0)
    assert not is_over_limit([9999.0], None)


@given(st.floats(20.0, 800.0), positions)
def test_the_place_told_is_the_place_loaded(payload_kg: float, position_m: float) -> None:
    place = placed(VAN, payload_kg, 1.0, front_share_pct(VAN, payload_kg, position_m), 0.0)
    assert place is not None
    assert place.position_m == pytest.approx(position_m, abs=1e-6)


@pytest.mark.parametrize("correlation", [0.0, -0.9, 0.9])
def test_the_deviation_of_the_place_is_that_of_many_draws(correlation: float) -> None:
    share_pct = front_share_pct(VAN, 270.0, 1.3)
    pairs = zip(*draws(8.0, share_pct, 0.3, correlation), strict=True)
    drawn = [place.position_m for p, s in pairs if (place := placed(VAN, p, 0.0, s, 0.0)) is not None]
    exact = replace(VAN, empty_front_share_std_pct=0.0)
    told = placed(exact, 270.0, 8.0, share_pct, 0.3, correlation)
    assert told is not None
    assert told.std_m == pytest.approx(float(np.std(drawn)), rel=0.03)


@given(st.floats(-100.0, 100.0), st.floats(0.1, 50.0), shares)
def test_what_may_not_be_there_has_no_place(payload_kg: float, std_kg: float, share_pct: float) -> None:
    place = placed(VAN, payload_kg, std_kg, share_pct, 0.3)
    assert (place is None) == (payload_kg - Z95 * std_kg <= 0.0)
