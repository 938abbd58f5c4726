"""The step of a commissioning, derived from the record, and its whole state for the web."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from gateway.service.commissioning.empty_drive import EmptyDrive, ServiceVehicle
from gateway.service.commissioning.record import CommissioningRecord, Underway
from gateway.stated.commissioning import CommissioningState


class CommissioningStep(StrEnum):
    """The next step of a commissioning."""

    LINE = "line"
    VEHICLE = "vehicle"
    EMPTY = "empty"
    DRIVE = "drive"
    FIT = "fit"


def step_of(underway: Underway) -> CommissioningStep:
    """The first step that is not answered yet."""
    if underway.line is None:
        return CommissioningStep.LINE
    if underway.vehicle is None or underway.is_vehicle_doubted:
        return CommissioningStep.VEHICLE
    if underway.empty is None:
        return CommissioningStep.EMPTY
    return CommissioningStep.FIT if underway.is_fit_asked else CommissioningStep.DRIVE


@dataclass(frozen=True, slots=True)
class OpenWindow:
    """The open window: how much of it counts so far, and how long until the next one that counts."""

    counted_s: float
    next_s: float


def state_of(
    record: CommissioningRecord,
    vehicle: ServiceVehicle,
    drive: EmptyDrive,
    window: OpenWindow | None,
    *,
    is_pending: bool,
) -> CommissioningState:
    """The state for the web. There is no window between drives, nor before the vehicle is called empty."""
    is_allowed = vehicle.why_not_allowed is None
    has_any = record.underway is not None or record.active is not None or vehicle.is_calibrated
    return CommissioningState.model_validate(
        {
            "is_allowed": is_allowed,
            "why_not": vehicle.why_not_allowed,
            "is_offered": is_allowed and not has_any,
            "underway": None if record.underway is None else _underway(record.underway, drive, window),
            "is_pending": is_pending,
            "active": record.active,
            "history": record.made[::-1],
        }
    )


def _underway(underway: Underway, drive: EmptyDrive, window: OpenWindow | None) -> dict[str, Any]:
    return {
        **dict(underway),
        "step": step_of(underway),
        "inspection": drive.looked,
        "n_batches": len(underway.batches),
        "driven_s": drive.driven_s + (window.counted_s if window else 0.0),
        "next_window_s": window.next_s if window else None,
        "doubts": underway.open_doubts,
        "confirmed": [one for one in underway.doubts if one not in underway.open_doubts],
        "is_fitting": drive.is_busy,
    }
