"""The likelihood of one vehicle's drives, separated from the prior.

A calibration is a posterior: prior times likelihood. Sisters share the prior, so it must not be counted once for each.
Dividing a Gaussian posterior N(x, C) by the prior N(m, P) leaves the evidence

    I = C^-1 - P^-1        h = C^-1 x - P^-1 m

which multiplies any other prior by addition. Parameters without data have no information, and need no mean.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gateway.calibration.half_car.prior import Prior
from gateway.core.cross_spectrum.model.friction import RATES
from gateway.records import F64, Bool


@dataclass(frozen=True, slots=True)
class Evidence:
    """Information (n, n), positive semi-definite, and pull (n,), the information times the mean."""

    information: F64
    pull: F64

    @classmethod
    def of(cls, mean: F64, covariance: F64, prior: Prior, shared: Bool) -> "Evidence":
        """The evidence between ``prior`` and the posterior N(mean, covariance), for the parameters that are ``shared``
        (n,).

        It is zero for the others, which the prior makes independent of these; the posterior includes their uncertainty.
        """
        at = np.flatnonzero(shared)
        block = np.ix_(at, at)
        posterior, before = _symmetric(np.linalg.inv(covariance[block])), prior.precision[block]
        told = cls.none(len(mean))
        told.information[block] = _semi_definite(posterior - before, np.sqrt(np.diag(before)))
        told.pull[at] = posterior @ mean[at] - before @ prior.mean[at]
        return told

    @classmethod
    def none(cls, n: int) -> "Evidence":
        """No information on ``n`` parameters."""
        return cls(np.zeros((n, n)), np.zeros(n))

    def __add__(self, other: "Evidence") -> "Evidence":
        return Evidence(self.information + other.information, self.pull + other.pull)

    def of_another(self, variance: F64) -> "Evidence":
        """The evidence on a vehicle whose parameters differ from this one's by N(0, diag(variance)), variance (n,).

        N(e, I^-1) becomes N(e, I^-1 + S), whose information is (1 + I S)^-1 I: no inverse of I is needed.
        """
        blurred = np.eye(len(self.pull)) + self.information * variance
        information = np.linalg.solve(blurred, self.information)
        return Evidence(_symmetric(information), np.asarray(np.linalg.solve(blurred, self.pull), float))

    def upon(self, prior: Prior) -> Prior:
        """The posterior: ``prior`` times this evidence."""
        precision = prior.precision + self.information
        mean = np.linalg.solve(precision, prior.precision @ prior.mean + self.pull)
        return Prior(np.asarray(mean, float), _symmetric(precision))

    def at_amplitude(self, about: F64, log_ratios: tuple[float, float]) -> "Evidence":
        """The same with friction at other usual amplitudes: exp(-log_ratio) times the old, for front and rear axle.

        A rate c (1 - p + p / a) at the amplitude a is c' (1 - p' + p' / a') at a' = r a (log_ratio = log r) with

            c' = c (1 - p + p r)        p' = p r / (1 - p + p r)

        linearised about the parameters ``about`` (n,).
        """
        if not any(log_ratios):
            return self
        moved = about.copy()
        back = np.eye(len(about))  # of the old parameters by the new
        for axle, share, rate in RATES:
            p, r = about[share], np.exp(log_ratios[axle])
            whole = 1.0 - p + p * r
            moved[rate] += np.log(whole)
            moved[share] = p * r / whole
            back[share, share] = whole**2 / r
            back[rate, share] = -(r - 1.0) / whole * back[share, share]
        information = back.T @ self.information @ back
        return Evidence(information, information @ moved + back.T @ (self.pull - self.information @ about))


def _symmetric(matrix: NDArray[np.floating[Any]]) -> F64:
    return np.asarray(0.5 * (matrix + matrix.T), float)


def _semi_definite(information: F64, scale: F64) -> F64:
    """``information`` without negative eigenvalues from rounding or from a posterior wider than its prior; in units of
    1 / scale.
    """
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    return _symmetric((vectors * np.maximum(values, 0.0)) @ vectors.T * np.outer(scale, scale))
