"""How far a load lies beyond the known ones."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

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
