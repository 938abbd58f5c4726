"""Whittle's likelihood of averaged cross-spectra with an unknown level of the road.

An average of n tapered transforms X X^H follows a complex Wishart distribution about Sigma = s M, with M the model's p
x p matrix (p sensors: two, or three with a roll rate) and s the road's density. For unknown s the likelihood has its
maximum at s = tr(M^-1 S) / p; its value there is, per group and frequency,

    n ( p log tr(M^-1 S) + log det M ),

which does not depend on the road. The level itself is used only as far as a road is smooth: log s is a line in log f,
within ROAD_RIPPLE.
(P. Whittle, "The analysis of multiple stationary time series", J. R. Stat. Soc. B 15, 1953.)
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np
from numpy.lib.stride_tricks import as_strided

from gateway.core.vehicle import Load
from gateway.model.buffers import buffer
from gateway.model.car import Ground, has_roll
from gateway.model.expected import Expected, Groups
from gateway.model.slopes import Slopes, slopes_of
from gateway.model.spectra import PAIRS, CrossSpectra
from gateway.records import C128, F32, F64

EFFECTIVE_SHARE: Final = 0.5  # chosen: neighbouring Hann bins and half-overlapping segments are correlated
ROAD_RIPPLE: Final = 0.3  # standard deviation of log s about its line; chosen (`benchmarks.accuracy sensitivity`)
ROAD_SLOPE_STD: Final = 0.3  # chosen: of the line's slope
AT_ONCE: Final = 8  # points of which the costs are computed together: more take memory and hardly less time


@dataclass(frozen=True, slots=True)
class Point:
    """A point of the likelihood: parameters theta (n,), payload, front share (0..1), and for a vehicle with roll the
    centre of gravity of the sprung mass left of the centre line.
    """

    theta: F64
    payload_kg: float
    front_share: float
    cg_left_m: float = 0.0

    @classmethod
    def of(cls, theta: F64, load: Load, cg_left_m: float = 0.0) -> "Point":
        """Join a vehicle's parameters and a load."""
        return cls(theta, load.payload_kg, load.front_share, cg_left_m)

    @property
    def loaded(self) -> tuple[float, ...]:
        """The load as the model takes it: two numbers, three for a vehicle with roll."""
        both = (self.payload_kg, self.front_share)
        return (*both, self.cg_left_m) if has_roll(self.theta) else both


@dataclass(frozen=True, slots=True)
class Curvature:
    """Gradient (k,) and expected second derivative (k, k) of the negative log-likelihood."""

    gradient: F64
    information: F64


