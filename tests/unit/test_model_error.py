"""The error of the model from runs left out: few runs believe other vans, many believe themselves."""

import numpy as np
import pytest
from scipy.special import stdtrit

from gateway.calibration.half_car.left_out import (
    LEAST_PART,
    PRIOR_RUNS,
    USUAL_CG_LEFT_M,
    USUAL_FRONT_SHARE_PCT,
    USUAL_PAYLOAD_SHARE,
    USUAL_PER_REACH,
    RunError,
    model_error,
)
from gateway.quantity import Z95

EMPTY_KG = 1240.0
USUAL = np.array([USUAL_PAYLOAD_SHARE * EMPTY_KG, USUAL_FRONT_SHARE_PCT, USUAL_CG_LEFT_M])


def runs(n: int, std: float, *, predicted: float = 0.0, reach: float = 0.0, seed: int = 1) -> list[RunError]:
    """Errors of the model that are ``std`` times the usual, beside what was predicted, in usual variances."""
    scatter = USUAL * np.sqrt(std**2 + predicted)
    errors = np.random.default_rng(seed).standard_normal((n, 3)) * scatter
    return [RunError(error, predicted * USUAL**2, reach) for error in errors]


def wider(n: int) -> float:
    return float(stdtrit(PRIOR_RUNS + n, 0.975)) / Z95


def test_without_a_run_it_is_the_usual_with_students_t() -> None:
    found = model_error([], EMPTY_KG)
    assert found.std == pytest.approx(tuple(wider(0) * USUAL))
    assert found.per_reach == (USUAL_PER_REACH, USUAL_PER_REACH)


@pytest.mark.parametrize("std", [1.0, 2.0, 5.0])
def test_many_runs_show_their_own_variance(std: float) -> None:
    found = model_error(runs(5000, std), EMPTY_KG)
    assert found.std == pytest.approx(tuple(std * USUAL), rel=0.05)


def test_what_was_predicted_is_no_error_of_the_model() -> None:
    found = model_error(runs(5000, 2.0, predicted=4.0), EMPTY_KG)
    assert found.std == pytest.approx(tuple(2.0 * USUAL), rel=0.08)


def test_a_campaign_without_errors_shows_less_than_there_is() -> None:
    found = model_error(runs(5000, 0.1, predicted=1.0), EMPTY_KG)
    assert found.std == pytest.approx(tuple(np.sqrt(LEAST_PART) * USUAL), rel=0.02)


def test_so_many_runs_as_the_prior_has_count_as_much() -> None:
    one = RunError(3.0 * USUAL, np.zeros(3), 0.0)
    found = model_error([one] * PRIOR_RUNS, EMPTY_KG)
    assert found.std == pytest.approx(tuple(wider(PRIOR_RUNS) * np.sqrt((1.0 + 9.0) / 2.0) * USUAL))


def test_a_place_that_nobody_noted_teaches_nothing_of_places() -> None:
    unknown = [RunError(np.array([*one.error[:2], np.nan]), one.predicted, 0.0) for one in runs(50, 4.0)]
    found = model_error(unknown, EMPTY_KG)
    assert found.std[2] == pytest.approx(wider(0) * USUAL_CG_LEFT_M)
    assert found.std[0] > 2.0 * USUAL[0]


def test_runs_beyond_the_others_show_growth_and_nothing_else() -> None:
    within = runs(200, 1.0)
    found, calm = (model_error([*within, *runs(200, std, reach=0.2, seed=2)], EMPTY_KG) for std in (6.0, 1.0))
    assert found.std == calm.std
    assert found.per_reach[0] > calm.per_reach[0]


def test_stated_intervals_hold_new_errors_of_the_same_vehicle() -> None:
    """Vans whose model errors differ, a few runs each: 95 % of the errors of a next run lie within."""
    rng = np.random.default_rng(3)
    held = []
    for _ in range(4000):
        std = 1.0 / np.sqrt(rng.chisquare(PRIOR_RUNS) / PRIOR_RUNS)  # as the prior has it
        errors = rng.standard_normal((5, 3)) * std * USUAL
        found = model_error([RunError(error, np.zeros(3), 0.0) for error in errors[1:]], EMPTY_KG)
        held.append(abs(errors[0, 0]) <= Z95 * found.std[0])
    assert np.mean(held) == pytest.approx(0.95, abs=0.015)
