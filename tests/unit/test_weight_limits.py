"""Limits: whose count, and how probable it is that a weight is over one."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.vehicle import Vehicle
from gateway.core.weights import Limits, over_limit_probability

KG = st.floats(0.0, 50_000.0)
STD_KG = st.floats(0.01, 500.0)


@pytest.mark.parametrize(
    ("n_std_below", "probability"),
    [(0.0, 0.5), (1.0, 0.158655), (-1.0, 0.841345), (1.959964, 0.025), (-1.959964, 0.975), (3.0, 0.001350)],
)
def test_the_probability_is_the_tables(n_std_below: float, probability: float) -> None:
    """Abramowitz and Stegun, table 26.1."""
    found = over_limit_probability(2000.0 - n_std_below * 12.0, 12.0, 2000.0)
    assert found == pytest.approx(probability, abs=1e-6)


@given(KG, STD_KG, KG, st.floats(0.0, 100.0))
def test_more_weight_is_never_less_probable_to_be_too_much(
    kg: float, std_kg: float, limit_kg: float, more_kg: float
) -> None:
    less, more = (over_limit_probability(x, std_kg, limit_kg) for x in (kg, kg + more_kg))
    assert 0.0 <= less <= more <= 1.0


@given(STD_KG, KG, st.floats(-100.0, 100.0))
def test_as_far_above_is_as_probable_as_it_is_not_below(std_kg: float, limit_kg: float, by_kg: float) -> None:
    above, below = (over_limit_probability(limit_kg + x, std_kg, limit_kg) for x in (by_kg, -by_kg))
    assert above + below == pytest.approx(1.0, abs=1e-9)


def test_a_weight_without_error_is_over_or_is_not() -> None:
    assert over_limit_probability(2000.1, 0.0, 2000.0) == 1.0
    assert over_limit_probability(2000.0, 0.0, 2000.0) == 0.0


@pytest.mark.parametrize(("kg", "std_kg", "limit_kg"), [(1.0, 1.0, None), (math.nan, 1.0, 2.0), (1.0, math.nan, 2.0)])
def test_nothing_known_makes_no_probability(kg: float, std_kg: float, limit_kg: float | None) -> None:
    assert math.isnan(over_limit_probability(kg, std_kg, limit_kg))


def test_what_is_stated_stands_before_the_vehicles_own() -> None:
    vehicle = Vehicle("v", 1240.0, 2.8, gross_limit_kg=2000.0, rear_axle_limit_kg=1100.0)
    limited = Limits(gross_limit_kg=1900.0, front_wheel_limit_kg=500.0).on(vehicle)
    assert Limits.of(limited) == Limits(gross_limit_kg=1900.0, rear_axle_limit_kg=1100.0, front_wheel_limit_kg=500.0)
    assert Limits().on(vehicle) == vehicle
