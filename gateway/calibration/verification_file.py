"""verifications.json: known loads that were weighed without learning from them, with their errors and a verdict."""

from typing import Annotated, Final, Literal

from pydantic import Field

from gateway.calibration.file.calibration_file import content_id
from gateway.calibration.file.parts import Part
from gateway.calibration.known_weight import StatedLoad
from gateway.core.vehicle import Vehicle
from gateway.stated_weight import StatedWeight

FILE_NAME: Final = "verifications.json"
MOST_ENTRIES: Final = 500  # the oldest beyond are forgotten
MOST_LOADS: Final = 10

Finite = Annotated[float, Field(allow_inf_nan=False)]
Verdict = Literal["passed", "failed"]


class VerificationRule(Part):
    """What a verification asks for: by how much the gross weight, and each axle's, may err, and how many loads."""

    permitted_error_pct: float
    permitted_axle_error_pct: float | None
    loads: int


class AxleError(Part):
    """How an axle was weighed: weighed less known, and that in percent of the known."""

    known_kg: Finite
    error_kg: Finite
    error_pct: Finite


class VerifiedLoad(Part):
    """One known load: what was stated, what it was weighed as, and the errors."""

    stated: StatedWeight
    t_start: str = Field(description="of the load epoch that was weighed")
    t_end: str
    n_batches: int
    batch_ids: tuple[str, ...] = Field(description="the newest of its batches")
    known_payload_kg: Finite
    known_reference_kg: Finite = Field(description="the known gross weight; without unsprung masses the sprung mass")
    payload_kg: Finite = Field(description="as weighed")
    payload_std_kg: Finite
    error_kg: Finite = Field(description="weighed less known")
    error_pct: Finite = Field(description="of known_reference_kg")
    front_axle: AxleError | None
    rear_axle: AxleError | None
    is_within: bool = Field(description="every error that is judged is within what is permitted")


class Verification(Part):
    """A dated record of some known loads; ``id`` is the hash of everything else."""

    id: str
    at: str
    by: str
    note: str | None
    vehicle_id: str | None
    calibration_id: str
    estimator: str
    known_weights_id: str | None
    rule: VerificationRule
    loads: tuple[VerifiedLoad, ...] = Field(min_length=1, max_length=MOST_LOADS)
    verdict: Verdict

    def content_id(self) -> str:
        """What ``id`` has to be."""
        return content_id(self.model_dump(mode="json", exclude={"id"}))


class VerificationHistory(Part):
    """All that is remembered, oldest first. Records are never changed."""

    format: Literal["springscale-verifications"] = "springscale-verifications"
    version: Literal[1] = 1
    entries: tuple[Verification, ...] = ()

    def with_entry(self, entry: Verification) -> "VerificationHistory":
        """With one more record."""
        return self.model_copy(update={"entries": (*self.entries, entry)[-MOST_ENTRIES:]})


def axle_errors(
    known: StatedLoad, payload_kg: float, front_share_pct: float, vehicle: Vehicle
) -> tuple[AxleError | None, AxleError | None]:
    """Of the front and the rear axle; None where the known load has no place. Unsprung masses drop out of an error."""
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
    """The gross weight errs no more than is permitted, nor does an axle where axles are judged."""
    most_axle_pct = rule.permitted_axle_error_pct
    return abs(error_pct) <= rule.permitted_error_pct and all(
        axle is None or most_axle_pct is None or abs(axle.error_pct) <= most_axle_pct for axle in axles
    )


def verdict_of(rule: VerificationRule, loads: tuple[VerifiedLoad, ...]) -> Verdict:
    """Passed where every load is within, and there are as many as the rule asks for."""
    return "passed" if len(loads) >= rule.loads and all(load.is_within for load in loads) else "failed"
