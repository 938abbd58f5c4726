"""The expected estimate of a load before it is driven: the posterior of an ideal drive, one that shows exactly the
model's spectra.
"""

from dataclasses import dataclass

import numpy as np

from gateway.core.cargo import ShapePrior
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.estimator import posterior_of
from gateway.core.cross_spectrum.likelihood import Point
from gateway.core.cross_spectrum.located import locate
from gateway.core.cross_spectrum.measured import CrossSpectra
from gateway.core.cross_spectrum.model.driven import spectral_model
from gateway.core.cross_spectrum.model.expected import expected_spectra
from gateway.core.cross_spectrum.model.parameters import INDEX, Ground, has_roll
from gateway.core.cross_spectrum.model.reading import Reading
from gateway.core.cross_spectrum.sensor_change import GAIN_STD
from gateway.core.cross_spectrum.shape import EVIDENCE
from gateway.core.spectrum import frequencies_hz
from gateway.core.vehicle import Load
from gateway.posterior import Posterior, Source
from gateway.records import F64

RATE_HZ = 50.0  # of the grid, BatchSettings.rate_hz


@dataclass(frozen=True, slots=True)
class Drive:
    """Steady driving: its duration and speed."""

    duration_s: float
    speed_mps: float


def expected_of(spectra: CrossSpectra, point: Point, ground: Ground) -> CrossSpectra:
    """``spectra`` with the model's values at ``point``: the average of such a drive."""
    model = spectral_model(point.theta, point.loaded, ground, spectra.freq_hz, spectra.n_sensors)
    return spectra.showing(expected_spectra(model, spectra))


def steady_spectra(reading: Reading, drive: Drive) -> CrossSpectra:
    """The frame of spectra for a steady drive: as many half-overlapping segments as it holds, at one speed."""
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


def predicted(
    calibration: CrossSpectrumCalibration,
    prior: ShapePrior | None,
    load: Load,
    drive: Drive,
    log_s: float | None = None,
) -> Posterior:
    """Payload and front share as one batch would state them on a road that shows exactly the model's spectra.

    ``prior`` is the service's prior of shapes, ``log_s`` the logarithm of the load's squared radius of gyration (m2);
    None: that of the known loads.
    """
    is_rolling = has_roll(calibration.parameters)
    upright = calibration.upright  # on the centre line: with a roll rate the signals are moved there
    theta = upright.parameters.copy()
    if log_s is not None:
        theta[INDEX["payload_gyration_m2"]] = log_s
    point = Point.of(theta, load)
    spectra = expected_of(steady_spectra(calibration.reading, drive), point, calibration.ground)
    located = locate(spectra, upright, prior, EVIDENCE if is_rolling else None)
    posterior = posterior_of(located, upright, 1.0, 0.0, (0.0, GAIN_STD))
    return posterior.without(Source.SIDEWAYS) if is_rolling else posterior
