"""How badly a batch may fit before its answer is refused: a healthy vehicle is refused at the stated rate."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import ndtri

from gateway.calibration.half_car.left_out import MISFIT_SCATTER, most_misfit
from gateway.core.cross_spectrum.estimator import MISFIT_ON_OTHER_ROADS, MISFIT_QUANTILE, most_misfit_at

STATED_RATE = 1e-3


def test_the_quantile_is_that_of_the_stated_rate() -> None:
    assert pytest.approx(float(ndtri(1.0 - STATED_RATE)), abs=0.005) == MISFIT_QUANTILE


def test_a_healthy_vehicle_exceeds_it_at_the_stated_rate() -> None:
    """Many calibrations of ten batches each, and for each a batch on a road of its own."""
    rng = np.random.default_rng(3)
    n, level, scatter = 4000, 0.75, MISFIT_SCATTER
    shown = level * np.exp(scatter * rng.standard_normal((n, 10)))
    limits = np.array([most_misfit(list(row)) for row in shown])
    on_the_road = level * np.exp(math.hypot(scatter, MISFIT_ON_OTHER_ROADS) * rng.standard_normal((50, n)))
    assert np.mean(on_the_road > limits) == pytest.approx(STATED_RATE, rel=0.4)


def test_a_calibration_whose_batches_scatter_more_is_believed_further() -> None:
    even, uneven = [0.7, 0.72, 0.71, 0.69], [0.5, 1.0, 0.6, 0.85]
    assert most_misfit(uneven) / np.exp(np.mean(np.log(uneven))) > most_misfit(even) / np.exp(np.mean(np.log(even)))


@given(st.lists(st.floats(0.1, 10.0), min_size=1, max_size=20), st.floats(0.1, 10.0))
def test_it_scales_with_the_misfit(misfits: list[float], by: float) -> None:
    assert most_misfit([by * one for one in misfits]) == pytest.approx(by * most_misfit(misfits), rel=1e-5)


def test_batches_beyond_the_known_loads_do_not_count() -> None:
    assert most_misfit([0.7, math.nan, 0.8]) == most_misfit([0.7, 0.8])
    assert math.isnan(most_misfit([math.nan]))


def test_it_rises_away_from_the_roads_and_speeds_of_calibration() -> None:
    assert most_misfit_at(1.3, 1.0) == 1.3
    assert math.log(most_misfit_at(1.3, 2.0) / 1.3) == pytest.approx(MISFIT_QUANTILE * MISFIT_ON_OTHER_ROADS)
