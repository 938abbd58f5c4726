"""The step of a commissioning, derived from the record, and its whole state for the web."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any

from gateway.calibration.commissioning.job import Learned
from gateway.service.commissioning.empty_drive import EmptyDrive, ServiceVehicle
from gateway.service.commissioning.lines import LineFound
from gateway.service.commissioning.record import CommissioningRecord, MadeCalibration, Underway
from gateway.stated.doubt import OF_THE_DRIVE, Doubt


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


def state_json(
    record: CommissioningRecord,
    vehicle: ServiceVehicle,
    drive: EmptyDrive,
    window: OpenWindow | None,
    *,
    is_pending: bool,
) -> dict[str, Any]:
    """A CommissioningState of the web. There is no window between drives, nor before the vehicle is called empty."""
    underway, active = record.underway, record.active
    return {
        "is_allowed": vehicle.why_not_allowed is None,
        "why_not": vehicle.why_not_allowed,
        "is_offered": vehicle.why_not_allowed is None and underway is None and active is None
        and not vehicle.is_calibrated,
        "underway": None if underway is None else _underway(underway, drive, window),
        "is_pending": is_pending,
        "active": None if active is None else _made(active),
        "history": [_made(one) for one in reversed(record.made)],
    }  # fmt: skip


def lines_json(found: Sequence[LineFound]) -> dict[str, Any]:
    """The LinesFound of the web."""
    return {"items": [asdict(one) for one in found]}


def _underway(underway: Underway, drive: EmptyDrive, window: OpenWindow | None) -> dict[str, Any]:
    looked = drive.looked
    return {
        "step": step_of(underway),
        "begun_at": underway.begun_at,
        "by": underway.by,
        "note": underway.note,
        "line": None
        if underway.line is None
        else underway.line.model_dump(include={"name", "id", "source"}) | {"vehicle": dict(underway.line.figures)},
        "vehicle": None if underway.vehicle is None else asdict(underway.vehicle),
        "empty": None if underway.empty is None else underway.empty.model_dump(include={"at", "by"}),
        "inspection": None
        if looked is None
        else {
            "seconds": looked.seconds,
            "has_fault": looked.has_fault,
            "findings": [found.model_dump() for found in looked.findings],
        },
        "n_batches": len(underway.batches),
        "driven_s": drive.driven_s + (window.counted_s if window else 0.0),
        "next_window_s": window.next_s if window else None,
        "doubts": [_doubt(one) for one in underway.open_doubts],
        "confirmed": [_doubt(one) for one in underway.doubts if one not in underway.open_doubts],
        "learned": _learned(underway.learned),
        "is_fitting": drive.is_busy,
        "fault": underway.fault,
    }


def _doubt(doubt: Doubt) -> dict[str, Any]:
    said = {"is_of_drive": doubt.kind in OF_THE_DRIVE, "text": doubt.text, "advice": doubt.advice}
    return doubt.model_dump(mode="json") | said


def _learned(learned: Learned | None) -> dict[str, Any] | None:
    return None if learned is None else {**learned.model_dump(), "share": learned.share, "is_enough": learned.is_enough}


def _made(made: MadeCalibration) -> dict[str, Any]:
    return {
        "id": made.id,
        "at": made.at,
        "by": made.by,
        "note": made.note,
        "line": made.line.model_dump(include={"name", "id", "source"}),
        "vehicle_name": made.vehicle.name,
        "n_batches": len(made.batches),
        "learned": _learned(made.learned),
        "warnings": list(made.warnings),
        "ended": None if made.ended is None else made.ended.model_dump(),
    }