class Whittle:
    """The likelihood of one set of spectra. ``weight`` scales all evidence (1: full weight)."""

    def __init__(self, spectra: CrossSpectra, ground: Ground, weight: float = 1.0) -> None:
        self.spectra, self.ground, self.weight = spectra, ground, weight
        self._groups = Groups(spectra, ground)
        self._p = p = spectra.n_sensors
        self._n = spectra.n_segments * (EFFECTIVE_SHARE * weight)
        level_weight = self._n / (1.0 / p + ROAD_RIPPLE**2 * float(np.sum(self._n)))
        self._root_n, self._root_level_weight = np.sqrt(self._n), np.sqrt(level_weight)
        self._slope = _centred(np.log(spectra.freq_hz[1:-1]))
        self._level_stiffness = float(np.sum(level_weight * self._slope**2)) + ROAD_SLOPE_STD**-2
        shape = spectra.parts.shape[1:]
        self._each_n = np.broadcast_to(self._n, shape).ravel()
        self._each_root_level_weight = np.broadcast_to(self._root_level_weight, shape).ravel()
        self._sloping = (self._root_level_weight * self._slope).ravel()
        self._level_functionals = np.stack([np.ones_like(self._slope), self._slope]).astype(np.float32)
        self._last: tuple[tuple[float, ...], Expected, _Whitening] | None = None

    def showing(self, spectra: CrossSpectra) -> "Whittle":
        """The likelihood of other measurements of this drive; it keeps the model as it was last solved."""
        other = copy(self)
        other.spectra = spectra
        if self._last is not None:
            load, expected, _ = self._last
            other._last = load, expected, _Whitening(expected.parts, spectra.parts)
        return other

    def expected(self, point: Point) -> F64:
        """(p^2, b, m) parts of the expected spectra, up to the road's level."""
        return self._solved(point)[0].parts[:, 0]

    def cost(self, point: Point) -> float:
        """Negative log-likelihood, up to a constant."""
        return float(self._cost(self._solved(point)[1])[0])

    def costs(self, points: Sequence[Point]) -> F64:
        """(k,) costs of several points, a few of them solved at once."""
        theta, load = np.array([one.theta for one in points]), np.array([one.loaded for one in points]).T
        theta = theta[:1] if (theta == theta[0]).all() else theta
        parts = [slice(first, first + AT_ONCE) for first in range(0, len(points), AT_ONCE)]
        solved = (Expected(theta if len(theta) == 1 else theta[i], load[:, i], self._groups).parts for i in parts)
        return np.concatenate([self._cost(_Whitening(one, self.spectra.parts)) for one in solved])

    def misfit(self, point: Point) -> float:
        """Likelihood ratio against free matrices at every group and frequency, over what a correct model has: 1.

        Groups with no more segments than sensors are left out: their matrices are near-singular by chance.
        """
        p, many = self._p, self.spectra.n_segments[:, 0] > self._p
        if not many.any():
            return float("nan")
        whitened = self._solved(point)[1]
        measured = np.linalg.slogdet(_matrices(self.spectra.parts[:, many]))[1]
        excess = p * np.log(whitened.trace[0, many] / p) + whitened.log_determinant[0, many] - measured
        n = self.spectra.n_segments[many]
        return float(np.sum(n * excess) / (np.sum(n * _usual_excess(n, p)) * excess.shape[1]))

    def curvature(self, point: Point, free: Sequence[int]) -> Curvature:
        """Derivatives by the ``free`` entries of theta (n,) and, numbered from n on, of ``Point.loaded``."""
        expected, whitening = self._solved(point)
        slopes = slopes_of(expected, free)
        gradient, information = self._curved(expected, whitening, slopes)
        return Curvature(gradient @ slopes.by, slopes.by.T @ information @ slopes.by)

    def _solved(self, point: Point) -> tuple[Expected, "_Whitening"]:
        """The solution at a point, cached: a search asks for the cost and then for the slopes."""
        load = point.loaded
        if self._last is None or self._last[0] != load or not np.array_equal(self._last[1].theta[0], point.theta):
            expected = Expected(np.array(point.theta)[None], np.array(load)[:, None], self._groups)
            self._last = load, expected, _Whitening(expected.parts, self.spectra.parts)
        return self._last[1:]

    def _cost(self, whitening: "_Whitening") -> F64:
        """(k,) cost of whitened spectra: that of their shape plus that of the road's level."""
        log_trace = np.log(whitening.trace)
        shape = self._p * log_trace + whitening.log_determinant
        level = _centred(log_trace).reshape(len(log_trace), -1) * self._each_root_level_weight
        of_level = (level**2).sum(axis=1) - (level @ self._sloping) ** 2 / self._level_stiffness
        return np.asarray(shape.reshape(len(shape), -1) @ self._each_n + 0.5 * of_level)

    def _curved(self, expected: Expected, whitening: "_Whitening", slopes: Slopes) -> tuple[F64, F64]:
        """Gradient (c,) and information (c, c) by the columns of ``slopes``.

        The information is the sum of products of the residuals' slopes: of the spectra's shape and, centred over the
        frequencies of each group and without their line, of the road's level. They are computed of the columns as they
        are; centring, the line and the growth of the noise are of low rank in each group and are added after.
        """
        p, dense, local = self._p, slopes.dense, slopes.local
        b, m = local.shape[2:]
        residual, by_part = self._by_part(whitening)
        noise, grows = expected.noise[:, 0], 0.5 / expected.sums[:, 0]
        # Below the rows, their products with those of each sensor's own power.
        own = by_part[:, :p]
        products = (own[:, :, None] * by_part[:, None]).sum(axis=0)
        rows = _times(np.concatenate([by_part, products]), dense)
        between = products[:, :p]
        noisy = (own * noise).sum(axis=1)
        # Of each group, for all columns: of the level its sum and its line, of all rows their products with the noise
        # and with the residuals.
        of_level = self._level_functionals @ rows[p * p - 1]
        of_rows = (np.stack([noisy, residual], axis=2).astype(np.float32) @ rows[: p * p]).sum(axis=0)
        of_own = np.empty((p, b, 4, m))
        of_own[:, :, 0] = own[-1]
        of_own[:, :, 1] = own[-1] * self._slope
        of_own[:, :, 2] = (between * noise).sum(axis=1)
        of_own[:, :, 3] = (own * residual[:, None]).sum(axis=0)
        of_local = of_own @ local.transpose(0, 2, 3, 1)
        of_dense = np.concatenate([of_level, of_rows], axis=1)
        sums, lines, noisy_by, pulls = np.concatenate([of_dense, *of_local], axis=2).swapaxes(0, 1)
        growth = np.concatenate([_growth(dense, grows), *_local_growth(local, grows)], axis=1)
        sums += noisy[-1].sum(axis=-1, keepdims=True) * growth
        lines += (noisy[-1] @ self._slope)[:, None] * growth
        line = self._root_level_weight[:, 0] @ lines
        gradient = pulls.sum(axis=0) + (noisy * residual).sum(axis=(0, 2)) @ growth
        noisy_by += (0.5 * (noisy**2).sum(axis=(0, 2)))[:, None] * growth
        information = _information(rows, between, local)
        crossed = noisy_by.T @ growth
        information += crossed
        information += crossed.T
        information -= sums.T @ (sums / m)
        information -= np.outer(line, line / self._level_stiffness)
        return gradient, information

    def _by_part(self, whitening: "_Whitening") -> tuple[F64, F64]:
        """The residuals (p^2, b, m) and their derivatives (p^2, p^2, b, m) by each part of the matrix.

        First the shape of the whitened spectra, weighted by the root of the number of segments, then the logarithm of
        their level.
        """
        map_, trace = whitening.map_of_parts()[:, :, 0], whitening.trace[0]
        seen = (map_ * self.spectra.parts).sum(axis=1)
        residual = seen * (-self._p / trace * self._root_n)
        level = self._root_level_weight * _centred(np.log(trace))
        residual[-1] = level
        residual[-1] -= (float(level.ravel() @ self._sloping) / self._level_stiffness) * self._sloping.reshape(
            level.shape
        )
        of_level = (map_ * seen[:, None]).sum(axis=0) * (-self._root_level_weight / trace)
        map_ *= self._root_n
        map_[-1] = of_level
        return residual, map_


