"""Calibrates the cross-spectral estimator: known-load drives in, a half-car with its covariance out.

The half-car's parameters are the most probable ones given all drives, under weak priors for any road vehicle, so one
empty drive is enough to begin with. Runs left out in turn show how far its intervals must be widened, and are kept for
the assessment (``CrossSpectrumFit.without``). Inspection uses the same fit to test whether axes and loads are as
stated.
"""
