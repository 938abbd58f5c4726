"""How far a mean spectrum scatters about its expectation, and so anything integrated from it.

Transforms of half-overlapping Hann segments repeat each other: neighbouring bins by their common main
lobe, neighbouring segments by their common half. For a Gaussian signal the complex correlation of two
transforms follows from the taper alone (Welch 1967; Percival and Walden, Spectral Analysis for Physical
Applications, section 6.17), and that of their powers or magnitudes follows from it.
"""

from typing import Final

import numpy as np
from scipy.special import hyp2f1

from gateway.core.ratio_index.index import SpectrumKind
from gateway.records import F64

# (standard deviation / mean)^2 of one transform's power (exponential law) or magnitude (Rayleigh's)
RELATIVE_VARIANCE: Final[dict[SpectrumKind, float]] = {"power": 1.0, "amplitude": 4.0 / np.pi - 1.0}


def bin_covariance(n_segment: int, n_bins: int, kind: SpectrumKind) -> F64:
    """Covariance (n_bins, n_bins) of relative errors of a mean spectrum, times the number of its segments.

    Segments overlap by half, as in core.ratio_index.mean_spectrum; many of them, in one unbroken stretch.
    """
    taper = np.hanning(n_segment + 1)[:-1]
    half = n_segment // 2
    same = np.fft.fft(taper**2)[:n_bins]
    next_one = np.fft.fft(taper[half:] * taper[: n_segment - half], n_segment)[:n_bins]
    coherence = np.abs(np.array([same, next_one])) / np.sum(taper**2)
    alike = _correlation(coherence**2, kind)
    by_distance = RELATIVE_VARIANCE[kind] * (alike[0] + 2.0 * alike[1])
    away = np.abs(np.subtract.outer(np.arange(n_bins), np.arange(n_bins)))
    covariance: F64 = by_distance[away]
    return covariance


def _correlation(coherence2: F64, kind: SpectrumKind) -> F64:
    """Of powers or magnitudes of two jointly Gaussian transforms whose squared complex correlation is given."""
    if kind == "power":
        return coherence2
    products: F64 = np.asarray(hyp2f1(-0.5, -0.5, 1.0, np.minimum(coherence2, 1.0)), dtype=float)
    return (products - 1.0) / RELATIVE_VARIANCE["amplitude"]


def integral_covariance(weights: F64, spectrum: F64, n_segments: float, covariance: F64) -> F64:
    """Covariance (b, b) of the integrals ``weights @ spectrum`` of a mean over n_segments; weights (b, m).

    Twice the squared integral over its variance is the effective number of degrees of freedom of one.
    """
    through = weights * spectrum
    spread: F64 = through @ covariance @ through.T / n_segments
    return spread
