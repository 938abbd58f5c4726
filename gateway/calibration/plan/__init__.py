"""Advice on the known loads to drive next, and their expected benefit.

In goes a vehicle alone (``plan_first``), or the outcome of a calibration with its half-car (``plan_next``); out comes a
LoadPlan: loads with places, ordered by their benefit, and the standard deviations and reach expected after each. The
runs are chosen by optimal design on the half-car's covariance (``Design``) among the loads that the vehicle may carry.
"""

from gateway.calibration.plan.design import Design, Spread
from gateway.calibration.plan.loads import PlacedLoad, drivable_loads, weighed_loads
from gateway.calibration.plan.plan import Advice, Expected, LoadPlan, OffCentreLoad, plan_first, plan_next, usual_drive
from gateway.calibration.plan.saying import StatedWidths, stated_widths

__all__ = [
    "Advice",
    "Design",
    "Expected",
    "LoadPlan",
    "OffCentreLoad",
    "PlacedLoad",
    "Spread",
    "StatedWidths",
    "drivable_loads",
    "plan_first",
    "plan_next",
    "stated_widths",
    "usual_drive",
    "weighed_loads",
]
