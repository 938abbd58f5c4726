"""The front axle's share of a roll moment, as an estimate states it."""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.likelihood import Point
from gateway.core.cross_spectrum.model.parameters import INDEX, rolling_car
from gateway.core.cross_spectrum.model.rolling_car import SidewaysLoad, roll_share_front
from gateway.estimate import Estimate, Quantity
from gateway.records import F64

_STIFFNESSES: Final = tuple(
    INDEX[f"{kind}_{end}_npm"] for kind in ("spring", "anti_roll", "tyre") for end in ("front", "rear")
)
_STEP: Final = 1e-3  # chosen: of a logarithm, for a difference quotient


def with_place(answer: Estimate, point: Point, calibration: CrossSpectrumCalibration) -> Estimate:
    """``answer`` with the axles' shares of a roll moment at the load of ``point``."""
    stiffness = _roll_share_front(point, calibration)
    return replace(answer, roll_share_front=stiffness.number, roll_share_front_std=stiffness.std)


def _roll_share_front(point: Point, calibration: CrossSpectrumCalibration) -> Quantity:
    """The part of a roll moment that the front axle takes, from springs, bars and tyres as calibrated."""
    load = SidewaysLoad(point.payload_kg, point.front_share, point.cg_left_m)

    def share(theta: F64) -> float:
        return float(np.squeeze(roll_share_front(rolling_car(theta, calibration.ground), load)))

    entries = list(_STIFFNESSES)
    here = share(point.theta)
    moved = point.theta + _STEP * np.eye(len(point.theta))[entries]
    slopes = np.array([share(one) - here for one in moved]) / _STEP
    return Quantity(here, math.sqrt(float(slopes @ calibration.covariance[np.ix_(entries, entries)] @ slopes)))
