"""Which frequency bands tell load from road: found on the vehicle's own known-load drives."""

from dataclasses import dataclass

import numpy as np

from gateway.core.ratio_index import UPPER_LIMIT_HZ, Band, SpectrumKind, band_pass_gain
from gateway.records import F64, I64

WIDTHS_HZ = (0.05, 0.1, 0.25, 0.5, 1.0)  # from the paper's grid floor upwards
CENTRES_HZ = np.arange(1.0, UPPER_LIMIT_HZ - 0.4, 0.25)


@dataclass(frozen=True, slots=True)
class IndexTable:
    """Spectra of all identification batches with what is known of each.

    run (n,) numbers; payload_kg, front_share_pct (n,); freq_hz (m,); acceleration and pitch_rate (n, m),
    absent (None) where the sensor is not mapped.
    """

    run: I64
    payload_kg: F64
    front_share_pct: F64
    freq_hz: F64
    acceleration: F64 | None
    pitch_rate: F64 | None
    kind: SpectrumKind


@dataclass(frozen=True, slots=True)
class BandPair:
    """Numerator and denominator, and the squared partial correlation of log R with its target over runs."""

    bands: tuple[Band, Band]
    significance: float


def band_amplitudes(freq_hz: F64, spectra: F64, bands: list[Band], kind: SpectrumKind) -> F64:
    """Integrals (n, b) of the spectra (n, m) through each band-pass (6): either half of (7) and (8)."""
    order = 1 if kind == "amplitude" else 2
    gains = np.array([band_pass_gain(freq_hz, band) ** order for band in bands])
    passed: F64 = spectra @ gains.T
    return passed


def candidate_pairs(
    table: IndexTable, spectra: F64, target: F64, other: F64, width_hz: float, n_best: int
) -> list[BandPair]:
    """The ``n_best`` pairs of one width whose log ratio follows ``target`` (n,) best, neighbours left out.

    Runs are the independent observations, so the batches of a run are averaged first; what goes with
    ``other`` (the other of payload and share) linearly is taken out of both sides, because a
    campaign's loads and shares are correlated. The numerator rises with the target, J > 0, and the
    denominator falls against it, as in (4) and (5), but the measure is significance, not raw difference.
    """
    bands = [Band(float(centre), width_hz) for centre in CENTRES_HZ]
    levels = np.log(band_amplitudes(table.freq_hz, spectra, bands, table.kind))
    by_run = _run_means(table.run, np.column_stack([levels, target, other]))
    nuisance = np.column_stack([np.ones(len(by_run)), by_run[:, -1]])
    residual = by_run[:, :-1] - nuisance @ np.linalg.lstsq(nuisance, by_run[:, :-1], rcond=None)[0]
    levels, target = residual[:, :-1], residual[:, -1]
    covariance = levels.T @ levels
    variance = np.diag(covariance)[:, None] + np.diag(covariance)[None, :] - 2.0 * covariance
    slope = levels.T @ target
    joint = slope[:, None] - slope[None, :]
    with np.errstate(divide="ignore", invalid="ignore"):
        strength = np.where((joint > 0.0) & (variance > 0.0), joint**2 / (variance * (target @ target)), 0.0)
    return _peaks(np.nan_to_num(strength), bands, n_best)


def _peaks(strength: F64, bands: list[Band], n_best: int) -> list[BandPair]:
    pairs = []
    strength = strength.copy()
    for _ in range(n_best):
        i, j = np.unravel_index(int(np.argmax(strength)), strength.shape)
        if strength[i, j] <= 0.0:
            break
        pairs.append(BandPair((bands[i], bands[j]), float(strength[i, j])))
        strength[max(0, i - 1) : i + 2, max(0, j - 1) : j + 2] = 0.0
    return pairs


def _run_means(run: I64, columns: F64) -> F64:
    return np.array([columns[run == number].mean(axis=0) for number in np.unique(run)])
