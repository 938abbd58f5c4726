"""verifications.json: known loads weighed for verification, with their errors and a verdict."""

from typing import Final, Literal

from pydantic import Field

from gateway.calibration.file.calibration_file import content_id
from gateway.calibration.file.parts import Part
from gateway.calibration.known_weight import StatedLoad
from gateway.core.vehicle import Vehicle
from gateway.stated.facts import AxleErrorTold, LoadTold, Rule, VerificationRecord

FILE_NAME: Final = "verifications.json"
MOST_ENTRIES: Final = 500  # chosen: beyond it the oldest are dropped
MOST_LOADS: Final = 10  # chosen: of one verification

Verdict = Literal["passed", "failed"]


class VerificationRule(Part, Rule):
    """The requirements of a verification, as its record keeps them."""


class AxleError(Part, AxleErrorTold):
    """The error of an axle load: weighed minus known, in kg and in percent of the known load."""


class VerifiedLoad(Part, LoadTold):
    """One known load, as its record keeps it."""

    front_axle: AxleError | None
    rear_axle: AxleError | None


class Verification(Part, VerificationRecord):
    """A dated record of some known loads; ``id`` is the hash of everything else."""

    rule: VerificationRule
    loads: tuple[VerifiedLoad, ...] = Field(min_length=1, max_length=MOST_LOADS)

    def content_id(self) -> str:
        """The id that the content should have."""
        return content_id(self.model_dump(mode="json", exclude={"id"}))


class VerificationHistory(Part):
    """All stored records, oldest first. Records are never changed."""

    format: Literal["springscale-verifications"] = "springscale-verifications"
    version: Literal[1] = 1
    entries: tuple[Verification, ...] = ()

    def with_entry(self, entry: Verification) -> "VerificationHistory":
        """The history with one more record."""
        return self.model_copy(update={"entries": (*self.entries, entry)[-MOST_ENTRIES:]})


def axle_errors(
    known: StatedLoad, payload_kg: float, front_share_pct: float, vehicle: Vehicle
) -> tuple[AxleError | None, AxleError | None]:
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


def _axle_error(known_kg: float, error_kg: float) -> AxleError:
    return AxleError(known_kg=known_kg, error_kg=error_kg, error_pct=100.0 * error_kg / known_kg)


def is_within(rule: VerificationRule, error_pct: float, *axles: AxleError | None) -> bool:
    """Whether the gross weight's error, and each axle's if axles are judged, is within the permitted error."""
    most_axle_pct = rule.permitted_axle_error_pct
    return abs(error_pct) <= rule.permitted_error_pct and all(
        axle is None or most_axle_pct is None or abs(axle.error_pct) <= most_axle_pct for axle in axles
    )


def verdict_of(rule: VerificationRule, loads: tuple[VerifiedLoad, ...]) -> Verdict:
    """Passed if every load is within its limits and there are as many as the rule requires."""
    return "passed" if len(loads) >= rule.loads and all(load.is_within for load in loads) else "failed"
