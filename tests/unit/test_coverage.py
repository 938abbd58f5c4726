"""Coverage: its limits against closed forms and by trying."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from gateway.calibration.judgement.coverage import coverage_of, interval_scores


def test_batches_of_different_runs_give_the_exact_binomial_limits() -> None:
    covered = [True] * 190 + [False] * 10
    found = coverage_of(covered, list(range(200)))
    exact = binomtest(190, 200).proportion_ci(0.95, method="exact")
    assert found.n_effective == pytest.approx(199.0)  # the variance between 200 clusters is a sample's
    assert (found.low, found.high) == pytest.approx((exact.low, exact.high), abs=2e-4)


@given(st.integers(2, 8), st.integers(0, 2**32 - 1))
def test_saying_everything_k_times_over_adds_nothing(k: int, seed: int) -> None:
    covered = np.random.default_rng(seed).random(60) < 0.9
    once = coverage_of(covered.tolist(), list(range(60)))
    repeated = coverage_of(np.repeat(covered, k).tolist(), np.repeat(np.arange(60), k).tolist())
    assert repeated.share == pytest.approx(once.share)
    assert repeated.n_effective <= once.n_effective * (1.0 + 1e-9)
    assert repeated.high - repeated.low >= 0.999 * (once.high - once.low)


def test_where_all_are_covered_each_run_counts_once() -> None:
    found = coverage_of([True] * 60, [i // 6 for i in range(60)])
    assert (found.n, found.n_clusters, found.n_effective, found.high) == (60, 10, 10.0, 1.0)
    assert found.low == pytest.approx(binomtest(10, 10).proportion_ci(0.95, method="exact").low)


def test_the_limits_hold_the_true_share_when_runs_differ() -> None:
    """Runs with shares of their own (beta, correlation 0.2), 40 runs of 6 batches: 95 % limits, tried 400 times."""
    rng = np.random.default_rng(5)
    cluster = np.repeat(np.arange(40), 6)
    n_held = n_naive = 0
    for _ in range(400):
        hits = rng.random(240) < rng.beta(0.92 * 4.0, 0.08 * 4.0, 40)[cluster]
        found = coverage_of(hits.tolist(), cluster.tolist())
        naive = binomtest(int(hits.sum()), 240).proportion_ci(0.95, method="exact")
        n_held += found.low <= 0.92 <= found.high
        n_naive += naive.low <= 0.92 <= naive.high
    assert n_held >= 0.93 * 400
    assert n_naive < n_held


def test_one_run_has_no_scatter_between_runs() -> None:
    with pytest.raises(ValueError, match="at least two runs"):
        coverage_of([True, False], ["a", "a"])


def test_an_interval_score_by_hand() -> None:
    true = np.array([0.0, 1.0, -3.0, 2.5])
    found = interval_scores(true, np.full(4, -1.0), np.full(4, 2.0))
    assert found.tolist() == [3.0, 3.0, 3.0 + 40.0 * 2.0, 3.0 + 40.0 * 0.5]
