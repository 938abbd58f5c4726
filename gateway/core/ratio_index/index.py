"""The ratio index of Bottelli, Tanelli, Boniolo and Savaresi: the paper's estimator, faithful.

Two narrow bands are cut from the spectrum of vertical acceleration (and two from that of pitch
rate); the ratio of what passes through them moves with the load because the body's resonances do.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from gateway.core.ratio_index.regression import RegressionModel
from gateway.core.spectrum import frequencies_hz, segment_starts, segment_transforms
from gateway.records import F64, Batch, Bool

UPPER_LIMIT_HZ = 10.0  # of the integrals (7) and (8)
MIN_SEGMENTS = 6

SpectrumKind = Literal["amplitude", "power"]


@dataclass(frozen=True, slots=True)
class Band:
    """A band-pass (6): centre and -3 dB width, both in Hz."""

    centre_hz: float
    width_hz: float


PAPER_BANDS = {  # Table 2
    "acceleration": (Band(2.4, 0.05), Band(3.25, 0.05)),
    "pitch_rate": (Band(1.7, 0.05), Band(2.85, 0.05)),
}


@dataclass(frozen=True, slots=True)
class RatioIndexCalibration:
    """What the ratio index needs to know of a vehicle; bands belong to it and come from its calibration.

    Each pair of bands is (numerator, denominator). A model is absent where its sensor or the other
    is; speeds are the batch means seen in calibration.
    """

    spectrum: SpectrumKind
    n_segment: int
    acceleration_bands: tuple[Band, Band] | None
    pitch_rate_bands: tuple[Band, Band] | None
    payload: RegressionModel | None
    front_share: RegressionModel | None
    speed_range_mps: tuple[float, float]
    speed_std_max_mps: float


def band_pass_gain(freq_hz: F64, band: Band) -> F64:
    """|F(j 2 pi f)| of equation (6), F(s) = 2 pi w s / (s^2 + 2 pi w s + (2 pi f0)^2): 1 at f0.

    With frequencies in Hz the factors 2 pi cancel but for j: |w f / (f0^2 - f^2 + j w f)|; the two
    points where it is 1/sqrt(2) lie exactly w apart.
    """
    through = band.width_hz * freq_hz
    gain: F64 = through / np.hypot(band.centre_hz**2 - freq_hz**2, through)
    return gain


def mean_spectrum(x: F64, usable: Bool, n_segment: int, rate_hz: float, kind: SpectrumKind) -> tuple[F64, F64] | None:
    """Frequencies (m,) up to 10 Hz and the spectrum (m,) averaged over half-overlapping Hann segments.

    Amplitude: mean of |X| in u/sqrt(Hz); power: mean of |X|^2 in u^2/Hz. None where fewer than
    MIN_SEGMENTS segments fit between the gaps.
    """
    starts = segment_starts(usable & np.isfinite(x), n_segment, n_segment // 2)
    if len(starts) < MIN_SEGMENTS:
        return None
    freq_hz = frequencies_hz(n_segment, rate_hz)
    wanted = (freq_hz > 0.0) & (freq_hz <= UPPER_LIMIT_HZ)
    magnitude = np.abs(segment_transforms(x, starts, n_segment, rate_hz)[:, wanted])
    spectrum = np.mean(magnitude if kind == "amplitude" else magnitude**2, axis=0)
    return freq_hz[wanted], spectrum


def ratio_index(freq_hz: F64, spectrum: F64, bands: tuple[Band, Band], kind: SpectrumKind) -> float:
    """R, equations (7) and (8): integrals to 10 Hz of the two band-passed spectra, one over the other."""
    order = 1 if kind == "amplitude" else 2
    passed = [float(np.sum(band_pass_gain(freq_hz, band) ** order * spectrum)) for band in bands]
    return passed[0] / passed[1]


def indexes_of(batch: Batch, calibration: RatioIndexCalibration) -> tuple[float, float]:
    """R_a and R_g of a batch; NaN where the sensor is not calibrated or too few segments fit."""
    pairs = (
        (batch.vertical_acceleration_mps2, calibration.acceleration_bands),
        (batch.pitch_rate_radps, calibration.pitch_rate_bands),
    )
    found = [_index(x, bands, batch, calibration) for x, bands in pairs]
    return found[0], found[1]


def _index(x: F64, bands: tuple[Band, Band] | None, batch: Batch, calibration: RatioIndexCalibration) -> float:
    if bands is None:
        return float("nan")
    seen = mean_spectrum(x, batch.usable, calibration.n_segment, batch.rate_hz, calibration.spectrum)
    return float("nan") if seen is None else ratio_index(*seen, bands, calibration.spectrum)
