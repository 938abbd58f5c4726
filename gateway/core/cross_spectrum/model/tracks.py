"""The coherence of two parallel tracks on a road that is alike in all directions, of displacement density n^-2.

It is x K1(x), x being 2 pi times the wavenumber n times the distance of the tracks (K. M. A. Kamash and J. D. Robson,
J. Sound Vib. 57, 1978). The Bessel functions K are computed once, on a grid of log x, and are cubics between; those of
scipy.special would cost a service 26 MB.
"""

from functools import cache
from typing import Final

import numpy as np

from gateway.core.memoized import memoized
from gateway.core.spline import between
from gateway.records import F64

LEAST_X: Final = 1e-4  # chosen: the coherence is 1 within 1e-7
MOST_X: Final = 100.0  # chosen: the coherence is 1e-42
GRID: Final = 0.02  # chosen: of log x; the cubics are right within 1e-9
STEP: Final = 0.05  # chosen: of the quadrature; its relative error is exp(x - pi^2 / STEP)
REACH: Final = 14.0  # chosen: where the integrand of LEAST_X is below exp(-60)


@memoized
def coherence_of(x: F64) -> F64:
    """x K1(x) for x >= 0."""
    return _of_grid(x, 0)


@memoized
def coherence_slope_of(x: F64) -> F64:
    """Its derivative by log x, -x^2 K0(x)."""
    return -_of_grid(x, 1)


def _of_grid(x: F64, column: int) -> F64:
    """x K1(x) or x^2 K0(x); beyond the grid as at its end."""
    x = np.clip(x, LEAST_X, MOST_X)
    log_x, logs, slopes = _tables()
    found: F64 = np.exp(between(np.log(x).ravel(), log_x, logs[:, column], slopes[:, column]).reshape(x.shape) - x)
    return found


@cache
def _tables() -> tuple[F64, F64, F64]:
    """The grid of log x (n,), these logarithms there (n, 2), and their derivatives by log x.

    e^x K_v(x) is the integral of exp(-x (cosh t - 1)) cosh(v t) over t >= 0 (DLMF 10.32.9), which the trapezoidal rule
    finds to the last digit (L. N. Trefethen and J. A. C. Weideman, SIAM Review 56 (2014) 385-458).
    """
    log_x = np.arange(np.log(LEAST_X), np.log(MOST_X) + GRID, GRID)
    x = np.exp(log_x)
    cosh = np.cosh(np.arange(0.0, REACH, STEP))
    weight = np.full(len(cosh), STEP)
    weight[0] /= 2.0
    integrand = weight * np.exp(-x[:, None] * (cosh - 1.0))
    k0, k1 = integrand.sum(axis=1), integrand @ cosh
    logs = np.log([x * k1, x**2 * k0]).T
    slopes = x[:, None] + np.array([-x * k0 / k1, 2.0 - x * k1 / k0]).T
    return log_x, logs, slopes
