"""What the service will state of a load before it is driven: the posterior of an ideal drive with it."""

from gateway.core.cargo import ShapePrior
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.estimator import posterior_of
from gateway.core.cross_spectrum.ideal_drive import Drive, expected_of, steady_spectra
from gateway.core.cross_spectrum.likelihood import Point
from gateway.core.cross_spectrum.located import locate
from gateway.core.cross_spectrum.model.parameters import has_roll, upright
from gateway.core.cross_spectrum.sensor_change import GAIN_STD
from gateway.core.vehicle import Load
from gateway.posterior import Posterior, Source


def predicted(calibration: CrossSpectrumCalibration, prior: ShapePrior | None, load: Load, drive: Drive) -> Posterior:
    """Payload and front share as one batch would state them, if the road showed just what the model expects.

    The load has the shape of the known ones; ``prior`` is what the service believes of shapes.
    """
    point = Point.of(upright(calibration.parameters), load)
    spectra = expected_of(steady_spectra(calibration.reading, drive), point, calibration.ground)
    posterior = posterior_of(locate(spectra, calibration, prior), calibration, 1.0, 0.0, (0.0, GAIN_STD))
    return posterior.without(Source.SIDEWAYS) if has_roll(calibration.parameters) else posterior
