"""A mass on a soft support: the slope of the model towards it, and the verdict on it."""

import numpy as np
import pytest

from gateway.core.cross_spectrum.model.motion import Frame, Motion, Numbers
from gateway.core.cross_spectrum.soft_mass import DAMPING_RATIO, RESONANCES_HZ, SoftMass, _felt

FREQ_HZ = np.linspace(1.0, 14.0, 40)
WHEELBASE_M = 2.7
BEHIND_M = 3.6
AXLE = (40e3, 3e3, 500e3, 400e3, 80.0)


def van(*carried_kg: float, mode_hz: float = 25.0) -> Motion:
    """A van with a load (front-front, rear-rear, front-rear) on a floor of this frequency."""
    numbers = Numbers.of(AXLE, AXLE, (600.0, 640.0, 40.0), carried_kg, (mode_hz, DAMPING_RATIO), (1.6, 0.002))
    return Motion(numbers, Frame(WHEELBASE_M), FREQ_HZ, n_sensors=2)


@pytest.mark.parametrize("which", range(len(RESONANCES_HZ)))
def test_its_slope_is_that_of_a_small_load_that_swings_there(which: int) -> None:
    """A tenth of a gram on a floor of that frequency, at the same place, moves the sensors by that slope."""
    rear = BEHIND_M / WHEELBASE_M
    front = 1.0 - rear
    small_kg = 1e-4
    swinging = van(*(small_kg * np.array([front**2, rear**2, front * rear])), mode_hz=RESONANCES_HZ[which])
    empty = van(0.0, 0.0, 0.0)
    slope = empty.by_suspended_mass(BEHIND_M, _felt(FREQ_HZ))[which]
    moved = (swinging.paths - empty.paths) / small_kg
    assert np.abs(slope - moved).max() < 1e-5 * np.abs(moved).max()


def test_a_mass_that_does_not_swing_is_a_rigid_one() -> None:
    rear = BEHIND_M / WHEELBASE_M
    front = 1.0 - rear
    empty = van(0.0, 0.0, 0.0)
    by_rigid = empty.slopes([10, 11, 12])  # the three masses of the body
    expected = front**2 * by_rigid[0] + rear**2 * by_rigid[1] + front * rear * by_rigid[2]
    assert np.allclose(empty.by_suspended_mass(BEHIND_M, np.ones((1, len(FREQ_HZ))))[0], expected, rtol=1e-9)


@pytest.mark.parametrize(
    ("kg", "score", "is_there"),
    [(31.0, 10.7, True), (5.0, 5.8, False), (12.0, 3.1, False), (-20.0, 8.0, False)],
)
def test_it_is_there_where_chance_does_not_explain_it_and_it_is_heavy_enough(
    kg: float, score: float, is_there: bool
) -> None:
    assert SoftMass(kg, 3.0, score).is_there == is_there
