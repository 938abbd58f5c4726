"""The default estimator: both sensors' spectra together, phase included, held against a half-car.

A batch and what known-load drives taught (``calibration``) come in; payload, front share and diagnostics go out
(``estimator``). ``measured`` takes the spectra, ``model`` says what the half-car would show, ``likelihood`` compares
them, ``located`` finds the most probable load, firm or soft (``packing``), and ``lateral``, with a roll rate, where it
lies sideways. Calibration fits the same model, and ``displayed`` draws it. docs/method.md derives it.
"""

from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.estimator import by_cross_spectrum
from gateway.core.cross_spectrum.located import Located, locate

__all__ = ["CrossSpectrumCalibration", "Located", "by_cross_spectrum", "locate"]
