"""The paper's estimator, kept for comparison: the ratio of two narrow bands of a sensor's spectrum, and a regression.

A batch and a RatioIndexCalibration go in; the indexes R_a and R_g, payload and front share come out (``estimator``).
``index`` has equations (6) to (8), ``regression`` the structures (9) to (11). docs/ratio-index.md describes its
calibration.
"""
