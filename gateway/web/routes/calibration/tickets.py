"""/api/v1/calibration/tickets: known weights that the vehicle's own calibration learns from."""

from typing import Annotated, Final, Protocol

from fastapi import APIRouter, Path, Request
from pydantic import BaseModel, Field
from starlette.responses import Response

from gateway.errors import WeightRefusedError
from gateway.records import json_line
from gateway.stated_weight import StatedWeight
from gateway.web.routes.calibration.asking import REFUSALS, answered, who
from gateway.web.routes.calibration.stated import Stated
from gateway.web.routes.calibration.verification import StatedTold
from gateway.web.schemas import Body, problem_responses

TICKETS_PATH: Final = "/calibration/tickets"
_NOT_HERE: Final = "no vehicle is weighed here"


class TicketDesk(Protocol):
    """Who keeps them. Blocking calls; answers are JSON as described below."""

    def told(self) -> str:
        """A TicketState."""
        ...

    def add(self, by: str, note: str | None, stated: StatedWeight) -> str:
        """The new Ticket. Raises WeightRefusedError."""
        ...

    def withdraw(self, by: str, ticket_id: str) -> str:
        """The TicketState after it. Raises WeightRefusedError."""
        ...


class NoTicketDesk:
    """Where nothing is weighed there is nothing to learn."""

    def told(self) -> str:
        """None is possible."""
        state = {"is_possible": False, "why_not": _NOT_HERE, "is_busy": False, "n_teaching": 0, "is_provisional": True}
        return json_line(state | {"planned": None, "fault": None, "history": []})

    def add(self, by: str, note: str | None, stated: StatedWeight) -> str:
        """Always refused."""
        raise WeightRefusedError("not_commissioned", _NOT_HERE)

    def withdraw(self, by: str, ticket_id: str) -> str:
        """Always refused."""
        raise WeightRefusedError("no_such_ticket", "there is no such ticket that still stands")


class TicketRequest(Body):
    """The weight that is known, and a word on it."""

    weight: Stated
    note: str = Field("", max_length=200, description="kept in the history: number of the ticket, place")


class WithdrawalTold(BaseModel):
    """When and by whom a ticket was taken back."""

    at: str
    by: str


class Ticket(BaseModel):
    """A known weight, and the load that it is of."""

    id: str = Field(examples=["sha256:9f86d081"])
    at: str = Field(json_schema_extra={"format": "date-time"}, description="when it was handed in")
    by: str = Field(description="name of the token; `local` where none are in use")
    note: str | None
    base_id: str = Field(description="the commissioned calibration that it improves")
    stated: StatedTold
    t_start: str = Field(description="of the load epoch")
    t_end: str
    batch_ids: list[str] = Field(description="kept batches of that load")
    payload_kg: float
    front_share_pct: float | None = Field(description="null: nobody said where it lies, and so it teaches nothing")
    withdrawn: WithdrawalTold | None


class PlannedTold(BaseModel):
    """How well it weighs now, and the load that would help most: standard deviations over the loads it may carry."""

    payload_std_kg: float
    front_share_std_pct: float
    load_kg: float = Field(description="to drive next, with a ticket")
    load_position_m: float | None = Field(description="behind the front axle; null: nothing aboard")
    then_payload_std_kg: float = Field(description="expected once that is driven too")
    then_front_share_std_pct: float
    is_enough: bool = Field(description="no load would help by a tenth")


class TicketState(BaseModel):
    """Whether tickets teach, what they taught, and what would help most."""

    is_possible: bool
    why_not: str | None
    is_busy: bool = Field(description="a fit is under way")
    n_teaching: int = Field(description="tickets that stand and say where the load lies")
    is_provisional: bool = Field(description="more loads would still narrow the weighing")
    planned: PlannedTold | None = Field(description="null: not fitted yet")
    fault: str | None = Field(description="why the last fit made no calibration, or what is wrong with the file")
    history: list[Ticket] = Field(description="newest first")


def tickets_router(desk: TicketDesk) -> APIRouter:
    """The routes of the tickets."""
    router = APIRouter(prefix="/api/v1", tags=["calibration"])

    @router.get(TICKETS_PATH, response_model=TicketState)
    async def ticket_state(request: Request) -> Response:
        """Whether tickets teach, what they taught, what would help most, and the history."""
        return await answered(request, desk.told)

    @router.post(
        TICKETS_PATH, status_code=201, response_model=Ticket, responses={**REFUSALS, **problem_responses(400, 422)}
    )
    async def add_ticket(request: Request, claim: TicketRequest) -> Response:
        """Attach a known weight to the load of its time; the calibration is made anew in the background."""
        stated = claim.weight.stated()
        return await answered(request, lambda: desk.add(who(request), claim.note or None, stated), 201)

    @router.delete(
        TICKETS_PATH + "/{ticket_id}", response_model=TicketState, responses={**REFUSALS, **problem_responses(422)}
    )
    async def withdraw_ticket(
        request: Request, ticket_id: Annotated[str, Path(max_length=80, description="as the history has it")]
    ) -> Response:
        """Take a ticket back: the calibration is made anew without it."""
        return await answered(request, lambda: desk.withdraw(who(request), ticket_id), 200)

    return router
