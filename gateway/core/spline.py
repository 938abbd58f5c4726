"""Piecewise cubics through the samples of a signal.

scipy.interpolate has them too, but its import takes as long as the rest of the estimator's.
"""

import numpy as np

from gateway.core.tridiagonal import solve_tridiagonal
from gateway.records import F64


def between(at: F64, t: F64, x: F64, slopes: F64) -> F64:
    """(m, ...) at ``at`` (m,) of the cubics through x (n, ...) at rising t (n,), with slopes (n, ...) there."""
    i = np.clip(np.searchsorted(t, at, side="right") - 1, 0, len(t) - 2)
    several = (slice(None), *(None,) * (x.ndim - 1))
    step = np.diff(t)[several]
    chord = np.diff(x, axis=0) / step
    bend = (slopes[:-1] + slopes[1:] - 2.0 * chord) / step
    cubic, square = bend / step, (chord - slopes[:-1]) / step - bend
    since = (at - t[i])[several]
    found: F64 = x[i] + since * (slopes[i] + since * (square[i] + since * cubic[i]))
    return found


def smooth_slopes(t: F64, x: F64) -> F64:
    """(n,) slopes of the cubic spline through x (n,) at t (n,), n >= 4, with not-a-knot ends.

    Second derivatives are continuous, and at the second point from either end the third derivative too (C. de Boor, A
    Practical Guide to Splines, 1978, ch. IV).
    """
    step, chord = np.diff(t), np.diff(x) / np.diff(t)
    first, last = t[2] - t[0], t[-1] - t[-3]
    diagonal, right = 2.0 * (step[:-1] + step[1:]), 3.0 * (step[1:] * chord[:-1] + step[:-1] * chord[1:])
    # The outermost two equations, step[1] s[0] + first s[1] = begin and likewise at the end, put into their neighbours.
    begin = ((step[0] + 2.0 * first) * step[1] * chord[0] + step[0] ** 2 * chord[1]) / first
    end = (step[-1] ** 2 * chord[-2] + (2.0 * last + step[-1]) * step[-2] * chord[-1]) / last
    diagonal[[0, -1]] -= first, last
    right[[0, -1]] -= begin, end
    inner = solve_tridiagonal(np.r_[0.0, step[2:]], diagonal, np.r_[step[:-2], 0.0], right)
    outer = (begin - first * inner[0]) / step[1], (end - last * inner[-1]) / step[-2]
    return np.concatenate([outer[:1], inner, outer[1:]])
