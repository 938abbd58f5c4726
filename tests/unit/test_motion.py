"""The equations of motion: how their solution changes with each number in them, against central differences."""

import numpy as np
import pytest
from support.half_car_road import CAR
from support.rolling_car import HALF_TRACK_M, ROLLING_CAR

from gateway.core.cross_spectrum.model.half_car import half_car_numbers
from gateway.core.cross_spectrum.model.motion import Frame, Motion, Numbers
from gateway.core.cross_spectrum.model.rolling_car import SidewaysLoad, rolling_numbers

FREQ_HZ = np.array([0.7, 1.4, 3.3, 9.0, 13.0])
UPRIGHT = half_car_numbers(CAR, 300.0, 0.47), Frame(CAR.wheelbase_m), 2
ROLLING = rolling_numbers(ROLLING_CAR, SidewaysLoad(300.0, 0.47, 0.06)), Frame(CAR.wheelbase_m, HALF_TRACK_M), 3


@pytest.mark.parametrize(("numbers", "frame", "n_sensors"), [UPRIGHT, ROLLING], ids=["upright", "rolling"])
def test_slopes_are_what_a_small_change_of_each_number_does(numbers: Numbers, frame: Frame, n_sensors: int) -> None:
    every = range(len(numbers.all))
    slopes = Motion(numbers, frame, FREQ_HZ, n_sensors).slopes(every)
    for i in every:
        step = np.zeros_like(numbers.all)
        step[i] = 1e-5 * max(abs(numbers.all[i, 0]), 0.1)
        up, down = (Motion(Numbers(numbers.all + by), frame, FREQ_HZ, n_sensors).paths for by in (step, -step))
        expected = (up - down) / (2.0 * step[i])
        np.testing.assert_allclose(slopes[i], expected, rtol=1e-5, atol=1e-7 * np.abs(expected).max())


def test_wanted_slopes_are_those_of_all() -> None:
    numbers, frame, n_sensors = ROLLING
    motion = Motion(numbers, frame, FREQ_HZ, n_sensors)
    wanted = [1, 5, 9, 14, 17, 25, 29, 31]
    np.testing.assert_array_equal(motion.slopes(wanted), motion.slopes(range(len(numbers.all)))[wanted])
