"""By how much the vehicles of a line differ, estimated from several of them.

Parameters of vehicle i are N(mu, V) about the line's mean mu, V diagonal; its drives left evidence (I_i, h_i). The most
probable V under scaled inverse chi-squared priors (A. Gelman et al., Bayesian Data Analysis, 3rd ed., 2013, 2.6 and
5.4) is found by expectation and maximisation, mu being integrated out (N. M. Laird, J. H. Ware, Random-effects models
for longitudinal data, Biometrics 38, 1982):

    s^2 = (nu s0^2 + sum_i E[(theta_i - mu)^2]) / (nu + K)

A parameter that no drive told keeps its default s0; one that all told well has the variance of the K, and the nu
vehicles that the default counts for.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np

from gateway.calibration.line.evidence import Evidence
from gateway.records import F64

LEAST_SIBLINGS: Final = 3
MOST_STEPS: Final = 500
SETTLED: Final = 1e-4  # relative change of a variance
_RIDGE: Final = 1e-9  # of the scatter's own precision: of mu where no vehicle tells anything of it


def scatter_found(siblings: Sequence[Evidence], default_variance: F64, dof: float) -> F64:
    """(n,) variances of vehicles about their line's mean; those whose default is 0 stay 0.

    ``dof`` is how many vehicles the default counts for.
    """
    shared = np.flatnonzero(default_variance > 0.0)
    parts = [Evidence(one.information[np.ix_(shared, shared)], one.pull[shared]) for one in siblings]
    default = default_variance[shared]
    variance = default
    for _ in range(MOST_STEPS):
        squares = _expected_squares(parts, variance)
        told = (dof * default + squares) / (dof + len(parts))
        is_settled = np.allclose(told, variance, rtol=SETTLED, atol=0.0)
        variance = told
        if is_settled:
            break
    found = np.zeros_like(default_variance)
    found[shared] = variance
    return found


def _expected_squares(parts: Sequence[Evidence], variance: F64) -> F64:
    """(m,) sum over vehicles of E[(theta_i - mu)^2], given all evidence and this variance (m,)."""
    precision = np.diag(1.0 / variance)
    line = sum((one.of_another(variance) for one in parts), Evidence(_RIDGE * precision, np.zeros(len(variance))))
    of_mean = np.linalg.inv(line.information)
    mean = of_mean @ line.pull
    squares = np.zeros(len(variance))
    for one in parts:
        own = np.linalg.inv(one.information + precision)
        moves = own @ one.information
        off = own @ (one.pull - one.information @ mean)
        squares += off**2 + np.diag(own) + np.einsum("ij,jk,ik->i", moves, of_mean, moves)
    return squares
