"""/api/v1/known-weights: a known weight conditions every later estimate, until it is taken back.

``/calibration/tare`` and ``/calibration/tickets`` are the same list, of one kind each.
"""

import time
from typing import Annotated, Final, Literal

from fastapi import APIRouter, Path, Query
from pydantic import BaseModel, ConfigDict, Field, model_validator
from starlette.responses import Response

from gateway.core.known_weights import KnownWeightKind
from gateway.records import iso_utc
from gateway.stated.facts import Drive, KnownWeightFields, StatedWeight
from gateway.web.routes.service_calls import REFUSALS, By, KnownWeightBackend, answered, created
from gateway.web.schemas import Body, Instant, problem_responses

_LAST_NS: Final = 9_223_372_036_000_000_000  # the last whole second that 64 bits of nanoseconds hold
Kilograms = Annotated[float, Field(ge=0.0, le=100_000.0, allow_inf_nan=False)]  # chosen: no vehicle has more


class _When(BaseModel):
    """The time at which the weight was known, and the drive that carried it."""

    model_config = ConfigDict(extra="forbid")

    at: Instant | None = Field(None, description="time of the weighing [default: now]")
    drive: Drive | None = Field(
        None, description="the drive before or after `at` carried it [default: whichever was weighed, if only one was]"
    )

    std_kg: float | None = Field(
        None,
        gt=0.0,
        le=10_000.0,
        allow_inf_nan=False,
        description="standard deviation of each number that is stated [default: as usual for its kind]",
    )

    def at_text(self) -> str:
        """RFC 3339; a time beyond the range of time stamps is moved to its edge."""
        at_ns = time.time_ns() if self.at is None else self.at
        return iso_utc(min(max(at_ns, 0), _LAST_NS))

    def stated(self) -> StatedWeight:
        """The weight in the service's terms: the fields have the same names."""
        return StatedWeight(self.at_text(), **self.model_dump(exclude={"by", "at"}))


class GrossWeight(_When):
    """The whole vehicle on scales."""

    by: Literal["gross"]
    gross_kg: Kilograms = Field(examples=[1890.0])


class AxleWeights(_When):
    """Each axle on scales."""

    by: Literal["axles"]
    front_axle_kg: Kilograms = Field(examples=[850.0])
    rear_axle_kg: Kilograms = Field(examples=[1040.0])


class KnownPayload(_When):
    """The load aboard, from papers or from scales."""

    by: Literal["payload"]
    payload_kg: Kilograms = Field(examples=[270.0])
    position_m: float | None = Field(
        None, ge=-10.0, le=20.0, allow_inf_nan=False, description="its centre of gravity behind the front axle"
    )


Stated = Annotated[GrossWeight | AxleWeights | KnownPayload, Field(discriminator="by")]


KNOWN_WEIGHTS_PATH: Final = "/known-weights"
TARE_PATH: Final = "/calibration/tare"
TICKETS_PATH: Final = "/calibration/tickets"
EMPTY: Final = (KnownWeightKind.EMPTY,)
WEIGHED: Final = tuple(kind for kind in KnownWeightKind if kind is not KnownWeightKind.EMPTY)


Note = Annotated[
    str, Field(max_length=200, description="kept in the history: number of the ticket, scales used, place")
]


class KnownWeightRequest(Body):
    """What is known, and of what kind."""

    note: Note = ""
    kind: KnownWeightKind = Field(description="`empty`: it is empty now, and was so while it was last weighed")
    weight: Stated | None = Field(None, description="not for `empty`; of both axles for `axle_pads`")

    @model_validator(mode="after")
    def _fits(self) -> "KnownWeightRequest":
        if (self.kind is KnownWeightKind.EMPTY) != (self.weight is None):
            raise ValueError("`empty` has no weight, and every other kind has one")
        if self.kind is KnownWeightKind.AXLE_PADS and self.weight is not None and self.weight.by != "axles":
            raise ValueError("axle_pads weigh both axles: give front_axle_kg and rear_axle_kg")
        return self


class TareRequest(Body):
    """The statement that makes a tare."""

    note: Note = ""
    is_empty: Literal[True] = Field(
        description="you know that the vehicle is empty, and was during the last weighing (`offer` says when)"
    )


class TicketRequest(Body):
    """The weight on the ticket."""

    note: Note = ""
    weight: Stated


class KnownWeightEntry(KnownWeightFields):
    """One known weight: the true load, and its estimate without this entry."""

    state: Literal["in_use", "held", "ended", "other_calibration"] = Field(
        description="held: it contradicts its estimate by more than three standard deviations; it counts once confirmed"
    )


class OfferedLoad(BaseModel):
    """The load that was weighed last, with its present estimate."""

    payload_kg: float
    payload_std_kg: float
    front_share_pct: float
    front_share_std_pct: float
    n_batches: int
    t_start: str
    t_end: str


