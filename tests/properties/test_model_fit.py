"""The laws of the hierarchical fit: what eliminating the drives must not change, and what a statement may do."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.model import fit
from gateway.records import F64


class Parabola:
    """Minus the log-likelihood of data linear in the common vector and the drive's own, as curved as it looks."""

    def __init__(self, rng: np.random.Generator, n: int, k: int, bend: float = 0.0) -> None:
        self.design = rng.standard_normal((n + k + 2, n + k))
        self.data = rng.standard_normal(n + k + 2)
        self.bend = bend

    def cost(self, common: F64, own: F64) -> float:
        x = np.r_[common, own]
        off = self.design @ x - self.data
        return 0.5 * float(off @ off) + self.bend * float(np.sum(x**4))

    def curvature(self, common: F64, own: F64) -> tuple[F64, F64]:
        x = np.r_[common, own]
        gradient = self.design.T @ (self.design @ x - self.data) + 4.0 * self.bend * x**3
        return gradient, self.design.T @ self.design + np.diag(12.0 * self.bend * x**2)


def drives_of(seed: int, sizes: list[int], n: int, bend: float = 0.0) -> tuple[fit.Gaussian, list[fit.Drive]]:
    rng = np.random.default_rng(seed)
    prior = fit.Gaussian.of(rng.standard_normal(n), np.diag(rng.uniform(0.5, 2.0, n)))
    drives = []
    for k in sizes:
        of_own = fit.Gaussian.of(rng.standard_normal(k), np.diag(rng.uniform(0.5, 2.0, k)))
        drives.append(fit.Drive(Parabola(rng, n, k, bend), of_own, np.zeros(k)))
    return prior, drives


def dense(prior: fit.Gaussian, drives: list[fit.Drive], at: F64) -> tuple[F64, F64]:
    """Gradient and information of everything at once: common vector first, then each drive's own."""
    n = len(prior.mean)
    gradient, information = np.zeros_like(at), np.zeros((len(at), len(at)))
    gradient[:n], information[:n, :n] = prior.pull(at[:n]), prior.precision
    start = n
    for drive in drives:
        k = len(drive.start)
        entries = [*range(n), *range(start, start + k)]
        g, h = drive.likelihood.curvature(at[:n], at[start : start + k])
        gradient[entries] += g
        information[np.ix_(entries, entries)] += h
        gradient[start : start + k] += drive.prior.pull(at[start : start + k])
        information[start : start + k, start : start + k] += drive.prior.precision
        start += k
    return gradient, information


@given(seed=st.integers(0, 1000), sizes=st.lists(st.integers(1, 3), min_size=1, max_size=4), n=st.integers(1, 4))
def test_eliminating_the_drives_solves_what_the_whole_matrix_solves(seed: int, sizes: list[int], n: int) -> None:
    prior, drives = drives_of(seed, sizes, n)
    found = fit.most_probable(np.zeros(n), prior, drives, tolerance=1e-12)
    gradient, information = dense(prior, drives, np.zeros(n + sum(sizes)))
    solution, covariance = np.linalg.solve(information, -gradient), np.linalg.inv(information)
    np.testing.assert_allclose(np.r_[found.common, *found.own], solution, atol=1e-9)
    np.testing.assert_allclose(found.covariance, covariance[:n, :n], atol=1e-9)
    start = n
    for own, across, k in zip(found.own_covariances, found.across, sizes, strict=True):
        np.testing.assert_allclose(own, covariance[start : start + k, start : start + k], atol=1e-9)
        np.testing.assert_allclose(across, covariance[:n, start : start + k], atol=1e-9)
        start += k
    assert found.log_volume == pytest.approx(0.5 * np.linalg.slogdet(information)[1])


@given(seed=st.integers(0, 1000), bend=st.floats(0.0, 2.0))
def test_a_search_ends_where_the_slope_is_zero(seed: int, bend: float) -> None:
    prior, drives = drives_of(seed, [2, 3], 2, bend)
    found = fit.most_probable(np.full(2, 3.0), prior, drives, tolerance=1e-10)
    gradient, _ = dense(prior, drives, np.r_[found.common, *found.own])
    assert found.is_converged
    np.testing.assert_allclose(gradient, 0.0, atol=1e-3)


