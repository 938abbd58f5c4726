"""/api/v1/calibration/tare: the zero of an empty vehicle, set, undone and looked at."""

import asyncio
from typing import Annotated, Final, Literal, Protocol

from fastapi import APIRouter, Query, Request
from pydantic import BaseModel, ConfigDict, Field
from starlette.responses import Response

from gateway.errors import TareRefusedError
from gateway.records import json_line
from gateway.web.routes.calibration.asking import REFUSALS, answered, json_response, who
from gateway.web.schemas import Body, problem_responses

TARE_PATH: Final = "/calibration/tare"


class TareDesk(Protocol):
    """Who keeps the tares. Blocking calls, each from a thread of its own; answers are JSON as described below."""

    def told(self) -> str:
        """A TareState."""
        ...

    def tare(self, by: str, note: str | None) -> str:
        """The new Tare. Raises TareRefusedError."""
        ...

    def undo(self, by: str, *, to_factory: bool) -> str:
        """The TareState after it. Raises TareRefusedError."""
        ...


class NoTareDesk:
    """Where nothing is weighed there is nothing to re-zero."""

    def told(self) -> str:
        """The factory zero, for good."""
        offer = {"is_possible": False, "reason": "no_calibration", "detail": self._why(), "zero": None}
        return json_line({"active": None, "offer": offer, "history": []})

    def tare(self, by: str, note: str | None) -> str:
        """Always refused."""
        raise TareRefusedError("no_calibration", self._why())

    def undo(self, by: str, *, to_factory: bool) -> str:
        """Always refused."""
        raise TareRefusedError("not_tared", "there is no tare in use: this is the factory zero already")

    @staticmethod
    def _why() -> str:
        return "there is no calibration, and so nothing to correct"


class TareRequest(Body):
    """The claim that makes a tare, and a word on it."""

    is_empty: Literal[True] = Field(
        description="you know that the vehicle is empty, and was so while it was last weighed (`offer` tells when)"
    )
    note: str = Field("", max_length=200, description="kept in the history; left out: none is")

    @property
    def told_note(self) -> str | None:
        """None where nothing was said."""
        return self.note if "note" in self.model_fields_set else None


class TareEnd(BaseModel):
    """How a tare went out of use."""

    at: str = Field(json_schema_extra={"format": "date-time"})
    by: str
    why: Literal["undone", "back_to_factory", "other_calibration"]


class Tare(BaseModel):
    """One tare: what the empty vehicle was weighed as, less what it is. Payload in kg, share in percentage points."""

    id: str = Field(examples=["sha256:9f86d081"])
    at: str = Field(json_schema_extra={"format": "date-time"})
    by: str = Field(description="name of the token; `local` where none are in use", examples=["workshop"])
    note: str | None
    vehicle_id: str | None
    calibration_id: str = Field(description="it belongs to this calibration and ends with it")
    estimator: str
    payload_kg: float = Field(description="taken off every later payload", examples=[12.4])
    payload_std_kg: float = Field(description="carried into every later standard deviation", examples=[6.1])
    front_share_pct: float
    front_share_std_pct: float
    n_batches: int
    batch_ids: list[str] = Field(description="the newest of the batches it rests on, newest last")
    t_start: str
    t_end: str
    ended: TareEnd | None = Field(description="null: it has not ended; the last of these is in use")


class OfferedZero(BaseModel):
    """The raw weighing that a tare would make the zero."""

    payload_kg: float
    payload_std_kg: float
    front_share_pct: float = Field(description="offset from the empty share, percentage points")
    front_share_std_pct: float
    n_batches: int
    t_start: str
    t_end: str


class TareOffer(BaseModel):
    """Whether a tare is possible now, and of what; else why not."""

    is_possible: bool
    reason: str | None = Field(examples=["no_counted_batch"])
    detail: str | None
    zero: OfferedZero | None


class TareState(BaseModel):
    """The tare in use (null: the factory zero), what another would be made from, the history newest first."""

    active: Tare | None
    offer: TareOffer
    history: list[Tare]


class UndoQuery(BaseModel):
    """How far to go back."""

    model_config = ConfigDict(extra="forbid")

    to: Literal["previous", "factory"] = Field(
        "previous", description="the tare before this one, or none: as it was calibrated"
    )


def tare_router(desk: TareDesk) -> APIRouter:
    """The routes of the tare."""
    router = APIRouter(prefix="/api/v1", tags=["calibration"])

    @router.get(TARE_PATH, response_model=TareState)
    async def tare_state() -> Response:
        """The tare in use, what another would be made from now, and the history."""
        return json_response(await asyncio.to_thread(desk.told))

    @router.post(TARE_PATH, status_code=201, response_model=Tare, responses={**REFUSALS, **problem_responses(400, 422)})
    async def set_tare(request: Request, claim: TareRequest) -> Response:
        """Make the last weighing the zero of the empty vehicle, from the next batch on. On disk when answered."""
        return await answered(request, lambda: desk.tare(who(request), claim.told_note), 201)

    @router.delete(TARE_PATH, response_model=TareState, responses={**REFUSALS, **problem_responses(422)})
    async def undo_tare(request: Request, query: Annotated[UndoQuery, Query()]) -> Response:
        """Take the last tare out of use, or all of them; raw numbers never change. On disk when answered."""
        return await answered(request, lambda: desk.undo(who(request), to_factory=query.to == "factory"), 200)

    return router
