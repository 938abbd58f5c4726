"""J of (4) and (5) over the plane of band centre and width, over its scatter, and the trend of each band over runs."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.calibration.ratio_index.bands import partial_residuals
from gateway.calibration.ratio_index.scatter import bin_covariance, integral_covariance
from gateway.calibration.ratio_index.table import N_SEGMENT, SPECTRUM, SpectrumTable
from gateway.core.ratio_index.index import UPPER_LIMIT_HZ
from gateway.records import F64, Bool

MAP_WIDTHS_HZ: Final = (0.05, 0.1, 0.25, 0.5, 1.0)  # from the paper's grid floor upwards
LEAST_HZ: Final = 0.5  # below it braking and slopes move the body, not the road's roughness


@dataclass(frozen=True, slots=True)
class BandMap:
    """One sensor's bands: centres_hz (m,), widths_hz (w,), and for each a cell (w, m); NaN where it does not fit.

    ``sensor`` is 0 for acceleration, 1 for pitch rate. ``difference`` is J in the unit of the spectrum between
    the two ``extremes`` (least and most payload in kg, front share in percent), ``z`` the same in standard
    deviations of its scatter where both spectra are of stationary Gaussian signals. J knows neither another
    road nor the runs between: ``trend`` is the partial correlation, over all runs, of the band's log level
    (less that of the whole spectrum, as rough a road as it may be) with the target, the other target taken out.
    """

    sensor: int
    extremes: tuple[float, float]
    centres_hz: F64
    widths_hz: F64
    difference: F64
    z: F64
    trend: F64


def band_maps(table: SpectrumTable) -> tuple[BandMap, ...]:
    """The map of every sensor there; of pitch rate only with different front shares."""
    sensors = (0, 1) if table.n_shares > 1 else (0,)
    return tuple(
        _band_map(table, sensor, spectra) for sensor in sensors if (spectra := table.spectra[sensor]) is not None
    )


def rectangle_weights(freq_hz: F64, centres_hz: F64, width_hz: float) -> F64:
    """Weights (m, k) that average a spectrum (k,) over [f - w/2, f + w/2], of (4) and (5); NaN beyond the spectrum.

    A bin stands for the frequencies half a bin to either side and counts by what the band covers of them.
    """
    bin_hz = freq_hz[1] - freq_hz[0]
    low, high = centres_hz[:, None] - width_hz / 2.0, centres_hz[:, None] + width_hz / 2.0
    covered = np.minimum(high, freq_hz + bin_hz / 2.0) - np.maximum(low, freq_hz - bin_hz / 2.0)
    weights: F64 = np.maximum(covered, 0.0) / width_hz
    weights[(low[:, 0] < LEAST_HZ) | (high[:, 0] > UPPER_LIMIT_HZ)] = np.nan
    return weights


def _band_map(table: SpectrumTable, sensor: int, spectra: F64) -> BandMap:
    target = table.targets[sensor]
    extremes = float(np.min(target)), float(np.max(target))
    centres_hz = table.freq_hz[table.freq_hz >= LEAST_HZ]
    weights = np.concatenate([rectangle_weights(table.freq_hz, centres_hz, width_hz) for width_hz in MAP_WIDTHS_HZ])
    fits = np.all(np.isfinite(weights), axis=1)
    (low, low_var), (high, high_var) = (_averages(table, spectra, weights[fits], target == end) for end in extremes)
    levels = np.log(spectra @ weights[fits].T) - np.log(spectra.mean(axis=1, keepdims=True))
    rest, aim = partial_residuals(table.run, levels, target, table.targets[1 - sensor])
    with np.errstate(divide="ignore", invalid="ignore"):
        trend = np.nan_to_num(rest.T @ aim / (np.linalg.norm(rest, axis=0) * np.linalg.norm(aim)))
    cells = np.full((3, len(weights)), np.nan)
    cells[:, fits] = high - low, (high - low) / np.sqrt(low_var + high_var), trend
    return BandMap(sensor, extremes, centres_hz, np.array(MAP_WIDTHS_HZ), *cells.reshape(3, -1, len(centres_hz)))


def _averages(table: SpectrumTable, spectra: F64, weights: F64, chosen: Bool) -> tuple[F64, F64]:
    """Averages (b,) over each band of the mean spectrum of the batches chosen (n,), and their variances (b,)."""
    n_segments = table.n_segments[chosen]
    mean = n_segments @ spectra[chosen] / n_segments.sum()
    covariance = bin_covariance(N_SEGMENT, len(table.freq_hz), SPECTRUM)
    return weights @ mean, np.diag(integral_covariance(weights, mean, float(n_segments.sum()), covariance))
