"""Analyses each vehicle in a fleet's data set: loads over time, refusals, drift, faulty sensors.

A data set's receipts go in, plain numbers with their numbers of batches come out; reports draw them.
"""

from gateway.archive.fleet.batches import DRIFTING, OF_SENSOR, OF_VEHICLE
from gateway.archive.fleet.drift import Drift
from gateway.archive.fleet.fleet import Failure, FleetSummary, FleetVehicle, fleet_of
from gateway.archive.fleet.sensors import Health, Share, Trouble
from gateway.archive.fleet.trend import DriftTrend
from gateway.archive.fleet.weeks import Weeks, monday_of

__all__ = [
    "DRIFTING",
    "OF_SENSOR",
    "OF_VEHICLE",
    "Drift",
    "DriftTrend",
    "Failure",
    "FleetSummary",
    "FleetVehicle",
    "Health",
    "Share",
    "Trouble",
    "Weeks",
    "fleet_of",
    "monday_of",
]
