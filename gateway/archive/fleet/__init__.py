"""What a data set tells of each vehicle of a fleet: loads over time, refusals, drift, sensors that went bad.

A data set's receipts come in, plain numbers go out, each with how many batches it rests on; reports draw them.
"""

from gateway.archive.fleet.batches import DRIFTING, OF_SENSOR, OF_VEHICLE
from gateway.archive.fleet.drift import Drift
from gateway.archive.fleet.fleet import Failure, Fleet, Vehicle, fleet_of
from gateway.archive.fleet.sensors import Health, Share, Trouble
from gateway.archive.fleet.trend import Trend
from gateway.archive.fleet.weeks import Weeks, monday_of

__all__ = [
    "DRIFTING",
    "OF_SENSOR",
    "OF_VEHICLE",
    "Drift",
    "Failure",
    "Fleet",
    "Health",
    "Share",
    "Trend",
    "Trouble",
    "Vehicle",
    "Weeks",
    "fleet_of",
    "monday_of",
]
