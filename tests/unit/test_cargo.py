"""What is believed of the shape of a load, from what the fitter said."""

from dataclasses import replace
from math import exp, log

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.cargo import (
    BODY_MASS_PART,
    FLOOR_BELOW_BODY_M,
    ROOF_ABOVE_FLOOR_LOAD_M,
    Carries,
    ShapePrior,
    is_said,
    shape_prior,
)
from gateway.core.vehicle import Vehicle

VAN = Vehicle(name="van", empty_mass_kg=1240.0, wheelbase_m=2.8, sensor_position_m=0.0)
KNOWN_S_M2 = 0.07  # a box of 0.8 m by 0.5 m


def believed(**said: object) -> ShapePrior:
    return shape_prior(replace(VAN, **said), KNOWN_S_M2, 0.2)  # type: ignore[arg-type] # any field


statements = st.fixed_dictionaries(
    {},
    optional={
        "payload_length_m": st.floats(0.3, 4.0),
        "payload_height_m": st.floats(0.2, 2.0),
        "carries": st.sampled_from(Carries),
        "roof_rack": st.booleans(),
        "tow_bar": st.booleans(),
        "wheelbase_m": st.floats(2.2, 4.5),
    },
)


@given(statements)
def test_probabilities_add_up_to_one(said: dict[str, object]) -> None:
    found = believed(**said)
    assert found.probability.sum() == pytest.approx(1.0)
    assert found.probability.min() >= 0.0
    assert np.all(np.diff(found.log_s) > 0.0)
    assert found.variance > 0.0
    assert 0.0 <= found.habit <= 1.0


@given(st.floats(0.3, 3.5), st.floats(1.05, 1.5))
def test_a_longer_statement_moves_its_mean_up(length_m: float, factor: float) -> None:
    short, long = (believed(payload_length_m=each) for each in (length_m, factor * length_m))
    assert long.mean > short.mean


def test_a_higher_statement_moves_its_mean_up() -> None:
    low, high = (believed(payload_length_m=1.2, payload_height_m=each) for each in (0.5, 1.4))
    assert high.mean > low.mean


def test_s_of_a_box_by_hand() -> None:
    """2 m long and 1 m high on a floor 0.15 m below the body's centre: its own centre lies 0.35 m above that."""
    by_hand = (2.0**2 + 1.0**2) / 12.0 + 0.8 * 0.35**2
    assert (FLOOR_BELOW_BODY_M, BODY_MASS_PART) == (0.15, 0.8)
    found = believed(payload_length_m=2.0, payload_height_m=1.0)
    assert exp(found.mean) == pytest.approx(by_hand, rel=0.05)
    median = np.interp(0.5, np.cumsum(found.probability), found.log_s)
    assert exp(median) == pytest.approx(by_hand, rel=0.05)


def test_what_is_stated_is_known_better_than_what_is_not() -> None:
    unsaid, said = believed(), believed(payload_length_m=0.8, payload_height_m=0.5)
    assert said.variance < 0.5 * unsaid.variance
    assert (is_said(VAN), is_said(replace(VAN, payload_length_m=0.8))) == (False, True)
    assert (is_said(replace(VAN, carries=Carries.MIXED)), is_said(replace(VAN, carries=Carries.PARCELS))) == (
        False,
        True,
    )


def test_what_nobody_said_is_half_like_the_known_loads_and_half_longer() -> None:
    """Two humps: the known loads' shape has its share, and loads all over the floor have theirs."""
    found = believed()
    near_known = found.probability[np.abs(found.log_s - log(KNOWN_S_M2)) < 0.9].sum()
    long = found.probability[found.log_s > log(0.3)].sum()
    assert 0.35 < near_known < 0.65
    assert 0.25 < long < 0.6


def test_goods_are_in_order_of_their_length() -> None:
    means = {kind: believed(carries=kind).mean for kind in Carries}
    assert means[Carries.PALLETS] < means[Carries.PARCELS] < means[Carries.LONG_GOODS]


def test_a_floor_is_as_long_as_its_vehicle() -> None:
    small, large = (believed(carries=Carries.PARCELS, wheelbase_m=each) for each in (2.4, 4.0))
    assert large.mean - small.mean == pytest.approx(2.0 * log(4.0 / 2.4), abs=0.4)


@pytest.mark.parametrize("where", ["roof_rack", "tow_bar"])
def test_a_rack_or_a_tow_bar_makes_larger_shapes_likely(where: str) -> None:
    without, with_it = believed(payload_length_m=1.0), believed(payload_length_m=1.0, **{where: True})
    assert with_it.mean > without.mean
    far = log(1.0 / 12.0 + 0.5 * 0.24 * ROOF_ABOVE_FLOOR_LOAD_M**2)
    assert with_it.probability[with_it.log_s > far].sum() > without.probability[without.log_s > far].sum()
