"""Whittle's likelihood of averaged cross-spectra with an unknown level of the road.

An average of n tapered transforms X X^H follows a complex Wishart distribution about Sigma = s M, with M the model's p
x p matrix (p sensors: two, or three with a roll rate) and s the road's density. For unknown s the likelihood has its
maximum at s = tr(M^-1 S) / p; its value there is, per group and frequency,

    n ( p log tr(M^-1 S) + log det M ),

which does not depend on the road. The level itself is used only as far as a road is smooth: log s is a line in log f,
within ROAD_RIPPLE.
(P. Whittle, "The analysis of multiple stationary time series", J. R. Stat. Soc. B 15, 1953.)
"""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from gateway.core.cross_spectrum.measured import CrossSpectra
from gateway.core.cross_spectrum.model.driven import are_in_motion
from gateway.core.cross_spectrum.model.expected import expected_of_driven, with_noise
from gateway.core.cross_spectrum.model.matrix import SpectralMatrix, Whitener
from gateway.core.cross_spectrum.model.motion import Motion
from gateway.core.cross_spectrum.model.parameters import Ground, has_roll
from gateway.core.cross_spectrum.model.slopes import Solved, beside, slopes_of_paths, solved_at, spectral_slopes
from gateway.core.vehicle import Load
from gateway.records import C128, F64

EFFECTIVE_SHARE: Final = 0.5  # chosen: neighbouring Hann bins and half-overlapping segments are correlated
ROAD_RIPPLE: Final = 0.3  # standard deviation of log s about its line; chosen
ROAD_SLOPE_STD: Final = 0.3  # chosen: of the line's slope
MOST_KEPT: Final = 48  # chosen: curvatures kept; a load under eight shapes needs about thirty
EVIDENCE_WEIGHT: Final = 0.2  # chosen likewise: minutes of driving repeat the same model error


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
        """The parameters with a load."""
        return cls(theta, load.payload_kg, load.front_share, cg_left_m)

    @property
    def load(self) -> Load:
        """The load alone."""
        return Load(self.payload_kg, 100.0 * self.front_share)

    def is_at(self, other: "Point") -> bool:
        """Whether both points are equal."""
        return self.loaded == other.loaded and bool((self.theta == other.theta).all())

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

    def towards(self, entry: int, free: list[int], covariance: F64, pull: F64) -> tuple[float, float]:
        """Slope and information of one ``entry`` with the ``free`` parameters following; ``pull`` is the slope of
        those.

        ``covariance`` is that of the free parameters, prior included (C. R. Rao, Proc. Camb. Phil. Soc. 44, 1948).
        """
        along = self.information[entry, free] @ covariance
        information = self.information[entry, entry] - along @ self.information[free, entry]
        return float(self.gradient[entry] - along @ pull), float(information)


@dataclass(slots=True)
class _Whitened:
    """The model solved at a point, and L^-1 S L^-H for its M = L L^H, with what whitens other matrices alike.

    The trace is (b, m), residual (b m p^2,). rows (b m p^2, r) are slopes of the residual; rows @ by_known (r, k) are
    those by the ``known`` entries, those that have been asked for so far, each with its column.
    """

    point: Point
    solved: Solved
    by: Whitener
    seen: SpectralMatrix
    trace: F64
    residual: F64
    by_part: F64 | None = None
    known: dict[int, int] = field(default_factory=dict)
    rows: F64 | None = None
    by_known: F64 = field(default_factory=lambda: np.empty((0, 0)))


