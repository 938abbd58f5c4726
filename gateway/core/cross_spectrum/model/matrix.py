"""Spectral matrices of p sensors: Hermitian, stored as their diagonals and lower triangles."""

from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np

from gateway.records import C128, F64

PAIRS: Final = ((1, 0), (2, 0), (2, 1))
"""Pairs (row, column) of sensors: pitch rate and acceleration; roll rate and each of these."""


@dataclass(frozen=True, slots=True)
class SpectralMatrix:
    """auto (p, ..., m) and cross (p (p - 1) / 2, ..., m), the latter for as many of PAIRS."""

    auto: F64
    cross: C128

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """The pairs of sensors in ``cross``."""
        return PAIRS[: len(self.cross)]

    @property
    def parts(self) -> F64:
        """(..., m, p^2) its real numbers: the diagonal, then real and imaginary part of each pair."""
        return np.stack([*self.auto, *(part for one in self.cross for part in (one.real, one.imag))], axis=-1)

    @classmethod
    @cache
    def units(cls, n_sensors: int) -> "SpectralMatrix":
        """The p^2 matrices (p, p^2, 1, 1) with a one in one of their parts and zeros elsewhere."""
        units = np.eye(n_sensors**2)[:, :, None, None]
        return cls(units[:n_sensors], units[n_sensors::2] + 1j * units[n_sensors + 1 :: 2])

    @classmethod
    def zeros(cls, n_sensors: int, shape: tuple[int, ...]) -> "SpectralMatrix":
        """Zeros, to be filled in."""
        n_pairs = n_sensors * (n_sensors - 1) // 2
        return cls(np.zeros((n_sensors, *shape)), np.zeros((n_pairs, *shape), np.complex128))


@dataclass(frozen=True, slots=True)
class Whitener:
    """M = L L^H by its pivots: L is unit lower triangular times diag(roots).

    roots (p, ..., m); below (p (p - 1) / 2, ..., m) are the entries of L below the diagonal, by PAIRS.
    """

    roots: F64
    below: C128

    @classmethod
    def of(cls, matrix: SpectralMatrix) -> "Whitener":
        """The whitener of a positive definite matrix; pivots that vanish by rounding are kept off zero."""
        auto, cross = matrix.auto, matrix.cross
        below = np.empty_like(cross)
        pivots = [auto[0]]
        below[0] = cross[0] / pivots[0]
        pivots.append(_kept_off_zero(auto[1] - np.abs(below[0]) ** 2 * pivots[0], auto[1]))
        if len(auto) > 2:
            below[1] = cross[1] / pivots[0]
            below[2] = (cross[2] - below[1] * np.conj(cross[0])) / pivots[1]
            left = auto[2] - np.abs(below[1]) ** 2 * pivots[0] - np.abs(below[2]) ** 2 * pivots[1]
            pivots.append(_kept_off_zero(left, auto[2]))
        return cls(np.sqrt(np.array(pivots)), below)

    def __call__(self, matrix: SpectralMatrix) -> SpectralMatrix:
        """L^-1 X L^-H of matrices X with arrays (p, ..., m) like the whitener's, or (p, k, ..., m)."""
        auto, cross = matrix.auto, matrix.cross
        below, scale = self.below, 1.0 / self.roots
        lower = cross[0] - below[0] * auto[0]
        second = auto[1] - 2.0 * np.real(cross[0] * np.conj(below[0])) + np.abs(below[0]) ** 2 * auto[0]
        whitened_auto = [auto[0] * scale[0] ** 2, second * scale[1] ** 2]
        whitened_cross = [lower * (scale[0] * scale[1])]
        if len(auto) > 2:
            last_first = cross[1] - below[1] * auto[0] - below[2] * lower
            unmixed = cross[2] - cross[1] * np.conj(below[0])
            last_second = unmixed - below[1] * np.conj(lower) - below[2] * second
            last = np.conj(below[1]) * cross[1] + np.conj(below[2]) * unmixed
            last += below[1] * np.conj(last_first) + below[2] * np.conj(last_second)
            whitened_auto.append((auto[2] - last.real) * scale[2] ** 2)
            whitened_cross += [last_first * (scale[2] * scale[0]), last_second * (scale[2] * scale[1])]
        return SpectralMatrix(np.array(whitened_auto), np.array(whitened_cross))


def _kept_off_zero(pivot: F64, auto: F64) -> F64:
    kept: F64 = np.maximum(pivot, 1e-12 * auto)
    return kept
