"""/api/v1/calibration/commissioning: a vehicle calibrated on its own machine; one route for each step."""

from typing import Annotated, Final, Literal

from fastapi import APIRouter, Query
from pydantic import BeforeValidator, Field
from starlette.responses import Response

from gateway.stated.commissioning import CommissioningState
from gateway.stated.facts import VehicleAnswers
from gateway.web.routes.known_weights import UndoQuery
from gateway.web.routes.service_calls import By, CommissioningBackend, answered, created
from gateway.web.schemas import Body, problem_responses, utf8_only


class Begin(Body):
    """Starts a commissioning; forbidden while another is under way."""

    note: str = Field("", max_length=200, description="kept in the history")


class ClaimEmpty(Body):
    """The claim that the drive rests on."""

    again: bool = Field(False, description="discard the drive so far: the vehicle was not empty then")

    is_empty: Literal[True] = Field(
        description="you know that the vehicle is empty, and will be until the calibration is made"
    )


COMMISSIONING_PATH: Final = "/calibration/commissioning"


def commissioning_router(backend: CommissioningBackend) -> APIRouter:
    router = APIRouter(prefix="/api/v1" + COMMISSIONING_PATH, tags=["calibration"])
    refusals = problem_responses(403, 409, 503)
    of_body = {**refusals, **problem_responses(400, 422)}

    @router.get("", response_model=CommissioningState)
    async def commissioning_state() -> Response:
        """The state: the next step, the findings of inspection, the accuracy reached, the calibrations made."""
        return await answered(backend.state)

    @router.post("", status_code=201, response_model=CommissioningState, responses=of_body)
    async def begin_commissioning(by: By, said: Begin) -> Response:
        """Begin. On disk before the answer, as every step."""
        return await created(backend.begin, by, said.note if "note" in said.model_fields_set else None)

    @router.delete("", response_model=CommissioningState, responses=refusals)
    async def cancel_commissioning(by: By) -> Response:
        """Discard the commissioning under way, at any step. Calibrations made before stay as they are."""
        return await answered(backend.cancel, by)

    @router.post("/vehicle", response_model=CommissioningState, responses=of_body)
    async def state_vehicle(said: Annotated[VehicleAnswers, BeforeValidator(utf8_only)]) -> Response:
        """The empty vehicle's weights, its wheelbase, and the sensor's position. May be changed until then, too.

        Answers that are unlikely are kept and asked about (``doubts``): correct them, or confirm.
        """
        return await answered(backend.state_vehicle, said)

    @router.post("/confirm", response_model=CommissioningState, responses=refusals)
    async def confirm_doubts(by: By) -> Response:
        """Every doubt that is open: it is so all the same. Confirming a doubt from the drive puts the fit to use."""
        return await answered(backend.confirm, by)

    @router.post("/empty", response_model=CommissioningState, responses=of_body)
    async def claim_empty(by: By, said: ClaimEmpty) -> Response:
        """The vehicle is empty now: driving counts from now on, until the goal is reached."""
        return await answered(backend.is_empty, by, again=said.again)

    @router.post("/fit", response_model=CommissioningState, responses=refusals)
    async def fit_now(by: By) -> Response:
        """Calibrate with the data so far, whether sufficient or not."""
        return await answered(backend.fit_now, by)

    @router.post("/undo", response_model=CommissioningState, responses={**refusals, **problem_responses(422)})
    async def undo_commissioning(by: By, query: Annotated[UndoQuery, Query()]) -> Response:
        """Take the last calibration made here out of use, or all of them, from the next drive on."""
        return await answered(backend.undo, by, to_factory=query.to == "factory")

    return router
