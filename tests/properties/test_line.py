"""What sisters tell of the next vehicle: no scatter, boundless scatter, and scatter that is estimated."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from gateway.calibration.half_car.prior import Prior
from gateway.calibration.line.evidence import Evidence
from gateway.calibration.line.scatter import scatter_found
from gateway.core.cross_spectrum.model.friction import RATES
from gateway.core.cross_spectrum.model.parameters import PARAMETERS
from gateway.records import F64, Bool

N = 4
NUMBERS = st.floats(-3.0, 3.0)
ROWS = arrays(float, (N, N), elements=NUMBERS)
VECTOR = arrays(float, N, elements=NUMBERS)
STD = arrays(float, N, elements=st.floats(0.1, 2.0))


def evidence(rows: F64, mean: F64) -> Evidence:
    information = rows.T @ rows
    return Evidence(information, information @ mean)


EVIDENCE = st.builds(evidence, ROWS, VECTOR)
PRIOR = st.builds(Prior.independent, VECTOR, STD)


def assert_same(one: Prior, other: Prior) -> None:
    assert np.allclose(one.precision, other.precision, rtol=1e-6, atol=1e-6)
    assert np.allclose(one.mean, other.mean, rtol=1e-6, atol=1e-6)


@given(EVIDENCE, PRIOR)
def test_a_posterior_divided_by_its_prior_is_the_evidence_that_made_it(drives: Evidence, prior: Prior) -> None:
    posterior = drives.upon(prior)
    again = Evidence.of(posterior.mean, posterior.covariance, prior, np.ones(N, dtype=bool))
    assert_same(again.upon(prior), posterior)


@given(EVIDENCE, EVIDENCE, PRIOR)
def test_without_scatter_all_drives_are_one_joint_fit(sister: Evidence, own: Evidence, prior: Prior) -> None:
    none = np.zeros(N)
    assert_same(own.upon(sister.of_another(none).upon(prior)), (sister + own).upon(prior))


@given(EVIDENCE, EVIDENCE, PRIOR)
def test_with_boundless_scatter_a_line_says_nothing(sister: Evidence, own: Evidence, prior: Prior) -> None:
    boundless = np.full(N, 1e12)
    assert_same(own.upon(sister.of_another(boundless).upon(prior)), own.upon(prior))


@given(STD, VECTOR, STD, STD)
def test_scatter_adds_to_the_covariance(std: F64, mean: F64, scatter: F64, more: F64) -> None:
    known = Evidence(np.diag(std**-2.0), std**-2.0 * mean)
    blurred = known.of_another(scatter**2).of_another(more**2)
    assert np.allclose(np.linalg.inv(blurred.information), np.diag(std**2 + scatter**2 + more**2))
    assert np.allclose(np.linalg.solve(blurred.information, blurred.pull), mean)


@given(EVIDENCE, PRIOR, arrays(bool, N))
def test_what_is_a_vehicle_s_own_is_marginalised_out(drives: Evidence, prior: Prior, shared: Bool) -> None:
    """Of what it shares the next vehicle, which has others of its own, knows what the posterior said of that alone."""
    posterior = drives.upon(prior)
    left = Evidence.of(posterior.mean, posterior.covariance, prior, shared)
    assert not left.information[~shared].any()
    assert not left.pull[~shared].any()
    told = left.upon(prior)
    at = np.flatnonzero(shared)
    assert np.allclose(told.mean[at], posterior.mean[at], rtol=1e-6, atol=1e-6)
    assert np.allclose(told.covariance[np.ix_(at, at)], posterior.covariance[np.ix_(at, at)], rtol=1e-6, atol=1e-6)
    assert np.allclose(told.mean[~shared], prior.mean[~shared])


@pytest.mark.parametrize("log_ratios", [(-0.7, -0.7), (0.0, 0.0), (0.4, -0.2)])
def test_rates_are_the_same_at_every_amplitude_whatever_amplitude_is_called_usual(
    log_ratios: tuple[float, float],
) -> None:
    n = len(PARAMETERS)
    about = np.linspace(0.05, 0.4, n)
    seen = Evidence(np.eye(n), about.copy()).at_amplitude(about, log_ratios)
    moved = np.linalg.solve(seen.information, seen.pull)
    for (axle, share, rate), amplitude in itertools.product(RATES, (0.5, 1.0, 2.0)):
        old = np.exp(about[rate]) * (1.0 - about[share] + about[share] / amplitude)
        new = np.exp(moved[rate]) * (1.0 - moved[share] + moved[share] / (amplitude * np.exp(log_ratios[axle])))
        assert new == pytest.approx(old)
    front, rear = log_ratios
    back = seen.at_amplitude(moved, (-front, -rear))
    assert np.allclose(back.information, np.eye(n))
    assert np.allclose(back.pull, about)


def siblings(n: int, scatter_std: F64, seed: int) -> list[Evidence]:
    """Drives that tell every parameter as well as vehicles differ, and some combinations of them better."""
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(n):
        rows = rng.standard_normal((6, N)) / scatter_std
        information = rows.T @ rows
        covariance = np.linalg.inv(information)
        told = rng.normal(1.0, scatter_std) + rng.multivariate_normal(np.zeros(N), covariance)
        found.append(Evidence(information, information @ told))
    return found


def test_scatter_is_recovered_from_many_siblings_whatever_the_default() -> None:
    truth = np.array([0.03, 0.1, 0.04, 0.3])
    for wrong in (0.3, 3.0):
        found = scatter_found(siblings(300, truth, 1), (wrong * truth) ** 2, dof=4.0)
        assert np.sqrt(found) == pytest.approx(truth, rel=0.15)


def test_few_siblings_move_the_default_as_far_as_they_are_worth() -> None:
    truth = np.full(N, 0.1)
    exact = [Evidence(np.eye(N) * 1e8, 1e8 * np.full(N, x)) for x in (-0.1, 0.0, 0.1)]
    found = scatter_found(exact, (0.5 * truth) ** 2, dof=4.0)
    # squares about the estimated mean, and what of the mean three vehicles leave open
    assert found == pytest.approx((4.0 * 0.05**2 + 0.02) / (4.0 + 2.0), rel=1e-3)


def test_what_no_sibling_tells_keeps_its_default() -> None:
    silent = [Evidence.none(N)] * 5
    default = np.array([0.03, 0.1, 0.0, 0.3]) ** 2
    assert scatter_found(silent, default, dof=4.0) == pytest.approx(default)
