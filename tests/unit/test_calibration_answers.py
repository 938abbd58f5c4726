"""Errors in units of their own intervals, and how often intervals of any level hold the truth."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import ndtri, stdtrit

from gateway.calibration.judgement.answers import LEVELS, Answers, answers_of, observed_coverage, standardised
from gateway.calibration.judgement.evaluation import Judged
from gateway.estimate import Estimate, Quantity
from gateway.records import Why

DOF = st.one_of(st.none(), st.floats(2.0, 50.0))


def answers(error: np.ndarray, half95: float | np.ndarray = 10.0, run: np.ndarray | None = None) -> Answers:
    n = len(error)
    run = np.arange(n) if run is None else run
    return Answers(run, np.zeros(n), error, np.broadcast_to(half95, n), np.full(n, 14.0))


@given(half95=st.floats(0.1, 1e3), dof=DOF)
def test_an_error_at_the_intervals_end_is_196_standard_deviations(half95: float, dof: float | None) -> None:
    z = standardised(answers(np.array([half95, -half95, 0.0]), half95), dof)
    assert z == pytest.approx([ndtri(0.975), -ndtri(0.975), 0.0], abs=1e-6)


@given(dof=DOF)
def test_errors_of_the_stated_law_are_covered_as_often_as_nominal(dof: float | None) -> None:
    """Errors at the quantiles (i + 1/2) / n of the law: of n the level's share lies within, to one in n."""
    n = 400
    p = (np.arange(n) + 0.5) / n
    unit = ndtri(p) if dof is None else stdtrit(dof, p)
    half95 = ndtri(0.975) if dof is None else float(stdtrit(dof, 0.975))
    share, low, high = observed_coverage(answers(unit, half95), dof).T
    assert share == pytest.approx(LEVELS, abs=1.5 / n)
    assert np.all((low <= LEVELS) & (high >= LEVELS))


@given(errors=st.lists(st.floats(-50.0, 50.0), min_size=2, max_size=20))
def test_a_wider_level_never_covers_less(errors: list[float]) -> None:
    share = observed_coverage(answers(np.array(errors)), None)[:, 0]
    assert np.all(np.diff(share) >= 0.0)


def test_batches_without_an_answer_are_left_out_and_the_rest_keeps_its_place() -> None:
    good = Estimate(0, 1, "x", payload=Quantity(110.0, interval95=(90.0, 130.0)), mean_speed_mps=13.0)
    bad = Estimate(0, 1, "x", rejected=(Why.GAP,))
    found = answers_of([Judged(1, "a", 100.0, 50.0, bad), Judged(2, "b", 100.0, 50.0, good)], "payload")
    assert found.run.tolist() == [2]
    assert found.error.tolist() == [10.0]
    assert found.half95.tolist() == [20.0]
    assert found.notes == ("run 2",)
    assert len(answers_of([Judged(2, "b", 100.0, 50.0, good)], "front_share").run) == 0
