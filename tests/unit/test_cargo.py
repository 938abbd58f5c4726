"""The shape of a load: what is believed of it before it is weighed."""

from dataclasses import replace
from math import exp, log

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.paper_van import paper_van

from gateway.core.cargo import (
    BODY_MASS_PART,
    FLOOR_BELOW_BODY_M,
    SPREAD_PART,
    Carries,
    ShapeHypothesis,
    is_said,
    shape_hypotheses,
)

VAN = paper_van()
KNOWN_S_M2 = 0.07  # a box of 0.8 m by 0.5 m


def kinds(**said: object) -> tuple[ShapeHypothesis, ...]:
    return shape_hypotheses(replace(VAN, **said), KNOWN_S_M2, 0.2)  # type: ignore[arg-type] # any field


def believed(**said: object) -> ShapeHypothesis:
    """The believed shape of loads that the fitter stated, or that are spread out."""
    return kinds(**said)[-1]


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
    found = kinds(**said)
    assert sum(one.probability for one in found) == pytest.approx(1.0)
    assert all(one.probability > 0.0 and one.std > 0.0 for one in found)


def test_s_of_a_box_by_hand() -> None:
    """2 m long and 1 m high on a floor 0.15 m below the body's centre: its own centre lies 0.35 m above that."""
    by_hand = (2.0**2 + 1.0**2) / 12.0 + 0.8 * 0.35**2
    assert (FLOOR_BELOW_BODY_M, BODY_MASS_PART) == (0.15, 0.8)
    assert exp(believed(payload_length_m=2.0, payload_height_m=1.0).log_s) == pytest.approx(by_hand, rel=0.05)


def test_stated_shapes_are_known_better_than_others() -> None:
    assert believed(payload_length_m=0.8, payload_height_m=0.5).std < 0.7 * believed().std
    assert (is_said(VAN), is_said(replace(VAN, payload_length_m=0.8))) == (False, True)
    assert (is_said(replace(VAN, carries=Carries.MIXED)), is_said(replace(VAN, carries=Carries.PARCELS))) == (
        False,
        True,
    )


def test_unstated_shapes_are_half_like_known_loads_and_half_longer() -> None:
    compact, spread = kinds()
    assert (compact.probability, spread.probability) == (1.0 - SPREAD_PART, SPREAD_PART)
    assert exp(compact.log_s) == pytest.approx(KNOWN_S_M2)
    assert exp(spread.log_s) > 0.3


def test_a_floor_is_as_long_as_its_vehicle() -> None:
    small, large = (believed(carries=Carries.PARCELS, wheelbase_m=each) for each in (2.4, 4.0))
    assert large.log_s - small.log_s == pytest.approx(2.0 * log(4.0 / 2.4), abs=0.4)


@pytest.mark.parametrize("where", ["roof_rack", "tow_bar"])
def test_a_rack_or_a_tow_bar_makes_larger_shapes_likely(where: str) -> None:
    without, with_it = believed(payload_length_m=1.0), believed(payload_length_m=1.0, **{where: True})
    assert with_it.log_s > without.log_s
    assert with_it.std > without.std