class Whittle:
    """The likelihood of one set of spectra. ``weight`` scales all evidence (1: full weight)."""

    def __init__(self, spectra: CrossSpectra, ground: Ground, weight: float = 1.0) -> None:
        self.spectra = spectra
        self.ground = ground
        self._p = spectra.n_sensors
        self._seen = spectra.matrix
        self._weight = weight
        self._n = spectra.n_segments * (EFFECTIVE_SHARE * weight)
        freq_hz = spectra.freq_hz[1:-1]
        self._level_weight = self._n / (1.0 / self._p + ROAD_RIPPLE**2 * float(np.sum(self._n)))
        self._root_level_weight = np.sqrt(self._level_weight)
        self._slope = _centred(np.log(freq_hz))
        self._level_stiffness = float(np.sum(self._level_weight * self._slope**2)) + ROAD_SLOPE_STD**-2
        self._last: _Whitened | None = None
        self._searched: tuple[int, ...] = ()  # a search's few entries: those for which slopes will be asked again
        self._curvatures: dict[tuple[bytes, tuple[float, ...], tuple[int, ...]], Curvature] = {}

    def showing(self, spectra: CrossSpectra) -> "Whittle":
        """The likelihood of other measurements of the same drive. It shares the model as last solved."""
        other = copy(self)
        other.spectra, other._seen, other._curvatures = spectra, spectra.matrix, {}
        if self._last is not None:
            other._last = other._seen_at(self._last.point, self._last.solved, self._last.by)
        return other

    def cost(self, point: Point) -> float:
        """Negative log-likelihood, up to a constant."""
        whitened = self._whitened(point)
        return float(self._cost(whitened.by, whitened.trace))

    def costs(self, points: Sequence[Point]) -> F64:
        """(k,) costs of several points, solved at once."""
        theta = np.array([point.theta for point in points])
        theta = theta[:1] if (theta == theta[0]).all() else theta
        loads = np.array([point.loaded for point in points]).T
        model, driven = solved_at(theta, tuple(loads), self.ground, self.spectra)
        by = Whitener.of(expected_of_driven(driven, model, self.spectra))
        return self._cost(by, _sum(by(self._seen).auto))

    def misfit(self, point: Point) -> float:
        """Likelihood ratio per degree of freedom against free matrices at every group and frequency.

        About 1 for a correct model, whatever the weight. Groups with no more segments than sensors are left out: their
        matrices are near-singular by chance.
        """
        whitened = self._whitened(point)
        many = self.spectra.n_segments[:, 0] > self._p
        if not many.any():
            return float("nan")
        determinant = _determinant(whitened.seen)
        excess = self._p * np.log(whitened.trace / self._p) - np.log(np.maximum(determinant, np.finfo(float).tiny))
        evidence = 2.0 * np.sum(self._n[many] * excess[many]) / self._weight
        return float(evidence / ((self._p**2 - 1.0) * excess[many].size))

    def curvature(self, point: Point, free: Sequence[int]) -> Curvature:
        """Derivatives by the ``free`` entries of theta (n,) and, numbered from n on, of ``Point.loaded``.

        The last few are cached: an answer asks again for those of its likeliest shape.
        """
        if not self._searched or len(free) < len(self._searched):
            self._searched = tuple(free)
        key = point.theta.tobytes(), point.loaded, tuple(free)
        if key not in self._curvatures:
            if len(self._curvatures) == MOST_KEPT:
                del self._curvatures[next(iter(self._curvatures))]
            self._curvatures[key] = self._curvature(point, free)
        return self._curvatures[key]

    def curvature_beside(
        self, point: Point, free: Sequence[int], by_level: Callable[[Motion], C128]
    ) -> tuple[Curvature, F64]:
        """Derivatives by k further causes, and their information (k, n) together with the ``free`` entries.

        ``by_level`` gives the derivatives of the paths (5, k, p, s, m) by these causes.
        """
        z = self._whitened(point)
        rows, by_free = self._rows(z, free)
        further = self._whitened_rows(z, slopes_of_paths(z.solved, self.spectra, by_level(z.solved.model.motion)))
        return self._curvature_of(z, further), self._information(further, rows) @ by_free

    def _curvature(self, point: Point, free: Sequence[int]) -> Curvature:
        z = self._whitened(point)
        rows, by_free = self._rows(z, free)
        whole = self._curvature_of(z, rows)
        return Curvature(whole.gradient @ by_free, by_free.T @ whole.information @ by_free)

    def _curvature_of(self, z: _Whitened, rows: F64) -> Curvature:
        """From the slopes (b m p^2, k) of the residuals."""
        return Curvature(z.residual @ rows, self._information(rows, rows))

    def _information(self, rows: F64, others: F64) -> F64:
        """(k, l) from two sets of slopes (b m p^2, k) and (b m p^2, l) of the residuals."""
        x = (self._root_level_weight * self._slope).ravel()
        along = x @ rows[self._p**2 - 1 :: self._p**2]
        other = along if others is rows else x @ others[self._p**2 - 1 :: self._p**2]
        information: F64 = rows.T @ others - along[:, None] * (other / self._level_stiffness)
        return information

    def _rows(self, z: _Whitened, free: Sequence[int]) -> tuple[F64, F64]:
        """(b m p^2, r) slopes of the residuals at a point, and (r, k) the combinations of them by the ``free`` entries.

        An answer asks for every parameter after its search asked for some.
        """
        missing = sorted(set(free).difference(z.known))
        in_motion = are_in_motion(missing, len(z.point.theta))
        missing = [*in_motion, *(entry for entry in missing if entry not in in_motion)]
        if missing:
            slopes, by_missing = spectral_slopes(z.solved, self.spectra, missing)
            rows = self._whitened_rows(z, slopes)
            z.rows = rows if z.rows is None else np.concatenate([z.rows, rows], axis=1)
            z.by_known = beside(z.by_known, by_missing)
            z.known |= {entry: len(z.known) + i for i, entry in enumerate(missing)}
        assert z.rows is not None
        return z.rows, z.by_known[:, [z.known[entry] for entry in free]]

    def _whitened_rows(self, z: _Whitened, slopes: F64) -> F64:
        """(b m p^2, k) the residuals' slopes, from those of the expected spectra (b, m, p^2, k)."""
        z.by_part = self._by_part(z) if z.by_part is None else z.by_part
        d = z.by_part @ slopes
        level = d[:, :, -1]
        level -= level.sum(axis=1, keepdims=True) / level.shape[1]
        level *= self._root_level_weight[:, None]
        return d.reshape(-1, slopes.shape[-1])

    def _by_part(self, z: _Whitened) -> F64:
        """(b, m, p^2, p^2) derivative of the whitened matrix by each part of the matrix.

        First its shape, weighted by the root of the number of segments, then minus the logarithm of its level.
        """
        units = z.by(SpectralMatrix.units(self._p))
        together = _sum(units.auto * z.seen.auto[:, None])
        together = together + 2.0 * _sum(np.real(units.cross * np.conj(z.seen.cross)[:, None]))
        rows = np.concatenate([_traceless(units) * np.sqrt(self._n), -together[None] / z.trace])
        return np.ascontiguousarray(rows.reshape(self._p**4, -1).T).reshape(*z.trace.shape, self._p**2, self._p**2)

    def _whitened(self, point: Point) -> _Whitened:
        """The solution at a point, cached: a search asks for the cost and then for the slopes."""
        if self._last is None or not self._last.point.is_at(point):
            solved = Solved.at(point.theta, point.loaded, self.ground, self.spectra, self._searched)
            by = Whitener.of(with_noise(solved.noiseless, solved.model, self.spectra))
            self._last = self._seen_at(point, solved, by)
        return self._last

    def _seen_at(self, point: Point, solved: Solved, by: Whitener) -> _Whitened:
        """The spectra as the model sees them that is solved at a point."""
        seen = by(self._seen)
        trace = _sum(seen.auto)
        level, x = self._root_level_weight * _centred(np.log(trace / self._p)), self._root_level_weight * self._slope
        level -= float(np.sum(x * level)) / self._level_stiffness * x
        shape = _traceless(seen) * (-self._p / trace * np.sqrt(self._n))
        return _Whitened(point, solved, by, seen, trace, np.array([*shape, level]).reshape(self._p**2, -1).T.ravel())

    def _cost(self, by: Whitener, trace: F64) -> F64:
        """(...) cost of whitened spectra with this trace (..., b, m): that of their shape plus that of the road's
        level.
        """
        shape = self._p * np.log(trace) + 2.0 * _sum(np.log(by.roots))
        level = _centred(np.log(trace / self._p))
        w = self._level_weight
        along = _over_all(w * self._slope * level)
        of_level = 0.5 * (_over_all(w * level**2) - along**2 / self._level_stiffness)
        return np.asarray(_over_all(self._n * shape) + of_level, np.float64)