class _Whitening:
    """L^-1 of matrices M = L L^H with these parts (p^2, k, b, m), and the trace (k, b, m) of L^-1 S L^-H for spectra S
    with parts (p^2, b, m).
    """

    def __init__(self, parts: F64, spectra: F64) -> None:
        self._p = p = 2 if len(parts) == 4 else 3
        self._inverse = inverse = np.empty_like(parts)
        """Parts of L^-1: its diagonal, then real and imaginary part of each of PAIRS."""
        lower: dict[tuple[int, int], C128] = {}
        self.log_determinant: F64 = np.log(parts[0])
        for i in range(p):
            pivot = parts[i]
            crossed = []
            for j in range(i):
                pair = p + 2 * PAIRS.index((i, j))
                one = inverse[j] * (parts[pair] - 1j * parts[pair + 1])
                for h in range(j):
                    before = p + 2 * PAIRS.index((i, h))
                    one = one + lower[j, h] * (parts[before] - 1j * parts[before + 1])
                pivot = pivot - (one.real**2 + one.imag**2)
                crossed.append(np.conj(one))
            if i:
                pivot = np.maximum(pivot, 1e-12 * parts[i])
                self.log_determinant = self.log_determinant + np.log(pivot)
            np.divide(1.0, np.sqrt(pivot), out=inverse[i])
            for j in range(i):
                one = crossed[j] * inverse[j]
                for h in range(j + 1, i):
                    one = one + crossed[h] * lower[h, j]
                lower[i, j] = one * -inverse[i]
                pair = p + 2 * PAIRS.index((i, j))
                inverse[pair], inverse[pair + 1] = lower[i, j].real, lower[i, j].imag
        self._products = (inverse[:, None] * inverse).reshape(p**4, -1)
        of_trace = _bilinear(p)[-p * p :] @ self._products
        self.trace: F64 = (of_trace.reshape(parts.shape) * spectra[:, None]).sum(axis=0) * p**0.5

    def map_of_parts(self) -> F64:
        """(p^2, p^2, k, b, m): a matrix's parts to those of L^-1 S L^-H in the basis of _bilinear."""
        p = self._p
        return (_bilinear(p) @ self._products).reshape(p * p, p * p, *self.trace.shape)