class Offer(BaseModel):
    """Whether "it is empty now" is possible, and for which load; else why not."""

    is_possible: bool
    reason: str | None = Field(examples=["no_counted_batch"])
    detail: str | None
    load: OfferedLoad | None


class KnownWeightState(BaseModel):
    """Every known weight, newest first, and their combined effect."""

    known_weights_id: str | None = Field(description="hash of those in use, as estimates name it; null: there are none")
    n_teaching: int
    mean_error_kg: float | None = Field(description="estimate without it minus known weight: mean over those in use")
    error_std_kg: float | None = Field(description="scatter of these errors; null with fewer than two")
    offer: Offer
    fault: str | None = Field(description="what is wrong with the file")
    history: list[KnownWeightEntry]


class UndoQuery(BaseModel):
    """How many to take back."""

    model_config = ConfigDict(extra="forbid")

    to: Literal["previous", "factory"] = Field("previous", description="the last one, or all of them")


EntryId = Annotated[str, Path(max_length=80, description="as the history has it")]
_ADDED: Final = {**REFUSALS, **problem_responses(400, 422)}
_CHANGED: Final = {**REFUSALS, **problem_responses(404, 422)}


def known_weights_router(service: KnownWeightBackend) -> APIRouter:
    """The routes of known weights, and those of tare and tickets, which are kinds of them."""
    router = APIRouter(prefix="/api/v1", tags=["calibration"])

    @router.get(KNOWN_WEIGHTS_PATH, response_model=KnownWeightState)
    async def known_weights() -> Response:
        """Every known weight, their combined effect, and the load at which "it is empty now" would be taken."""
        return await answered(service.state)

    @router.post(KNOWN_WEIGHTS_PATH, status_code=201, response_model=KnownWeightEntry, responses=_ADDED)
    async def add_known_weight(by: By, claim: KnownWeightRequest) -> Response:
        """State a known load: it counts from the next batch on. On disk when answered.

        A known weight that contradicts its estimate is kept as `held` and counts once somebody confirms it.
        """
        stated = None if claim.weight is None else claim.weight.stated()
        return await created(service.add, claim.kind, by, claim.note or None, stated)

    @router.post(KNOWN_WEIGHTS_PATH + "/{entry_id}/confirm", response_model=KnownWeightState, responses=_CHANGED)
    async def confirm_known_weight(by: By, entry_id: EntryId) -> Response:
        """Confirm a held known weight: you have seen both numbers, and the known one is right."""
        return await answered(service.confirm, by, entry_id)

    @router.delete(KNOWN_WEIGHTS_PATH + "/{entry_id}", response_model=KnownWeightState, responses=_CHANGED)
    async def take_back_known_weight(by: By, entry_id: EntryId) -> Response:
        """Take one back: from the next batch on all numbers are as if it had never been stated."""
        return await answered(service.take_back, by, entry_id)

    @router.get(TARE_PATH, response_model=KnownWeightState)
    async def tare_state() -> Response:
        """The known weights of kind `empty`."""
        return await answered(service.state, EMPTY)

    @router.post(TARE_PATH, status_code=201, response_model=KnownWeightEntry, responses=_ADDED)
    async def set_tare(by: By, claim: TareRequest) -> Response:
        """State that the vehicle is empty now: the same as a known weight of kind `empty`."""
        return await created(service.add, KnownWeightKind.EMPTY, by, claim.note or None)

    @router.delete(TARE_PATH, response_model=KnownWeightState, responses=_CHANGED)
    async def undo_tare(by: By, query: Annotated[UndoQuery, Query()]) -> Response:
        """Take the last known weight of kind `empty` back, or all of them."""
        return await answered(service.take_back_empty, by, to_factory=query.to == "factory")

    @router.get(TICKETS_PATH, response_model=KnownWeightState)
    async def ticket_state() -> Response:
        """The known weights of loads: tickets, axle pads and delivery notes."""
        return await answered(service.state, WEIGHED)

    @router.post(TICKETS_PATH, status_code=201, response_model=KnownWeightEntry, responses=_ADDED)
    async def add_ticket(by: By, claim: TicketRequest) -> Response:
        """State a weighbridge's ticket: the same as a known weight of kind `ticket`."""
        return await created(service.add, KnownWeightKind.TICKET, by, claim.note or None, claim.weight.stated())

    @router.delete(TICKETS_PATH + "/{entry_id}", response_model=KnownWeightState, responses=_CHANGED)
    async def withdraw_ticket(by: By, entry_id: EntryId) -> Response:
        """Take a ticket back."""
        return await answered(service.take_back, by, entry_id, WEIGHED)

    return router
