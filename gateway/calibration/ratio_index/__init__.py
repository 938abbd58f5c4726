"""Calibration of the ratio index, the paper's estimator: from known-load drives to bands and static regressions.

The method is complete, for comparison with the cross-spectral estimator: bands chosen on the campaign or those of Table
2, the structures (9), (10) and (11), and one linear in both logarithms. In go inspected known runs with their batches;
out come a RatioIndexCalibration for the core, the calibrations without each run and their errors (``fit_ratio_index``),
and for the reproduction the two indexes of known runs (``index_rows``).
"""
