"""The scatter stated for a mean spectrum, and so for J, is the scatter that noise has."""

from functools import cache

import numpy as np
import pytest
from scipy import signal

from gateway.calibration.ratio_index.bands import bin_covariance
from gateway.core.ratio_index.index import mean_spectrum
from gateway.records import F64

N_SEGMENT, RATE_HZ, N_DRIVES = 256, 50.0, 400
CENTRES_HZ = np.arange(1.5, 9.5, 1.0)


def rectangle_weights(freq_hz: F64, centres_hz: F64, width_hz: float) -> F64:
    """Weights (m, k) that average a spectrum (k,) over [f - w/2, f + w/2], as J of (4) and (5) does.

    A bin stands for the frequencies half a bin to either side and counts by what the band covers of them.
    """
    bin_hz = freq_hz[1] - freq_hz[0]
    low, high = centres_hz[:, None] - width_hz / 2.0, centres_hz[:, None] + width_hz / 2.0
    covered = np.minimum(high, freq_hz + bin_hz / 2.0) - np.maximum(low, freq_hz - bin_hz / 2.0)
    return np.maximum(covered, 0.0) / width_hz


@cache
def spectra_of_noise(is_coloured: bool) -> tuple[F64, F64, float]:
    """Frequencies (m,), mean spectra (N_DRIVES, m) of 100 s each, and the number of segments in one."""
    x = np.random.default_rng(5).standard_normal((N_DRIVES, 5000))
    if is_coloured:
        x = signal.lfilter([1.0], [1.0, -1.2, 0.6], x, axis=1)
    found = [mean_spectrum(row, np.ones(5000, bool), N_SEGMENT, RATE_HZ) for row in x]
    whole = [one for one in found if one is not None]
    return whole[0][0], np.array([spectrum for _, spectrum in whole]), (5000 - N_SEGMENT) // (N_SEGMENT // 2) + 1.0


@pytest.mark.parametrize("width_hz", [0.25, 1.0])
@pytest.mark.parametrize("is_coloured", [False, True])
def test_z_scores_of_noise_have_unit_variance(is_coloured: bool, width_hz: float) -> None:
    """J between two drives of the same load, over its stated scatter: 200 pairs and 8 bands far apart."""
    freq_hz, spectra, n_segments = spectra_of_noise(is_coloured)
    weights = rectangle_weights(freq_hz, CENTRES_HZ, width_hz)
    covariance = bin_covariance(N_SEGMENT, len(freq_hz))
    integrals = spectra @ weights.T
    through = weights * spectra[:, None]
    variances = np.einsum("nbi,ij,nbj->nb", through, covariance, through, optimize=True) / n_segments
    z = (integrals[::2] - integrals[1::2]) / np.sqrt(variances[::2] + variances[1::2])
    assert np.mean(z**2) == pytest.approx(1.0, abs=0.12)  # three and a half standard errors of 1600 squares
