"""Advice on the known loads to drive next, and their expected benefit.

In goes a vehicle alone (``plan_first``), or the outcome of a calibration with its half-car (``plan_next``); out comes a
LoadPlan: loads with places, ordered by their benefit, and the standard deviations and reach expected after each. The
runs are chosen by optimal design on the half-car's covariance (``Design``) among the loads that the vehicle may carry.
"""
