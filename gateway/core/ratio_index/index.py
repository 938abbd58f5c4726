"""The ratio index of Bottelli, Tanelli, Boniolo and Savaresi: the paper's estimator, faithful.

Two narrow bands are cut from the spectrum of vertical acceleration, and two from that of pitch rate. The ratio of the
signal in the two bands varies with the load because the body's resonances do. A sensor beside the centre line also
measures roll; with a roll rate its acceleration is first moved to the centre line.
"""

from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from gateway.core.ratio_index.regression import RegressionModel
from gateway.core.spectrum import frequencies_hz, segment_starts, segment_transforms
from gateway.metadata import STRICT, described
from gateway.records import C128, F64, I64, Batch, Bool

UPPER_LIMIT_HZ = 10.0  # of the integrals (7) and (8), as in the paper
MIN_SEGMENTS = 6  # chosen: a mean of fewer segments scatters too much


class Band(NamedTuple):
    """A band-pass (6): centre and -3 dB width, both in Hz."""

    centre_hz: float
    width_hz: float


PAPER_BANDS = {  # Table 2
    "acceleration": (Band(2.4, 0.05), Band(3.25, 0.05)),
    "pitch_rate": (Band(1.7, 0.05), Band(2.85, 0.05)),
}


@dataclass(frozen=True, slots=True)
class RatioIndexCalibration:
    """The calibration of the ratio index for one vehicle.

    Each pair of bands is (numerator, denominator). A model is absent if its sensor or the other is; speeds are the
    batch means seen in calibration. The acceleration is moved to the centre line from roll_lever_m left of it; 0: taken
    as measured.
    """

    __pydantic_config__ = STRICT

    spectrum: Literal["amplitude"]  # what the ratio is taken of: said in the file, for there are others
    n_segment: int = field(metadata={"ge": 64, "le": 65_536})
    acceleration_bands: tuple[Band, Band] | None
    pitch_rate_bands: tuple[Band, Band] | None
    payload: RegressionModel | None
    front_share: RegressionModel | None
    speed_range_mps: tuple[float, float]
    speed_std_max_mps: float = field(metadata={"gt": 0.0})
    roll_lever_m: float = field(
        default=0.0,
        metadata=described(
            "the sensor's place left of the centre line, from where the roll rate moves the acceleration to that line; "
            "0: the acceleration is taken as measured"
        ),
    )


def band_pass_gain(freq_hz: F64, band: Band) -> F64:
    """|F(j 2 pi f)| of equation (6), F(s) = 2 pi w s / (s^2 + 2 pi w s + (2 pi f0)^2): 1 at f0.

    With frequencies in Hz the factors 2 pi cancel but for j: |w f / (f0^2 - f^2 + j w f)|; the two
    points where it is 1/sqrt(2) lie exactly w apart.
    """
    through = band.width_hz * freq_hz
    gain: F64 = through / np.hypot(band.centre_hz**2 - freq_hz**2, through)
    return gain


def mean_spectrum(x: F64, usable: Bool, n_segment: int, rate_hz: float) -> tuple[F64, F64] | None:
    """Frequencies (m,) up to 10 Hz and the mean amplitude (m,) in u/sqrt(Hz) of half-overlapping Hann segments.

    None where fewer than MIN_SEGMENTS segments fit between the gaps.
    """
    starts = segment_starts(usable & np.isfinite(x), n_segment, n_segment // 2)
    if len(starts) < MIN_SEGMENTS:
        return None
    return _mean(segment_transforms(x, starts, n_segment, rate_hz), n_segment, rate_hz)


def _mean(transforms: C128, n_segment: int, rate_hz: float) -> tuple[F64, F64]:
    freq_hz = frequencies_hz(n_segment, rate_hz)
    wanted = (freq_hz > 0.0) & (freq_hz <= UPPER_LIMIT_HZ)
    return freq_hz[wanted], np.mean(np.abs(transforms[:, wanted]), axis=0)


def acceleration_spectrum(batch: Batch, n_segment: int, roll_lever_m: float) -> tuple[F64, F64] | None:
    """The vertical acceleration's mean spectrum, moved to the centre line where the roll rate allows it.

    A point y metres left of the centre line of a rigid body moves up by heave + y roll (ISO 8855), so that on the line
    a = a_y - y d(roll rate)/dt, and a derivative is a factor j 2 pi f. We neglect the taper's own slope: about 1 / (2 T
    f) of the roll acceleration for segments of T seconds, 0.015 at 1.7 Hz. The spectrum is as measured if there is no
    lever, or if too few segments have a roll rate (:func:`is_moved`).
    """
    x, usable = batch.vertical_acceleration_mps2, batch.usable
    if not is_moved(batch, n_segment, roll_lever_m) or batch.roll_rate_radps is None:
        return mean_spectrum(x, usable, n_segment, batch.rate_hz)
    starts = acceleration_segments(batch, n_segment, roll_lever_m)
    sideways = segment_transforms(batch.roll_rate_radps, starts, n_segment, batch.rate_hz)
    sideways *= 2j * np.pi * roll_lever_m * frequencies_hz(n_segment, batch.rate_hz)
    return _mean(segment_transforms(x, starts, n_segment, batch.rate_hz) - sideways, n_segment, batch.rate_hz)


def is_moved(batch: Batch, n_segment: int, roll_lever_m: float) -> bool:
    """Whether the lever arm is known and enough segments have a roll rate."""
    return roll_lever_m != 0.0 and len(_rolling(batch, n_segment)) >= MIN_SEGMENTS


def acceleration_segments(batch: Batch, n_segment: int, roll_lever_m: float) -> I64:
    """First samples (k,) of the segments that :func:`acceleration_spectrum` averages."""
    if is_moved(batch, n_segment, roll_lever_m):
        return _rolling(batch, n_segment)
    return segment_starts(batch.usable & np.isfinite(batch.vertical_acceleration_mps2), n_segment, n_segment // 2)


def _rolling(batch: Batch, n_segment: int) -> I64:
    """First samples (k,) of the segments in which acceleration and roll rate are known."""
    if batch.roll_rate_radps is None:
        return np.empty(0, np.int64)
    known = np.isfinite(batch.vertical_acceleration_mps2) & np.isfinite(batch.roll_rate_radps)
    return segment_starts(batch.usable & known, n_segment, n_segment // 2)


def ratio_index(freq_hz: F64, spectrum: F64, bands: tuple[Band, Band]) -> float:
    """R, equations (7) and (8): integrals to 10 Hz of the two band-passed spectra, one over the other."""
    passed = [float(np.sum(band_pass_gain(freq_hz, band) * spectrum)) for band in bands]
    return passed[0] / passed[1]


def indexes_of(batch: Batch, calibration: RatioIndexCalibration) -> tuple[float, float]:
    """R_a and R_g of a batch; NaN where the sensor is not calibrated or too few segments fit."""
    n_segment = calibration.n_segment
    ra = rg = None
    if calibration.acceleration_bands is not None:
        ra = acceleration_spectrum(batch, n_segment, calibration.roll_lever_m)
    if calibration.pitch_rate_bands is not None:
        rg = mean_spectrum(batch.pitch_rate_radps, batch.usable, n_segment, batch.rate_hz)
    return _index(ra, calibration.acceleration_bands), _index(rg, calibration.pitch_rate_bands)


def _index(seen: tuple[F64, F64] | None, bands: tuple[Band, Band] | None) -> float:
    return float("nan") if seen is None or bands is None else ratio_index(*seen, bands)