@given(seed=st.integers(0, 1000))
def test_one_drive_alone_is_an_ordinary_search(seed: int) -> None:
    """With nothing in common, or with the common vector's prior moved into the drive's own."""
    prior, [drive] = drives_of(seed, [3], 2)
    together = fit.most_probable(np.zeros(2), prior, [drive], tolerance=1e-12)

    class Folded:
        def cost(self, common: F64, own: F64) -> float:
            return drive.likelihood.cost(own[:2], own[2:])

        def curvature(self, common: F64, own: F64) -> tuple[F64, F64]:
            return drive.likelihood.curvature(own[:2], own[2:])

    mean = np.r_[prior.mean, drive.prior.mean]
    precision = np.zeros((5, 5))
    precision[:2, :2], precision[2:, 2:] = prior.precision, drive.prior.precision
    alone = fit.climb(Folded(), fit.Gaussian(mean, precision), np.zeros(5), tolerance=1e-12)
    np.testing.assert_allclose(alone.own[0], np.r_[together.common, together.own[0]], atol=1e-8)
    np.testing.assert_allclose(alone.own_covariances[0][:2, :2], together.covariance, atol=1e-8)


@given(seed=st.integers(0, 1000), factor=st.floats(-50.0, 50.0))
def test_a_rising_prior_pulls_up_where_something_falls_and_nowhere_else(seed: int, factor: float) -> None:
    rng = np.random.default_rng(seed)
    prior, drives = drives_of(seed, [2], 3)
    rows, x = rng.standard_normal((2, 3)), factor * rng.standard_normal(3)
    rising = fit.Rising(prior.mean, prior.precision, rows)
    falls = np.minimum(rows @ x, 0.0)
    assert rising.cost(x) - prior.cost(x) == pytest.approx(0.5 * float(falls @ falls))
    steps = np.eye(3) * 1e-6
    slope = [(rising.cost(x + step) - rising.cost(x - step)) / 2e-6 for step in steps]
    assert rising.pull(x) == pytest.approx(np.array(slope), rel=1e-4, abs=1e-3)
    if not falls.any():
        assert (rising.information(x) == prior.information(x)).all()
    steep = fit.Rising(prior.mean, prior.precision, 100.0 * rows)
    found = fit.most_probable(prior.mean, steep, drives, 1e-8)
    assert (rows @ found.common > -0.1).all()
    assert found.cost >= fit.most_probable(prior.mean, prior, drives).cost - 1e-6


def test_a_search_that_cannot_reach_what_is_worth_it_is_given_up() -> None:
    prior, drives = drives_of(3, [2], 2, bend=1.0)
    start = np.full(2, 300.0)
    assert fit.most_probable(start, prior, drives).is_converged
    given_up = fit.most_probable(start, prior, drives, worth=-1e6)
    assert not given_up.is_converged
    assert given_up.cost > fit.most_probable(start, prior, drives).cost


def test_a_search_that_leads_to_a_known_maximum_ends_before_it() -> None:
    _, [drive] = drives_of(5, [3], 0)
    peak = fit.climb(drive.likelihood, drive.prior, np.zeros(3), 1e-9)
    known = fit.Gaussian.of(peak.own[0], peak.own_covariances[0])
    again = fit.climb(drive.likelihood, drive.prior, np.full(3, 4.0), 1e-9, known=[known])
    assert again.cost == np.inf
    elsewhere = fit.Gaussian(peak.own[0] + 100.0, known.precision)
    found = fit.climb(drive.likelihood, drive.prior, np.full(3, 4.0), 1e-9, known=[elsewhere])
    assert found.cost == pytest.approx(peak.cost)


class Rounded:
    """A cost that says nothing of its second parameter, of which rounding left a negative information."""

    def cost(self, common: F64, own: F64) -> float:
        return 0.5 * float(own[0] ** 2)

    def curvature(self, common: F64, own: F64) -> tuple[F64, F64]:
        return np.array([own[0], 0.0]), np.array([[1.0, 1.0], [1.0, 1.0 - 1e-7]])


def test_what_is_undetermined_but_for_rounding_has_a_wide_interval() -> None:
    """Its variance would be negative, and the estimate end in an error."""
    found = fit.climb(Rounded(), fit.Gaussian(np.zeros(2), np.zeros((2, 2))), np.zeros(2))
    assert np.diag(found.own_covariances[0]).min() > 1e3
