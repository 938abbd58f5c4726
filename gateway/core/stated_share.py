"""How sure the empty vehicle's front share is: an error of it is in every front share that is told.

    told(estimate, vehicle)     # the last step before a tare: what is measured against the empty share, made absolute

The fitter states that a share s of the empty sprung mass M rests on the front axle, give or take. Known loads are
placed by it, and the half-car that they calibrate takes an error of it up: refitted with another s it finds payloads
as before, within a few kilograms for a whole percentage point, and front shares D moved as statics has it,

    D (M + L) = s M + the part of L that rests on the front axle,    so    dD / ds = M / (M + L).

Calibration, its judgement, fusion and tare compare shares with one another, and all of these carry the one error: in
these it counts for nothing, nor in where the payload lies. It counts in axle loads.
"""

import math
from dataclasses import replace

from gateway.core.vehicle import Vehicle
from gateway.estimate import Estimate, Quantity


def told(estimate: Estimate, vehicle: Vehicle | None) -> Estimate:
    """``estimate`` with front shares as sure as the empty one that its fitter stated; correlations lessen with it."""
    if vehicle is None or not estimate.counted:
        return estimate
    measured, epoch = estimate.front_share, estimate.epoch
    front_share = _absolute(measured, estimate.payload, vehicle)
    kept = measured.std / front_share.std
    return replace(
        estimate,
        front_share=front_share,
        correlation=estimate.correlation * kept,
        front_share_cg_left_correlation=estimate.front_share_cg_left_correlation * kept,
        epoch=epoch and replace(epoch, front_share=_absolute(epoch.front_share, epoch.payload, vehicle)),
    )


def measured(payload: Quantity, front_share: Quantity, correlation: float, vehicle: Vehicle) -> tuple[float, float]:
    """Standard deviation (percentage points) and correlation of a share beside the empty one: :func:`told` undone."""
    std = math.sqrt(max(0.0, front_share.std**2 - _stated_std_pct(payload, vehicle) ** 2))
    return std, correlation * front_share.std / std if std else math.nan


def _absolute(front_share: Quantity, payload: Quantity, vehicle: Vehicle) -> Quantity:
    return front_share.widened(_stated_std_pct(payload, vehicle))


def _stated_std_pct(payload: Quantity, vehicle: Vehicle) -> float:
    return vehicle.empty_front_share_std_pct * vehicle.empty_mass_kg / (vehicle.empty_mass_kg + payload.number)
