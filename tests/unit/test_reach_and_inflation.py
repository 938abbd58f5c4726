"""How far a load lies beyond the known ones, and what left-out runs say of intervals there."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.calibration.half_car.inflation import LEAST, UNTESTED, inflation_of
from gateway.core.cross_spectrum.reach import beyond
from gateway.core.vehicle import Load

EMPTY_KG = 1000.0


def placed(front_kg: float, rear_kg: float) -> Load:
    """The load of a vehicle that presses so on its axles."""
    whole_kg = front_kg + rear_kg
    return Load(whole_kg - EMPTY_KG, 100.0 * front_kg / whole_kg)


TRIANGLE = [placed(500, 500), placed(500, 900), placed(900, 500)]


@given(st.tuples(*[st.floats(0.02, 1.0)] * 3))
def test_a_mixture_of_known_loads_is_not_beyond_them(parts: tuple[float, float, float]) -> None:
    share = np.array(parts) / sum(parts)
    front_kg = float(share @ [500, 500, 900])
    rear_kg = float(share @ [500, 900, 500])
    assert beyond(placed(front_kg, rear_kg), TRIANGLE, EMPTY_KG) == 0.0


@pytest.mark.parametrize(
    ("load", "distance"),
    [
        (placed(400, 500), 0.1),  # 100 kg off the edge of 1000
        (placed(500, 1000), 0.1),
        (placed(900, 900), 0.4 / np.sqrt(2.0)),  # off the hypotenuse
        (placed(470, 460), 0.05),  # off the corner: 30 and 40 kg
    ],
)
def test_the_distance_is_that_in_the_plane_of_axle_loads(load: Load, distance: float) -> None:
    assert beyond(load, TRIANGLE, EMPTY_KG) == pytest.approx(distance, rel=1e-3)


def test_a_single_load_and_loads_in_a_row_have_distances_too() -> None:
    assert beyond(placed(530, 540), TRIANGLE[:1], EMPTY_KG) == pytest.approx(0.05, rel=1e-3)
    assert beyond(placed(600, 700), TRIANGLE[:2], EMPTY_KG) == pytest.approx(0.1, rel=1e-3)
    assert beyond(placed(530, 540), [], EMPTY_KG) == 0.0


def test_among_known_loads_the_intervals_are_those_their_errors_ask_for() -> None:
    z = np.random.default_rng(1).normal(0.0, 2.0, 20_000)
    found = inflation_of(z, np.zeros(len(z)))
    assert found.within == pytest.approx(2.0, rel=0.02)
    assert found.per_reach == 0.0


def test_intervals_never_shrink() -> None:
    assert inflation_of(np.full(10, 0.1), np.zeros(10)).within == LEAST


def test_errors_beyond_the_known_loads_widen_nothing_among_them() -> None:
    within = np.random.default_rng(2).normal(0.0, 1.5, 200)
    beyond_them = np.full(4, 12.0)
    z = np.r_[within, beyond_them]
    reach = np.r_[np.zeros(200), np.full(4, 0.2)]
    found, calm = inflation_of(z, reach), inflation_of(within, np.zeros(200))
    assert found.within == calm.within
    assert found.within * (1.0 + found.per_reach * 0.2) == pytest.approx(12.0 / 1.645)


def test_where_none_lies_among_the_others_only_the_growth_is_known() -> None:
    found = inflation_of(np.array([0.5, 4.0, 1.0, 6.0]), np.full(4, 0.1))
    assert found.within == UNTESTED
    assert found.per_reach > 0.0
    assert inflation_of(np.array([0.5, -0.4]), np.full(2, 0.1)).per_reach == 0.0
