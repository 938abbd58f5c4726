"""The frequency bands of the ratio index: chosen on the vehicle's own known-load drives, or the paper's.

A mean spectrum scatters about its expectation, and so does any integral of it. Transforms of half-overlapping Hann
segments are correlated: neighbouring bins through their common main lobe, neighbouring segments through their common
half. For a Gaussian signal the complex correlation of two transforms follows from the taper alone (Welch 1967; Percival
and Walden, Spectral Analysis for Physical Applications, section 6.17), and that of their magnitudes from it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Final, Literal

import numpy as np

from gateway.calibration.ratio_index.spectra_table import N_SEGMENT, SpectrumTable
from gateway.core.late import special, stats
from gateway.core.ratio_index.index import PAPER_BANDS, UPPER_LIMIT_HZ, Band, band_pass_gain
from gateway.errors import CalibrationImpossibleError
from gateway.records import F64, I64

BandChoice = Literal["campaign", "table2"]

WIDTHS_HZ: Final = (0.25, 0.5, 1.0)  # chosen: narrower bands scatter too much to be selected on a few runs
# chosen: an even grid over the band of the integrals
CENTRES_HZ: Final = np.arange(1.0, UPPER_LIMIT_HZ - 0.4, 0.25)
N_CANDIDATES: Final = 12  # chosen: pairs per sensor and width


RELATIVE_VARIANCE: Final = 4.0 / np.pi - 1.0  # (standard deviation / mean)^2 of one transform's magnitude (Rayleigh)


@dataclass(frozen=True, slots=True)
class BandPair:
    """Numerator and denominator, and how their log ratio follows its target over the runs of a campaign.

    ``significance`` is the squared partial correlation without the other target, with a residual no smaller than the
    spectra's own scatter; ``monotonicity`` is the rank correlation of the same residuals. Both are NaN for given bands.
    """

    bands: tuple[Band, Band]
    significance: float = float("nan")
    monotonicity: float = float("nan")


Pairs = tuple[BandPair | None, BandPair | None]  # of acceleration and of pitch rate; None without the sensor


def ratios(table: SpectrumTable, sensor: int, pair: BandPair | None) -> F64:
    """One sensor's index (n,), the integrals of the spectra through both band-passes (6), one over the other."""
    spectra = table.spectra[sensor]
    if pair is None or spectra is None:
        return np.full(len(table.run), np.nan)
    passed = spectra @ _band_weights(table.freq_hz, pair.bands).T
    return np.asarray(passed[:, 0] / passed[:, 1])


def candidates(table: SpectrumTable, bands: BandChoice) -> list[Pairs]:
    """Band pairs worth a regression: the most significant of the campaign for each width, or the paper's alone.

    Raises CalibrationImpossibleError if no pair follows the load.
    """
    if bands == "table2":
        paper = (BandPair(PAPER_BANDS["acceleration"]), BandPair(PAPER_BANDS["pitch_rate"]))
        of_a, of_g = (None if seen is None else pair for seen, pair in zip(table.spectra, paper, strict=True))
        return [(of_a, of_g)]
    pairs: list[Pairs] = []
    for width_hz in WIDTHS_HZ:
        of_each = [
            [None] if spectra is None else candidate_pairs(table, sensor, width_hz, N_CANDIDATES)
            for sensor, spectra in enumerate(table.spectra)
        ]
        pairs.extend(product(of_each[0], of_each[1]))
    if not pairs:
        raise CalibrationImpossibleError(
            "no pair of bands follows the load over these runs: drive more different loads"
        )
    return pairs


def candidate_pairs(table: SpectrumTable, sensor: int, width_hz: float, n_best: int) -> list[BandPair]:
    """The ``n_best`` pairs of one width whose log ratio follows the sensor's target best, without neighbours.

    Runs are the independent observations, so the batches of a run are averaged first. The linear effect of the other of
    payload and share is removed from both sides, because a campaign's loads and shares are correlated. The numerator
    rises with the target against the denominator, as J > 0 over J < 0 in (4) and (5). The measure is significance times
    monotonicity, not the raw difference, which is largest for the narrowest bands with the most scatter.
    """
    spectra = table.spectra[sensor]
    if spectra is None:
        return []
    bands = [Band(float(centre), width_hz) for centre in CENTRES_HZ]
    weights = _band_weights(table.freq_hz, bands)
    rest, aim = partial_residuals(
        table.run, np.log(spectra @ weights.T), table.targets[sensor], table.targets[1 - sensor]
    )
    strength = _significance(rest, aim, _log_scatter(table, spectra, weights) * (1.0 - 2.0 / len(rest)))
    peaks = _peaks(strength, n_best)
    if not peaks:
        return []
    order = rank_correlations(np.column_stack([rest[:, i] - rest[:, j] for i, j in peaks]), aim)
    pairs = [
        BandPair((bands[i], bands[j]), float(strength[i, j]), float(rho))
        for (i, j), rho in zip(peaks, order, strict=True)
    ]
    return sorted(pairs, key=lambda pair: -pair.significance * pair.monotonicity)


