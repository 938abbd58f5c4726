"""How well anyone could weigh: Cramer-Rao bounds of payload and front share for a given vehicle and drive.

The expected information of the likelihood, with the road's level unknown at every frequency, is
inverted for (payload, share) and whatever else is not known. No estimator without bias has a smaller
standard deviation; a real vehicle is not the half-car, so that errors stay above it.

(C. R. Rao 1945; H. Cramer 1946; for spectra P. Whittle 1953.)
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from gateway.core.cross_spectrum.estimator import CrossSpectrumCalibration
from gateway.core.cross_spectrum.expected import expected_spectra, spectral_model
from gateway.core.cross_spectrum.likelihood import Point, Whittle
from gateway.core.cross_spectrum.measured import CrossSpectra, Reading
from gateway.core.cross_spectrum.parameters import INDEX, Ground
from gateway.core.spectrum import frequencies_hz
from gateway.records import F64

RATE_HZ = 50.0


@dataclass(frozen=True, slots=True)
class Drive:
    """Steady driving: how long and how fast."""

    duration_s: float
    speed_mps: float


@dataclass(frozen=True, slots=True)
class Bound:
    """Smallest standard deviations that are possible."""

    payload_std_kg: float
    front_share_std_pct: float


def cramer_rao(
    calibration: CrossSpectrumCalibration,
    payload_kg: float,
    front_share_pct: float,
    drive: Drive,
    unknown: Mapping[str, float] | None = None,
) -> Bound:
    """The bound at one load, the vehicle being the calibrated one.

    ``unknown`` maps parameter names (parameters.PARAMETERS) to the standard deviation of what is
    known of them beforehand (of the logarithm, where these are positive quantities); the others are
    taken as known. Slack counts as part of the vehicle: it is what model error and roll leave.
    """
    priors = dict(unknown or {})
    free = [INDEX[name] for name in priors]
    point = Point(calibration.parameters, payload_kg, front_share_pct / 100.0)
    spectra = expected_of(steady_spectra(calibration.reading, drive), point, calibration.ground)
    whittle = Whittle(spectra, calibration.ground)
    information = whittle.curvature(point, free, is_load_free=True).information
    information += np.diag(np.r_[np.array(list(priors.values())) ** -2.0, 0.0, 0.0])
    payload_var, share_var = np.diag(np.linalg.inv(information))[-2:]
    return Bound(float(np.sqrt(payload_var)), 100.0 * float(np.sqrt(share_var)))


def expected_of(spectra: CrossSpectra, point: Point, ground: Ground) -> CrossSpectra:
    """The spectra such a drive would show on average: ``spectra`` with what the model says at ``point``."""
    model = spectral_model(
        point.theta, np.array(point.payload_kg), np.array(point.front_share), ground, spectra.freq_hz
    )
    acceleration, pitch_rate, cross = expected_spectra(model, spectra)
    return replace(spectra, acceleration=acceleration, pitch_rate=pitch_rate, cross=cross)


def steady_spectra(reading: Reading, drive: Drive) -> CrossSpectra:
    """As many half-overlapping segments as the drive holds, all at one speed; spectra still to be filled in."""
    n_segment, (low_hz, high_hz) = reading.n_segment, reading.band_hz
    every_hz = frequencies_hz(n_segment, RATE_HZ)
    step_hz = every_hz[1]
    freq_hz = every_hz[(every_hz >= low_hz - step_hz) & (every_hz <= high_hz + step_hz)]
    n = max(1.0, np.floor(2.0 * drive.duration_s * RATE_HZ / n_segment) - 1.0)
    delay_s = reading.wheelbase_m / drive.speed_mps
    ones: F64 = np.ones((1, len(freq_hz) - 2))
    return CrossSpectra(
        freq_hz=freq_hz,
        acceleration=ones,
        pitch_rate=ones,
        cross=np.zeros_like(ones, np.complex128),
        delay_phase=np.exp(-2j * np.pi * freq_hz * delay_s)[None],
        delay_s=np.array([[delay_s]]),
        n_segments=np.array([[n]]),
        inverse_power=np.zeros((1, 1)),
        log_amplitude=np.zeros((1, 1)),
        acceleration_rms_mps2=1.0,
        pitch_rate_rms_radps=1.0,
        reading=reading,
    )
