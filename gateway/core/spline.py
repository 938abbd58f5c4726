"""Piecewise cubics through points: smooth ones for signals, monotone ones that do not overshoot.

Either is a cubic Hermite polynomial between neighbouring points; they differ in the slopes there. scipy.interpolate has
both, but its import takes as long as the rest of the estimator's.
"""

from typing import Final

import numpy as np

from gateway.core.tridiagonal import solve_tridiagonal
from gateway.records import F64

MOST_END_SLOPE: Final = (
    3.0  # of the outermost chord's slope: a cubic that is steeper at its end is not monotone (Fritsch and Butland 1984)
)


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


def monotone_slopes(t: F64, x: F64) -> F64:
    """(n, ...) slopes with which each cubic is monotone between its points x (n, ...).

    They are weighted harmonic means of the neighbouring chords, and 0 at a peak (F. N. Fritsch and J. Butland, SIAM J.
    Sci. Stat. Comput. 5, 1984).
    """
    step = np.diff(t).reshape(-1, *(1,) * (x.ndim - 1))
    chord = np.diff(x, axis=0) / step
    if len(t) == 2:
        return np.concatenate([chord, chord])
    before, after = 2.0 * step[1:] + step[:-1], step[1:] + 2.0 * step[:-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = (before + after) / (before / chord[:-1] + after / chord[1:])
    inner = np.where(chord[:-1] * chord[1:] > 0.0, mean, 0.0)
    ends = [_end_slope(*step[:2], *chord[:2]), _end_slope(*step[:-3:-1], *chord[:-3:-1])]
    return np.concatenate([ends[0][None], inner, ends[1][None]])


def _end_slope(step: F64, next_step: F64, chord: F64, next_chord: F64) -> F64:
    """Slope of the parabola through the outermost three points, limited so that the end stays monotone."""
    slope = ((2.0 * step + next_step) * chord - step * next_chord) / (step + next_step)
    slope = np.where(slope * chord > 0.0, slope, 0.0)
    is_too_steep = (chord * next_chord <= 0.0) & (np.abs(slope) > MOST_END_SLOPE * np.abs(chord))
    return np.where(is_too_steep, MOST_END_SLOPE * chord, slope)
