"""verifications.json: known loads weighed for verification, with their errors and a verdict."""

from typing import Final, Literal

from gateway.calibration.known_weight import StatedLoad
from gateway.calibration.known_weights_file import content_id
from gateway.core.vehicle import Vehicle
from gateway.stated.facts import AxleErrorTold, LoadTold, Part, Rule, VerificationRecord

FILE_NAME: Final = "verifications.json"
MOST_ENTRIES: Final = 500  # chosen: beyond it the oldest are dropped

Verdict = Literal["passed", "failed"]


class VerificationHistory(Part):
    """All stored records, oldest first. Records are never changed."""

    format: Literal["springscale-verifications"] = "springscale-verifications"
    version: Literal[1] = 1
    entries: tuple[VerificationRecord, ...] = ()

    def with_entry(self, entry: VerificationRecord) -> "VerificationHistory":
        """The history with one more record."""
        return self.model_copy(update={"entries": (*self.entries, entry)[-MOST_ENTRIES:]})


def axle_errors(
    known: StatedLoad, payload_kg: float, front_share_pct: float, vehicle: Vehicle
) -> tuple[AxleErrorTold | None, AxleErrorTold | None]:
    """Errors of the front and the rear axle; None if the known load has no place. Unsprung masses cancel in an
    error.
    """
    if known.front_share_pct is None:
        return None, None
    known_sprung_kg, sprung_kg = vehicle.empty_mass_kg + known.payload_kg, vehicle.empty_mass_kg + payload_kg
    known_front_kg = known.front_share_pct / 100.0 * known_sprung_kg
    front_kg = front_share_pct / 100.0 * sprung_kg
    front, rear = front_kg - known_front_kg, (sprung_kg - front_kg) - (known_sprung_kg - known_front_kg)
    on_front = known_front_kg if known.front_axle_kg is None else known.front_axle_kg
    on_rear = known_sprung_kg - known_front_kg if known.rear_axle_kg is None else known.rear_axle_kg
    return _axle_error(on_front, front), _axle_error(on_rear, rear)


def _axle_error(known_kg: float, error_kg: float) -> AxleErrorTold:
    return AxleErrorTold(known_kg=known_kg, error_kg=error_kg, error_pct=100.0 * error_kg / known_kg)


def is_within(rule: Rule, error_pct: float, *axles: AxleErrorTold | None) -> bool:
    """Whether the gross weight's error, and each axle's if axles are judged, is within the permitted error."""
    most_axle_pct = rule.permitted_axle_error_pct
    return abs(error_pct) <= rule.permitted_error_pct and all(
        axle is None or most_axle_pct is None or abs(axle.error_pct) <= most_axle_pct for axle in axles
    )


def verdict_of(rule: Rule, loads: tuple[LoadTold, ...]) -> Verdict:
    """Passed if every load is within its limits and there are as many as the rule requires."""
    return "passed" if len(loads) >= rule.loads and all(load.is_within for load in loads) else "failed"


def with_its_id(record: VerificationRecord) -> VerificationRecord:
    """The record with the hash of everything else as its id."""
    return record.model_copy(update={"id": content_id(record.model_dump(mode="json", exclude={"id"}))})
