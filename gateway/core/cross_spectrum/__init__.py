"""The default estimator: fits a half-car to the cross-spectra of both sensors, phase included.

A batch and its calibration (``calibration``) go in; payload, front share and diagnostics come out (``estimator``).
``measured`` computes the spectra, ``model`` predicts them from the half-car, ``likelihood`` compares both, ``located``
searches the most probable load, firmly or softly packed (``packing``), and ``lateral`` its lateral place, given a roll
rate. Calibration fits the same model, and ``displayed`` draws it. docs/method.md has the derivation.
"""

from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.estimator import by_cross_spectrum
from gateway.core.cross_spectrum.located import Located, locate

__all__ = ["CrossSpectrumCalibration", "Located", "by_cross_spectrum", "locate"]