def partial_residuals(run: I64, levels: F64, target: F64, other: F64) -> tuple[F64, F64]:
    """Run means of levels (r, b) and target (r,) less what is linear in ``other``; all inputs (n, ...)."""
    columns = np.column_stack([levels, target, other])
    by_run = np.array([columns[run == number].mean(axis=0) for number in np.unique(run)])
    nuisance = np.column_stack([np.ones(len(by_run)), by_run[:, -1]])
    residual = by_run[:, :-1] - nuisance @ np.linalg.lstsq(nuisance, by_run[:, :-1], rcond=None)[0]
    return residual[:, :-1], residual[:, -1]


def rank_correlations(columns: F64, target: F64) -> F64:
    """Spearman's rank correlation of each column (r, b) with target (r,); 0 for a constant column."""
    ranks, aim = stats.rankdata(columns.round(12), axis=0), stats.rankdata(target.round(12))
    ranks, aim = ranks - ranks.mean(axis=0), aim - aim.mean()
    with np.errstate(divide="ignore", invalid="ignore"):
        rho: F64 = np.nan_to_num(aim @ ranks / (np.linalg.norm(ranks, axis=0) * np.linalg.norm(aim)))
    return rho


def _band_weights(freq_hz: F64, bands: Sequence[Band]) -> F64:
    """Gains (b, m) of the band-passes (6) for an amplitude spectrum."""
    return np.array([band_pass_gain(freq_hz, band) for band in bands])


def _log_scatter(table: SpectrumTable, spectra: F64, weights: F64) -> F64:
    """Sum over runs of the covariance (b, b) of log band levels due to the scatter of spectra alone."""
    mean = spectra.mean(axis=0)
    level = weights @ mean
    covariance = bin_covariance(N_SEGMENT, len(table.freq_hz))
    through = weights * mean
    of_one_segment = through @ covariance @ through.T / np.outer(level, level)
    per_run = [table.n_segments[table.run == number].sum() for number in np.unique(table.run)]
    scatter: F64 = of_one_segment * np.sum(1.0 / np.array(per_run))
    return scatter


def _significance(rest: F64, aim: F64, scatter: F64) -> F64:
    """Squared partial correlations (b, b) of every log ratio with the target; 0 where the ratio falls."""
    slope = rest.T @ aim
    joint = slope[:, None] - slope[None, :]
    total = _of_differences(rest.T @ rest)
    with np.errstate(divide="ignore", invalid="ignore"):
        explained = joint**2 / (aim @ aim)
        residual = np.maximum(total - explained, _of_differences(scatter))
        strength: F64 = np.where((joint > 0.0) & (total > 0.0), explained / (explained + residual), 0.0)
    return np.nan_to_num(strength)


def _of_differences(covariance: F64) -> F64:
    """Variances (b, b) of all differences of two of b variables."""
    own = np.diag(covariance)
    spread: F64 = own[:, None] + own[None, :] - 2.0 * covariance
    return spread


def _peaks(strength: F64, n_best: int) -> list[tuple[int, int]]:
    """Places of the greatest strengths (b, b), each separate from those before it."""
    strength = strength.copy()
    peaks: list[tuple[int, int]] = []
    while len(peaks) < n_best:
        i, j = (int(k) for k in np.unravel_index(int(np.argmax(strength)), strength.shape))
        if strength[i, j] <= 0.0:
            break
        peaks.append((i, j))
        strength[max(0, i - 1) : i + 2, max(0, j - 1) : j + 2] = 0.0
    return peaks


def bin_covariance(n_segment: int, n_bins: int) -> F64:
    """Covariance (n_bins, n_bins) of relative errors of a mean amplitude spectrum, times the number of its segments.

    For many segments in one unbroken stretch, overlapping by half as in core.ratio_index.mean_spectrum.
    """
    taper = np.hanning(n_segment + 1)[:-1]
    half = n_segment // 2
    same = np.fft.fft(taper**2)[:n_bins]
    next_one = np.fft.fft(taper[half:] * taper[: n_segment - half], n_segment)[:n_bins]
    coherence = np.abs(np.array([same, next_one])) / np.sum(taper**2)
    # of two magnitudes of jointly Gaussian transforms
    products = np.asarray(special.hyp2f1(-0.5, -0.5, 1.0, np.minimum(coherence**2, 1.0)), dtype=float)
    alike = (products - 1.0) / RELATIVE_VARIANCE
    by_distance = RELATIVE_VARIANCE * (alike[0] + 2.0 * alike[1])
    away = np.abs(np.subtract.outer(np.arange(n_bins), np.arange(n_bins)))
    covariance: F64 = by_distance[away]
    return covariance
