"""The addresses of a commissioning: its state, and one for each step."""

import asyncio
from typing import Annotated, Final, Protocol

from fastapi import APIRouter, Query, Request
from pydantic import BeforeValidator
from starlette.responses import Response

from gateway.stated import VehicleAnswers
from gateway.web.routes.calibration.asking import answered, json_response, who
from gateway.web.routes.calibration.known_weights import UndoQuery
from gateway.web.routes.commissioning.shapes import (
    Begin,
    ChooseLine,
    ClaimEmpty,
    CommissioningState,
    LinesFound,
    Source,
    UploadLine,
)
from gateway.web.schemas import problem_responses, utf8_only

COMMISSIONING_PATH: Final = "/calibration/commissioning"
NOT_HERE: Final = "there is no service behind this page that could calibrate"


class CommissioningDesk(Protocol):
    """Who commissions. Blocking calls, each from a thread of its own; answers are JSON: a CommissioningState, or
    LinesFound. All but ``told`` and ``lines`` raise CommissioningRefusedError.
    """

    def told(self) -> str: ...
    def lines(self) -> str: ...
    def begin(self, by: str, note: str | None) -> str: ...
    def upload(self, name: str, content: str, signature: str | None) -> str: ...
    def choose_line(self, name: str | None, source: Source | None) -> str: ...
    def state_vehicle(self, answers: VehicleAnswers) -> str: ...
    def confirm(self, by: str) -> str: ...
    def is_empty(self, by: str, *, again: bool = False) -> str: ...
    def fit_now(self, by: str) -> str: ...
    def cancel(self, by: str) -> str: ...
    def undo(self, by: str, *, to_factory: bool) -> str: ...


def commissioning_router(desk: CommissioningDesk) -> APIRouter:
    """The routes of a commissioning."""
    router = APIRouter(prefix="/api/v1" + COMMISSIONING_PATH, tags=["calibration"])
    refusals = problem_responses(403, 409, 503)
    of_body = {**refusals, **problem_responses(400, 422)}

    @router.get("", response_model=CommissioningState)
    async def commissioning_state() -> Response:
        """The state: the next step, the findings of inspection, the accuracy reached, the calibrations made."""
        return json_response(await asyncio.to_thread(desk.told))

    @router.post("", status_code=201, response_model=CommissioningState, responses=of_body)
    async def begin_commissioning(request: Request, said: Begin) -> Response:
        """Begin. On disk before the answer, as every step."""
        note = said.note if "note" in said.model_fields_set else None
        return await answered(request, lambda: desk.begin(who(request), note), 201)

    @router.delete("", response_model=CommissioningState, responses=refusals)
    async def cancel_commissioning(request: Request) -> Response:
        """Discard the commissioning under way, at any step. Calibrations made before stay as they are."""
        return await answered(request, lambda: desk.cancel(who(request)))

    @router.get("/lines", response_model=LinesFound)
    async def lines() -> Response:
        """The available lines: of the package, of the administrator, uploaded."""
        return json_response(await asyncio.to_thread(desk.lines))

    @router.post("/lines", status_code=201, response_model=LinesFound, responses={**of_body, **problem_responses(413)})
    async def upload_line(request: Request, said: UploadLine) -> Response:
        """Upload a file to choose from, checked whole, with its signature if the service requires one; up to 1 MiB."""
        return await answered(request, lambda: desk.upload(said.name, said.content, said.signature), 201)

    @router.post("/line", response_model=CommissioningState, responses={**of_body, **problem_responses(404)})
    async def choose_line(request: Request, said: ChooseLine) -> Response:
        """Which line the vehicle is of. May be changed until the calibration is made."""
        return await answered(
            request, lambda: desk.choose_line(*((said.line.name, said.line.source) if said.line else (None, None)))
        )

    @router.post("/vehicle", response_model=CommissioningState, responses=of_body)
    async def state_vehicle(request: Request, said: Annotated[VehicleAnswers, BeforeValidator(utf8_only)]) -> Response:
        """The empty vehicle's weights, its wheelbase, and the sensor's position. May be changed until then, too.

        Answers that are unlikely are kept and asked about (``doubts``): correct them, or confirm.
        """
        return await answered(request, lambda: desk.state_vehicle(said))

    @router.post("/confirm", response_model=CommissioningState, responses=refusals)
    async def confirm_doubts(request: Request) -> Response:
        """Every doubt that is open: it is so all the same. Confirming a doubt from the drive puts the fit to use."""
        return await answered(request, lambda: desk.confirm(who(request)))

    @router.post("/empty", response_model=CommissioningState, responses=of_body)
    async def claim_empty(request: Request, said: ClaimEmpty) -> Response:
        """The vehicle is empty now: driving counts from now on, until the goal is reached."""
        return await answered(request, lambda: desk.is_empty(who(request), again=said.again))

    @router.post("/fit", response_model=CommissioningState, responses=refusals)
    async def fit_now(request: Request) -> Response:
        """Calibrate with the data so far, whether sufficient or not."""
        return await answered(request, lambda: desk.fit_now(who(request)))

    @router.post("/undo", response_model=CommissioningState, responses={**refusals, **problem_responses(422)})
    async def undo_commissioning(request: Request, query: Annotated[UndoQuery, Query()]) -> Response:
        """Take the last calibration made here out of use, or all of them, from the next drive on."""
        return await answered(request, lambda: desk.undo(who(request), to_factory=query.to == "factory"))

    return router
