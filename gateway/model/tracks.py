"""The coherence of two parallel tracks on a road that is alike in all directions, of displacement density n^-2.

It is x K1(x), x being 2 pi times the wavenumber n times the distance of the tracks (K. M. A. Kamash and J. D. Robson,
J. Sound Vib. 57, 1978). The Bessel functions K are computed once, on a grid of log x, and are cubics between; those of
scipy.special would cost a service 26 MB.
"""

from functools import cache
from typing import Final

import numpy as np

from gateway.records import F64

LEAST_X: Final = 1e-4  # chosen: the coherence is 1 within 1e-7
MOST_X: Final = 100.0  # chosen: the coherence is 1e-42
GRID: Final = 0.02  # chosen: of log x; the cubics are right within 1e-9
STEP: Final = 0.05  # chosen: of the quadrature; its relative error is exp(x - pi^2 / STEP)
_LEAST, _MOST = np.log(LEAST_X), np.log(MOST_X)
REACH: Final = 14.0  # chosen: where the integrand of LEAST_X is below exp(-60)


def coherence_of(log_x: F64) -> F64:
    """x K1(x) by the logarithm of x; beyond the grid as at its end."""
    return _of_grid(log_x, 0)


def coherence_slope_of(log_x: F64) -> F64:
    """The derivative of the coherence by log x, -x^2 K0(x)."""
    return -_of_grid(log_x, 1)


def _of_grid(log_x: F64, column: int) -> F64:
    """x K1(x) or x^2 K0(x)."""
    log_x = np.fmin(np.fmax(log_x, _LEAST), _MOST)  # no number, at no speed, meets a spectrum that is none either
    since = (log_x - _LEAST) / GRID
    i = since.astype(np.intp)
    since -= i
    constant, slope, square, cubic = _cubics()[column]
    found: F64 = cubic.take(i)
    for one in (square, slope, constant):
        found *= since
        found += one.take(i)
    found -= np.exp(log_x)
    return np.exp(found, out=found)


@cache
def _cubics() -> F64:
    """(2, 4, n) of the logarithms of e^x x K1(x) and e^x x^2 K0(x) in each interval of the grid, whose length is 1.

    e^x K_v(x) is the integral of exp(-x (cosh t - 1)) cosh(v t) over t >= 0 (DLMF 10.32.9), which the trapezoidal rule
    finds to the last digit (L. N. Trefethen and J. A. C. Weideman, SIAM Review 56 (2014) 385-458). The derivatives at
    the points are exact too.
    """
    x = np.exp(np.arange(_LEAST, _MOST + 2.0 * GRID, GRID))
    cosh = np.cosh(np.arange(0.0, REACH, STEP))
    weight = np.full(len(cosh), STEP)
    weight[0] /= 2.0
    integrand = weight * np.exp(-x[:, None] * (cosh - 1.0))
    k0, k1 = integrand.sum(axis=1), integrand @ cosh
    logs = np.log([x * k1, x**2 * k0])
    slopes = GRID * (x + np.array([-x * k0 / k1, 2.0 - x * k1 / k0]))
    chord = np.diff(logs, axis=1)
    bend = slopes[:, :-1] + slopes[:, 1:] - 2.0 * chord
    return np.stack([logs[:, :-1], slopes[:, :-1], chord - slopes[:, :-1] - bend, bend], axis=1)
