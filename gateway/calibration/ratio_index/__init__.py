"""Calibrates the ratio index, the paper's estimator: known-load drives in, bands and static regressions out.

The method is whole, for comparison with the cross-spectral estimator: bands chosen on the campaign or those of
Table 2, the structures (9), (10) and (11), and one linear in both logarithms. What comes in are inspected known
runs with their batches; what goes out is a RatioIndexCalibration for the core, with what the other runs
teach without each run and its errors (``fit_ratio_index``); for the reports, the two indexes of known runs
(``index_rows``).
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
