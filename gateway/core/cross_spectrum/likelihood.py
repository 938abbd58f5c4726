"""Whittle's likelihood of averaged cross-spectra when the road's level is not known.

An average of n tapered transforms X X^H follows a complex Wishart law about Sigma = s M, with M the
model's 2x2 matrix and s the road's density. For unknown s the likelihood is greatest at
s = tr(M^-1 S) / 2 and leaves, per group and frequency,

    n ( 2 log tr(M^-1 S) + log det M ),

which does not depend on the road at all. What the level itself may say is admitted only as far as a
road is smooth: log s is a line in log f, known to within ROAD_RIPPLE, and nothing more.

(P. Whittle, "The analysis of multiple stationary time series", J. R. Stat. Soc. B 15, 1953.)
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.core.cross_spectrum.measured import CrossSpectra
from gateway.core.cross_spectrum.model.expected import expected_spectra, spectral_model, spectral_slopes
from gateway.core.cross_spectrum.model.parameters import Ground
from gateway.core.vehicle import Load
from gateway.records import C128, F64

EFFECTIVE_SHARE: Final = 0.5  # neighbouring Hann bins and half-overlapping segments repeat each other
ROAD_RIPPLE: Final = 0.3  # standard deviation of log s about its line; chosen, as docs/sensitivity.md shows
ROAD_SLOPE_STD: Final = 0.3


@dataclass(frozen=True, slots=True)
class Point:
    """Where the likelihood is looked at: parameters theta (p,), payload and front share (0..1)."""

    theta: F64
    payload_kg: float
    front_share: float

    @classmethod
    def of(cls, theta: F64, load: Load) -> "Point":
        """The parameters with a load."""
        return cls(theta, load.payload_kg, load.front_share)

    @property
    def load(self) -> Load:
        """The load alone."""
        return Load(self.payload_kg, 100.0 * self.front_share)


@dataclass(frozen=True, slots=True)
class Curvature:
    """Gradient (k,) and expected second derivative (k, k) of the negative log-likelihood."""

    gradient: F64
    information: F64


@dataclass(frozen=True, slots=True)
class _Whitened:
    """L^-1 S L^-H for M = L L^H, with what is needed to whiten other matrices alike; arrays (b, m)."""

    root_a: F64
    root_g: F64
    ratio: C128
    z_aa: F64
    z_gg: F64
    z_ga: C128

    @property
    def trace(self) -> F64:
        return self.z_aa + self.z_gg


class Whittle:
    """The likelihood of one set of spectra. ``weight`` scales all its evidence (1: as counted)."""

    def __init__(self, spectra: CrossSpectra, ground: Ground, weight: float = 1.0) -> None:
        self.spectra = spectra
        self.ground = ground
        self._weight = weight
        self._n = spectra.n_segments * (EFFECTIVE_SHARE * weight)
        freq_hz = spectra.freq_hz[1:-1]
        self._level_weight = self._n / (0.5 + ROAD_RIPPLE**2 * float(np.sum(self._n)))
        self._slope = _centred(np.log(freq_hz))

    def cost(self, point: Point) -> float:
        """Negative log-likelihood, up to a constant."""
        whitened = self._whitened(point)
        return self._shape_cost(whitened) + self._level_cost(whitened)

    def misfit(self, point: Point) -> float:
        """Likelihood ratio per degree of freedom against matrices free at every group and frequency.

        About 1 if all is right, whatever the weight. Groups of fewer than three segments are left
        out: their matrices are near-singular by chance.
        """
        whitened = self._whitened(point)
        many = self.spectra.n_segments[:, 0] >= 3
        if not many.any():
            return float("nan")
        determinant = whitened.z_aa * whitened.z_gg - np.abs(whitened.z_ga) ** 2
        excess = 2.0 * np.log(whitened.trace / 2.0) - np.log(np.maximum(determinant, np.finfo(float).tiny))
        evidence = 2.0 * np.sum(self._n[many] * excess[many]) / self._weight
        return float(evidence / (3.0 * excess[many].size))

    def curvature(self, point: Point, free: list[int], is_load_free: bool) -> Curvature:
        """Derivatives for the ``free`` entries of theta, then payload and front share where these are free."""
        whitened = self._whitened(point)
        d_aa, d_gg, d_ga = self._whitened_derivatives(point, whitened, free, is_load_free)
        k = len(d_aa)
        root_n = np.sqrt(self._n)
        shape = np.stack([(d_aa - d_gg) / np.sqrt(2), np.sqrt(2) * d_ga.real, np.sqrt(2) * d_ga.imag]) * root_n
        z = whitened
        residual = np.stack([(z.z_aa - z.z_gg) / np.sqrt(2), np.sqrt(2) * z.z_ga.real, np.sqrt(2) * z.z_ga.imag])
        residual = residual * (2.0 / z.trace) * root_n
        rows = np.moveaxis(shape, 1, 0).reshape(k, -1)
        d_level = -(d_aa * z.z_aa + d_gg * z.z_gg + 2.0 * np.real(d_ga * np.conj(z.z_ga))) / z.trace
        level_gradient, level_information = self._level_curvature(z, d_level)
        return Curvature(
            gradient=level_gradient - rows @ residual.ravel(),
            information=level_information + rows @ rows.T,
        )

    def _whitened(self, point: Point) -> _Whitened:
        load = np.array(point.payload_kg), np.array(point.front_share)
        model = spectral_model(point.theta, *load, self.ground, self.spectra.freq_hz)
        m_aa, m_gg, m_ga = expected_spectra(model, self.spectra)
        root_a = np.sqrt(m_aa)
        ratio = m_ga / m_aa
        root_g = np.sqrt(np.maximum(m_gg - np.abs(ratio) ** 2 * m_aa, 1e-12 * m_gg))
        whitened = _whiten(
            root_a, root_g, ratio, self.spectra.acceleration, self.spectra.pitch_rate, self.spectra.cross
        )
        return _Whitened(root_a, root_g, ratio, *whitened)

    def _whitened_derivatives(
        self, point: Point, at: _Whitened, free: list[int], is_load_free: bool
    ) -> tuple[F64, F64, C128]:
        """Slopes of the model matrix, whitened: three arrays (k, b, m)."""
        load = (point.payload_kg, point.front_share)
        d_aa, d_gg, d_ga = spectral_slopes(point.theta, load, self.ground, self.spectra, free, is_load_free)
        return _whiten(at.root_a, at.root_g, at.ratio, d_aa, d_gg, d_ga)

    def _shape_cost(self, z: _Whitened) -> float:
        return float(np.sum(self._n * 2.0 * (np.log(z.trace) + np.log(z.root_a) + np.log(z.root_g))))

    def _level_cost(self, z: _Whitened) -> float:
        level = _centred(np.log(z.trace / 2.0))
        w, x = self._level_weight, self._slope
        along, stiffness = np.sum(w * x * level), np.sum(w * x * x) + ROAD_SLOPE_STD**-2
        return float(0.5 * (np.sum(w * level**2) - along**2 / stiffness))

    def _level_curvature(self, z: _Whitened, d_level: F64) -> tuple[F64, F64]:
        level, d = _centred(np.log(z.trace / 2.0)), _centred(d_level)
        w, x = self._level_weight, self._slope
        along, stiffness = np.sum(w * x * level), np.sum(w * x * x) + ROAD_SLOPE_STD**-2
        d_along = np.sum(w * x * d, axis=(1, 2))
        gradient = np.sum(w * level * d, axis=(1, 2)) - along * d_along / stiffness
        rows = (d * np.sqrt(w)).reshape(len(d), -1)
        return gradient, rows @ rows.T - np.outer(d_along, d_along) / stiffness


def _whiten(root_a: F64, root_g: F64, ratio: C128, aa: F64, gg: F64, ga: C128) -> tuple[F64, F64, C128]:
    """L^-1 [[aa, ga*], [ga, gg]] L^-H for L = [[root_a, 0], [ratio root_a, root_g]]."""
    lower = ga - ratio * aa
    z_gg = (gg - 2.0 * np.real(ga * np.conj(ratio)) + np.abs(ratio) ** 2 * aa) / root_g**2
    return aa / root_a**2, z_gg, lower / (root_a * root_g)


def _centred(level: F64) -> F64:
    """Less its mean over frequency: every group of segments has its own road level."""
    centred: F64 = level - level.mean(axis=-1, keepdims=True)
    return centred
