"""Runs left out of a fit: errors of the file and of the model, the limit of the misfit, how far a load lies beyond."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import stdtrit
from support.known_load_logs import write_known_loads

from gateway.calibration.calibrate import Outcome
from gateway.calibration.campaign import load_campaign
from gateway.calibration.half_car.left_out import (
    LEAST_PART,
    MISFIT_SCATTER,
    PRIOR_RUNS,
    USUAL_CG_LEFT_M,
    USUAL_FRONT_SHARE_PCT,
    USUAL_PAYLOAD_SHARE,
    USUAL_PER_REACH,
    RunError,
    model_error,
    most_misfit,
)
from gateway.calibration.judgement.assessment import judged_left_out
from gateway.calibration.ratio_index.regression import fit_regression
from gateway.calibration.ratio_index.table import index_rows
from gateway.core.cross_spectrum.estimator import MISFIT_ON_OTHER_ROADS, MISFIT_QUANTILE, most_misfit_at
from gateway.core.reach import beyond
from gateway.core.settings import BatchSettings
from gateway.core.vehicle import Load
from gateway.offline.campaigns import calibrate
from gateway.quantity import Z95

FEW = ((0.0, None), (150.0, 0.5), (200.0, 2.6))
LOADS = ((0.0, None), (0.0, None), (400.0, 0.5), (400.0, 0.5), (400.0, 2.4), (400.0, 2.4))  # none beyond the others


@pytest.fixture(scope="module")
def outcome(tmp_path_factory: pytest.TempPathFactory) -> Outcome:
    campaign = load_campaign(write_known_loads(tmp_path_factory.mktemp("left_out"), LOADS, duration_s=450.0))
    return calibrate(campaign, BatchSettings(), estimators=("ratio_index",))


def errors_kg(outcome: Outcome) -> np.ndarray:
    judged = judged_left_out(outcome, "ratio_index")
    return np.array([one.estimate.payload.number - one.payload_kg for one in judged if one.estimate.counted])


def test_errors_are_those_the_file_expects(outcome: Outcome) -> None:
    expected = outcome.file.expected_errors["ratio_index"].payload_rms_kg
    assert np.sqrt(np.mean(errors_kg(outcome) ** 2)) == pytest.approx(expected, rel=1e-9)


def test_every_run_is_judged_once_a_batch_with_an_interval_about_its_answer(outcome: Outcome) -> None:
    judged = [one for one in judged_left_out(outcome, "ratio_index") if one.estimate.counted]
    assert [one.run for one in judged] == [1, 2, 3, 4, 5, 6]
    for one in judged:
        low, high = one.estimate.payload.interval95
        assert (low + high) / 2.0 == pytest.approx(one.estimate.payload.number)
        assert high - low > 0.0


def test_where_no_choice_can_be_made_anew_bands_and_terms_stay(tmp_path: Path) -> None:
    """Three runs: the error of each is that of the same regression fitted to the other two."""
    campaign = load_campaign(write_known_loads(tmp_path, FEW, duration_s=150.0))
    few = calibrate(campaign, BatchSettings(window_s=100.0), estimators=("ratio_index",))
    fit = few.ratio_index
    rows = index_rows([one.identification for one in few.split], fit.calibration)
    again = fit_regression(fit.calibration.payload.terms, rows.ra, rows.rg, rows.payload_kg, rows.run)
    assert errors_kg(few) == pytest.approx(again.held_out_errors, rel=1e-4, abs=1e-3)
    bands = {(one.acceleration_bands, one.pitch_rate_bands) for one in fit.without.values()}
    assert bands == {(fit.calibration.acceleration_bands, fit.calibration.pitch_rate_bands)}


def test_two_runs_leave_nothing_to_learn_from(outcome: Outcome) -> None:
    assert judged_left_out(replace(outcome, cross_spectrum=None), "cross_spectrum") == []


def test_the_logs_are_of_the_campaign(outcome: Outcome) -> None:
    assert {Path(run.log).name for run in outcome.file.provenance.runs} == {f"0{n}.log" for n in range(1, 7)}


STATED_RATE = 1e-3


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


ROUND_KG = 1000.0


def placed(front_kg: float, rear_kg: float) -> Load:
    """The load of a vehicle that presses so on its axles."""
    whole_kg = front_kg + rear_kg
    return Load(whole_kg - ROUND_KG, 100.0 * front_kg / whole_kg)


TRIANGLE = [placed(500, 500), placed(500, 900), placed(900, 500)]


@given(st.tuples(*[st.floats(0.02, 1.0)] * 3))
def test_a_mixture_of_known_loads_is_not_beyond_them(parts: tuple[float, float, float]) -> None:
    share = np.array(parts) / sum(parts)
    front_kg = float(share @ [500, 500, 900])
    rear_kg = float(share @ [500, 900, 500])
    assert beyond(placed(front_kg, rear_kg), TRIANGLE, ROUND_KG) == 0.0


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
    assert beyond(load, TRIANGLE, ROUND_KG) == pytest.approx(distance, rel=1e-3)


def test_a_single_load_and_loads_in_a_row_have_distances_too() -> None:
    assert beyond(placed(530, 540), TRIANGLE[:1], ROUND_KG) == pytest.approx(0.05, rel=1e-3)
    assert beyond(placed(600, 700), TRIANGLE[:2], ROUND_KG) == pytest.approx(0.1, rel=1e-3)
    assert beyond(placed(530, 540), [], ROUND_KG) == 0.0
