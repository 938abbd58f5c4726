"""The expected estimate of a load before it is driven: the posterior of an ideal drive with it."""

from gateway.core.cargo import ShapePrior
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.estimator import posterior_of
from gateway.core.cross_spectrum.ideal_drive import Drive, expected_of, steady_spectra
from gateway.core.cross_spectrum.likelihood import Point
from gateway.core.cross_spectrum.located import locate
from gateway.core.cross_spectrum.model.parameters import INDEX, has_roll
from gateway.core.cross_spectrum.sensor_change import GAIN_STD
from gateway.core.cross_spectrum.shape import EVIDENCE
from gateway.core.vehicle import Load
from gateway.posterior import Posterior, Source


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
