"""Every run judged by what the other runs teach: the errors are those the calibration file expects."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.known_load_logs import write_known_loads

from gateway.calibration.calibrate import Outcome
from gateway.calibration.campaign import load_campaign
from gateway.calibration.judgement.assessment import judged_left_out
from gateway.calibration.ratio_index.regression import fit_regression
from gateway.calibration.ratio_index.table import index_rows
from gateway.core.settings import BatchSettings
from gateway.offline.campaigns import calibrate

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
    assert fit is not None
    assert fit.calibration.payload is not None
    rows = index_rows([one.identification for one in few.split], fit.calibration)
    again = fit_regression(fit.calibration.payload.terms, rows.ra, rows.rg, rows.payload_kg, rows.run)
    assert errors_kg(few) == pytest.approx(again.held_out_errors, rel=1e-4, abs=1e-3)
    bands = {(one.acceleration_bands, one.pitch_rate_bands) for one in fit.without.values()}
    assert bands == {(fit.calibration.acceleration_bands, fit.calibration.pitch_rate_bands)}


def test_two_runs_leave_nothing_to_learn_from(outcome: Outcome) -> None:
    assert judged_left_out(replace(outcome, cross_spectrum=None), "cross_spectrum") == []


def test_the_logs_are_of_the_campaign(outcome: Outcome) -> None:
    assert {Path(run.log).name for run in outcome.file.provenance.runs} == {f"0{n}.log" for n in range(1, 7)}
