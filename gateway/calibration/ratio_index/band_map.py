"""J_L and J_D over the whole plane of band centre and width, with their scatter: what the choice of bands looked at."""

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from gateway.calibration.ratio_index.bands import partial_residuals, rank_correlations
from gateway.calibration.ratio_index.scatter import bin_covariance, integral_covariance
from gateway.calibration.ratio_index.table import IndexTable
from gateway.core.ratio_index.index import UPPER_LIMIT_HZ
from gateway.records import F64, Bool

Sensor = Literal["acceleration", "pitch_rate"]

MAP_WIDTHS_HZ: Final = (0.05, 0.1, 0.25, 0.5, 1.0)  # from the paper's grid floor upwards
LEAST_HZ: Final = 0.5  # below it braking and slopes move the body, not the road's roughness


@dataclass(frozen=True, slots=True)
class BandMap:
    """One sensor's bands: centres_hz (m,), widths_hz (w,), and for each a cell (w, m); NaN where it does not fit.

    ``difference`` is J of (4) or (5) in the unit of the spectrum between the two ``extremes`` (least and
    most payload in kg for acceleration, front share in percent for the pitch rate), ``difference_std``
    its scatter where both spectra are of stationary Gaussian signals. J knows neither another road nor
    the runs between: ``trend`` is the partial correlation, over all runs, of the band's log level (less
    that of the whole spectrum, as rough a road as it may be) with the target, the other target taken
    out, and ``monotonicity`` the rank correlation of the same residuals.
    """

    sensor: Sensor
    extremes: tuple[float, float]
    centres_hz: F64
    widths_hz: F64
    difference: F64
    difference_std: F64
    trend: F64
    monotonicity: F64

    @property
    def z(self) -> F64:
        """J in its own standard deviations (w, m)."""
        scores: F64 = self.difference / self.difference_std
        return scores


def band_maps(table: IndexTable) -> tuple[BandMap, ...]:
    """The map of every sensor there; of pitch rate only with different front shares."""
    found = []
    if table.acceleration is not None:
        found.append(_band_map(table, "acceleration", table.acceleration, table.payload_kg, table.front_share_pct))
    if table.pitch_rate is not None and table.n_shares > 1:
        found.append(_band_map(table, "pitch_rate", table.pitch_rate, table.front_share_pct, table.payload_kg))
    return tuple(found)


def rectangle_weights(freq_hz: F64, centres_hz: F64, width_hz: float) -> F64:
    """Weights (m, k) that average a spectrum (k,) over [f - w/2, f + w/2], of (4) and (5); NaN beyond the spectrum.

    A bin stands for the frequencies half a bin to either side and counts by what the band covers of them.
    """
    bin_hz = freq_hz[1] - freq_hz[0]
    low, high = centres_hz[:, None] - width_hz / 2.0, centres_hz[:, None] + width_hz / 2.0
    covered = np.minimum(high, freq_hz + bin_hz / 2.0) - np.maximum(low, freq_hz - bin_hz / 2.0)
    weights: F64 = np.maximum(covered, 0.0) / width_hz
    is_beyond = (low[:, 0] < LEAST_HZ) | (high[:, 0] > UPPER_LIMIT_HZ)
    weights[is_beyond] = np.nan
    return weights


def _band_map(table: IndexTable, sensor: Sensor, spectra: F64, target: F64, other: F64) -> BandMap:
    centres_hz = table.freq_hz[table.freq_hz >= LEAST_HZ]
    weights = np.stack([rectangle_weights(table.freq_hz, centres_hz, width_hz) for width_hz in MAP_WIDTHS_HZ])
    flat = weights.reshape(-1, weights.shape[-1])
    fits = np.all(np.isfinite(flat), axis=1)
    extremes = float(np.min(target)), float(np.max(target))
    difference, std = _differences(table, spectra, flat[fits], [target == extreme for extreme in extremes])
    trend, order = _trends(table, spectra, flat[fits], target, other)
    cells = np.full((4, len(flat)), np.nan)
    cells[:, fits] = difference, std, trend, order
    shaped = cells.reshape(4, len(MAP_WIDTHS_HZ), len(centres_hz))
    return BandMap(sensor, extremes, centres_hz, np.array(MAP_WIDTHS_HZ), *shaped)


def _differences(table: IndexTable, spectra: F64, weights: F64, ends: list[Bool]) -> tuple[F64, F64]:
    """J (b,) between the batches of two extremes (low, high), and its standard deviation (b,)."""
    covariance = bin_covariance(table.n_segment, len(table.freq_hz), table.kind)
    integrals, variance = [], np.zeros(len(weights))
    for is_end in ends:
        n_segments = table.n_segments[is_end]
        mean = n_segments @ spectra[is_end] / n_segments.sum()
        integrals.append(weights @ mean)
        variance += np.diag(integral_covariance(weights, mean, float(n_segments.sum()), covariance))
    return integrals[1] - integrals[0], np.sqrt(variance)


def _trends(table: IndexTable, spectra: F64, weights: F64, target: F64, other: F64) -> tuple[F64, F64]:
    """Partial correlation and rank correlation (b,) of relative log levels with the target over runs."""
    levels = np.log(spectra @ weights.T) - np.log(spectra.mean(axis=1, keepdims=True))
    rest, aim = partial_residuals(table.run, levels, target, other)
    scale = np.linalg.norm(rest, axis=0) * np.linalg.norm(aim)
    with np.errstate(divide="ignore", invalid="ignore"):
        trend: F64 = np.nan_to_num(rest.T @ aim / scale)
    return trend, rank_correlations(rest, aim)