@cache
def _bilinear(p: int) -> F64:
    """(p^4, p^4): the map of parts to those of K S K^H, from products of parts of a lower triangular K.

    The result's parts are in an orthonormal basis of Hermitian matrices: traceless ones, and last the unit matrix.
    """
    units = [np.zeros((p, p), complex) for _ in range(p * p)]
    lower = [np.zeros((p, p), complex) for _ in range(p * p)]
    for i in range(p):
        units[i][i, i] = lower[i][i, i] = 1.0
    for pair, (i, j) in enumerate(PAIRS[: p * (p - 1) // 2]):
        for part, one in ((p + 2 * pair, 1.0), (p + 2 * pair + 1, 1j)):
            units[part][i, j], units[part][j, i], lower[part][i, j] = one, np.conj(one), one
    diagonals = [np.diag([1.0] * i + [-float(i)] + [0.0] * (p - i - 1)) / (i * (i + 1)) ** 0.5 for i in range(1, p)]
    basis = [*diagonals, *(unit / 2.0**0.5 for unit in units[p:]), np.eye(p) / p**0.5]
    found = np.einsum("rab,ubc,scd,vad->rsuv", *(np.array(one) for one in (basis, lower, units)), np.conj(lower))
    return np.ascontiguousarray(found.real).reshape(p**4, p**4)


def _usual_excess(n: F64, p: int) -> F64:
    """What p log(tr W / p) - log det W is on average for a mean W of n independent X X^H about the unit matrix.

    About (p^2 - 1) / 2n, and more for few. By the moments of the complex Wishart distribution: tr(n W) is a gamma
    variable of n p, and n^p det W a product of those of n, n - 1, ... (N. R. Goodman, Ann. Math. Stat. 34, 1963).
    """
    log_trace = _digamma(n * p) - np.log(n * p)
    return np.asarray(p * log_trace + p * np.log(n) - sum(_digamma(n - i) for i in range(p)))


def _digamma(n: F64) -> F64:
    """The mean logarithm of a gamma variable of a whole number n >= 1."""
    below = np.r_[0.0, np.cumsum(1.0 / np.arange(1, max(2, int(n.max()))))]
    return np.asarray(below[n.astype(int) - 1] - np.euler_gamma)


def _matrices(parts: F64) -> C128:
    """(..., p, p) of the parts (p^2, ...)."""
    p = 2 if len(parts) == 4 else 3
    found = np.empty((*parts.shape[1:], p, p), complex)
    for i in range(p):
        found[..., i, i] = parts[i]
    for pair, (i, j) in enumerate(PAIRS[: p * (p - 1) // 2]):
        found[..., i, j] = parts[p + 2 * pair] + 1j * parts[p + 2 * pair + 1]
        found[..., j, i] = np.conj(found[..., i, j])
    return found


def _times(by_part: F64, dense: F32) -> F32:
    """(q, b, m, r) of by_part (q, p^2, b, m) and dense (b, m + 2, p^2, r), whose neighbouring frequencies a Hann taper
    mixes with weights 1:4:1.
    """
    q, parts, b, m = by_part.shape
    mixed = np.ascontiguousarray(by_part.reshape(q * parts, b * m).T, np.float32).reshape(-1, parts) @ _hann(parts)
    found = buffer("rows", (q, b, m, dense.shape[-1]))
    np.matmul(mixed.reshape(b, m, q, 3 * parts), _window(dense), out=found.transpose(1, 2, 0, 3))
    return found


@cache
def _hann(parts: int) -> F32:
    return np.kron([[1.0, 4.0, 1.0]], np.eye(parts)).astype(np.float32)


def _information(rows: F32, between: F64, local: F64) -> F64:
    """(c, c) products of all columns' rows: rows (p^2 + p, b, m, r) of the dense ones, the last p their products with
    those of each sensor's own power, which are local (p, 11, b, m) with products ``between`` (p, p, b, m).
    """
    p, k, b, m = local.shape
    r = rows.shape[-1]
    flat, beside = rows[: p * p].reshape(p * p * b * m, r), rows[p * p :].reshape(p, b * m, r)
    columns = local.reshape(p, k, b * m)
    found = np.empty((r + p * k, r + p * k))
    found[:r, :r] = flat.T @ flat
    found[r:, :r] = (columns.astype(np.float32) @ beside).reshape(p * k, r)
    found[:r, r:] = found[r:, :r].T
    each = columns[:, None] * between.reshape(p, p, 1, b * m)
    for j in range(p):
        found[r:, r + j * k : r + (j + 1) * k] = each[:, j].reshape(p * k, b * m) @ columns[j].T
    return found


def _window(dense: F32) -> F32:
    """(b, m, 3 p^2, r) view of (b, m + 2, p^2, r): each frequency with its neighbours."""
    b, m, parts, r = dense.shape
    return as_strided(dense, (b, m - 2, 3 * parts, r), dense.strides, writeable=False)


def _growth(dense: F32, grows: F64) -> F64:
    """(b, r) relative growth of the noise with each dense column."""
    taken = np.full(dense.shape[1], 6.0)
    taken[[0, 1, -2, -1]] = 1.0, 5.0, 5.0, 1.0
    weights = (grows[:, :, None] * taken).astype(np.float32)
    return np.asarray((weights[:, :, None] @ np.moveaxis(dense[:, :, :2], 2, 0)).sum(axis=0))[:, 0]


def _local_growth(local: F64, grows: F64) -> list[F64]:
    """(b, 11) of each sensor's own."""
    found = np.zeros((len(local), local.shape[2], local.shape[1]))
    found[:2, :, :-1] = (local[:2, :-1].sum(axis=-1) * grows[:, None]).swapaxes(1, 2)
    return list(found)


def _centred(level: F64) -> F64:
    """``level`` minus its mean over frequency, because every group of segments has its own road level."""
    return np.asarray(level - level.sum(axis=-1, keepdims=True) / level.shape[-1])