def _sum(x: F64) -> F64:
    """Over sensors, or pairs of them."""
    total: F64 = x.sum(axis=0)
    return total


def _over_all(x: F64) -> F64:
    """Over groups and frequencies."""
    total: F64 = x.sum(axis=(-2, -1))
    return total


def _traceless(matrix: SpectralMatrix) -> F64:
    """(p^2 - 1, ...) traceless part of Hermitian matrices (p, ...), in an orthonormal basis."""
    auto, cross = matrix.auto, matrix.cross
    parts = [(auto[0] - auto[1]) / np.sqrt(2)]
    if len(auto) > 2:
        parts.append((auto[0] + auto[1] - 2.0 * auto[2]) / np.sqrt(6))
    for one in cross:
        parts += [np.sqrt(2) * one.real, np.sqrt(2) * one.imag]
    return np.array(parts)


def _determinant(matrix: SpectralMatrix) -> F64:
    """(b, m) of Hermitian matrices."""
    auto, cross = matrix.auto, matrix.cross
    determinant: F64 = auto[0] * auto[1] - np.abs(cross[0]) ** 2
    if len(auto) > 2:
        determinant = determinant * auto[2] - auto[1] * np.abs(cross[1]) ** 2 - auto[0] * np.abs(cross[2]) ** 2
        determinant = determinant + 2.0 * np.real(np.conj(cross[1]) * cross[2] * cross[0])
    return determinant


def _centred(level: F64) -> F64:
    """``level`` minus its mean over frequency, because every group of segments has its own road level."""
    centred: F64 = level - level.sum(axis=-1, keepdims=True) / level.shape[-1]
    return centred
