"""Calibrates the cross-spectral estimator: known-load drives in, a half-car with its covariance out.

The half-car's parameters are the most probable ones given all drives, under weak priors for any road vehicle, so one
empty drive is enough to begin with. Runs left out in turn show how far its intervals must be widened, and are kept for
the assessment (``CrossSpectrumFit.without``). Inspection uses the same fit to test whether axes and loads are as
stated.
"""

from gateway.calibration.half_car.fit import (
    CrossSpectrumFit,
    calibrate_cross_spectrum,
    fit_cross_spectrum,
    half_car_calibration,
)
from gateway.calibration.half_car.known_spectra import KnownSpectra, known_spectra
from gateway.calibration.half_car.most_probable_vehicle import fit_half_car
from gateway.calibration.half_car.prior import Inherited, Prior, prior_of

__all__ = [
    "CrossSpectrumFit",
    "Inherited",
    "KnownSpectra",
    "Prior",
    "calibrate_cross_spectrum",
    "fit_cross_spectrum",
    "fit_half_car",
    "half_car_calibration",
    "known_spectra",
    "prior_of",
]
