"""Calibration of the ratio index, the paper's estimator: from known-load drives to bands and static regressions.

The method is complete, for comparison with the cross-spectral estimator: bands chosen on the campaign or those of Table
2, the structures (9), (10) and (11), and one linear in both logarithms. In go inspected known runs with their batches;
out come a RatioIndexCalibration for the core, the calibrations without each run and their errors (``fit_ratio_index``),
and for the reports the two indexes of known runs (``index_rows``).
"""

from gateway.calibration.ratio_index.bands import BandChoice
from gateway.calibration.ratio_index.choice import Choice, StructureChoice
from gateway.calibration.ratio_index.fit import FamilyTrial, RatioIndexFit, fit_ratio_index
from gateway.calibration.ratio_index.regression import FittedRegression, fit_regression
from gateway.calibration.ratio_index.table import N_SEGMENT, IndexRows, index_rows

__all__ = [
    "N_SEGMENT",
    "BandChoice",
    "Choice",
    "FamilyTrial",
    "FittedRegression",
    "IndexRows",
    "RatioIndexFit",
    "StructureChoice",
    "fit_ratio_index",
    "fit_regression",
    "index_rows",
]
