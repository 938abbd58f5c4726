"""Which known loads to drive next, and how much they would help: advice for whoever calibrates a vehicle.

What comes in is a vehicle alone (``plan_first``), or the outcome of a calibration with its half-car
(``plan_next``); what goes out is a LoadPlan: loads with their places, in the order of what they would teach,
and the standard deviations and reach expected once each is driven. The runs are chosen by optimal design on
the half-car's covariance (``Design``) among the loads that the vehicle may carry.
"""

from gateway.calibration.plan.design import Design, Spread
from gateway.calibration.plan.loads import PlacedLoad, drivable_loads, weighed_loads
from gateway.calibration.plan.plan import Advice, Expected, LoadPlan, SidewaysLoad, plan_first, plan_next, usual_drive
from gateway.calibration.plan.saying import StatedWidths, stated_widths

__all__ = [
    "Advice",
    "Design",
    "Expected",
    "LoadPlan",
    "PlacedLoad",
    "SidewaysLoad",
    "Spread",
    "StatedWidths",
    "drivable_loads",
    "plan_first",
    "plan_next",
    "stated_widths",
    "usual_drive",
    "weighed_loads",
]
