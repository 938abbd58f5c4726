"""/api/v1/calibration/commissioning: a vehicle calibrated on its own machine; one route for each step."""

from typing import Annotated, Final, Literal

from fastapi import APIRouter, Query, Request
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field
from starlette.responses import Response

from gateway.stated.doubt import DoubtKind
from gateway.stated.facts import VehicleAnswers
from gateway.web.routes.known_weights import UndoQuery
from gateway.web.routes.service_calls import CommissioningBackend, Source, call_service, token_name
from gateway.web.schemas import Body, problem_responses, utf8_only


class Begin(Body):
    """Starts a commissioning; forbidden while another is under way."""

    note: str = Field("", max_length=200, description="kept in the history")


class LineNamed(BaseModel):
    """A file among the available lines."""

    model_config = ConfigDict(extra="forbid")

    name: str = Field(max_length=64, examples=["van-model.json"])
    source: Source


class ChooseLine(Body):
    """One of the available lines; null: none, with the prior of any vehicle."""

    line: LineNamed | None


class ClaimEmpty(Body):
    """The claim that the drive rests on."""

    again: bool = Field(False, description="discard the drive so far: the vehicle was not empty then")

    is_empty: Literal[True] = Field(
        description="you know that the vehicle is empty, and will be until the calibration is made"
    )


class UploadLine(Body):
    """The calibration of a vehicle of the same model, or a line file, from your disk."""

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,58}\.json$", examples=["van-model.json"])
    content: str = Field(max_length=1_000_000, description="the file's text")
    signature: str | None = Field(
        None, max_length=4096, description="the text of its .sig, if the service requires signatures"
    )


class LineTold(BaseModel):
    """The chosen line; no name: none."""

    name: str
    id: str | None
    source: Source | None


class ChosenLine(LineTold):
    """The same with those of its figures that prefill the form."""

    vehicle: dict[str, object]


class DoubtTold(BaseModel):
    """A fact that is unlikely to be true: it must be corrected or confirmed before the next step.

    ``numbers`` are those of the text, ``meant`` the answers that would leave no doubt, if one slip explains it.
    """

    kind: DoubtKind
    numbers: dict[str, float]
    meant: dict[str, float | tuple[float, float]]
    is_of_drive: bool = Field(description="the drive contradicts the stated facts; false: a stated fact is unusual")
    text: str
    advice: str


class EmptyTold(BaseModel):
    """Who said that the vehicle is empty, and when."""

    at: str = Field(json_schema_extra={"format": "date-time"})
    by: str


class FindingTold(BaseModel):
    """What inspection found."""

    kind: str = Field(examples=["pitch_rate_sign"])
    severity: Literal["fault", "warning", "note"]
    text: str
    advice: str


class InspectionTold(BaseModel):
    """What the last minutes of driving show about axes, signs, units and rates; a fault must be mended first."""

    seconds: float
    has_fault: bool
    findings: list[FindingTold]


class LearnedTold(BaseModel):
    """The accuracy reached so far and the accuracy needed: standard deviations."""

    payload_std_kg: float
    front_share_std_pct: float
    needed_std_kg: float
    share: float = Field(description="0 to 1 of the goal")
    is_enough: bool


class UnderwayTold(BaseModel):
    """The commissioning under way, and its next step."""

    step: Literal["line", "vehicle", "empty", "drive", "fit"]
    begun_at: str = Field(json_schema_extra={"format": "date-time"})
    by: str
    note: str | None
    line: ChosenLine | None
    vehicle: VehicleAnswers | None
    empty: EmptyTold | None = Field(description="null: nobody has said that it is empty")
    doubts: list[DoubtTold] = Field(description="what is asked still")
    confirmed: list[DoubtTold] = Field(description="doubts that were confirmed")
    inspection: InspectionTold | None = Field(description="null: no driving yet")
    n_batches: int = Field(description="of the empty drive that count")
    driven_s: float = Field(description="seconds in them, including the open one")
    next_window_s: float | None = Field(description="until the next one counts; null: the vehicle stands")
    learned: LearnedTold | None = Field(description="null: before the first batch is fitted")
    is_fitting: bool
    fault: str | None = Field(description="why the last fit made no calibration")


class MadeEnd(BaseModel):
    """How a calibration was replaced."""

    at: str = Field(json_schema_extra={"format": "date-time"})
    by: str
    why: Literal["undone", "back_to_factory"]


class MadeTold(BaseModel):
    """A calibration that was made on the vehicle."""

    id: str
    at: str = Field(json_schema_extra={"format": "date-time"})
    by: str
    note: str | None
    line: LineTold
    vehicle_name: str
    n_batches: int
    learned: LearnedTold | None
    warnings: list[str]
    ended: MadeEnd | None


class CommissioningState(BaseModel):
    """State of the commissioning, and earlier calibrations, newest first."""

    is_allowed: bool
    why_not: str | None
    is_offered: bool = Field(description="the service has no calibration, and none is pending")
    underway: UnderwayTold | None
    is_pending: bool = Field(description="another calibration than the one at work counts from the next drive on")
    active: MadeTold | None = Field(description="null: the calibration that the settings name, if any")
    history: list[MadeTold]


class LineFoundTold(BaseModel):
    """A file to choose; a fault says why it cannot be used. ``vehicle`` are its figures, to fill a form with."""

    name: str
    source: Source
    id: str | None
    vehicle: dict[str, object] | None
    fault: str | None


class LinesFound(BaseModel):
    """Every line there is."""

    items: list[LineFoundTold]


COMMISSIONING_PATH: Final = "/calibration/commissioning"


def commissioning_router(backend: CommissioningBackend) -> APIRouter:
    router = APIRouter(prefix="/api/v1" + COMMISSIONING_PATH, tags=["calibration"])
    refusals = problem_responses(403, 409, 503)
    of_body = {**refusals, **problem_responses(400, 422)}

    @router.get("", response_model=CommissioningState)
    async def commissioning_state(request: Request) -> Response:
        """The state: the next step, the findings of inspection, the accuracy reached, the calibrations made."""
        return await call_service(request, backend.state)

    @router.post("", status_code=201, response_model=CommissioningState, responses=of_body)
    async def begin_commissioning(request: Request, said: Begin) -> Response:
        """Begin. On disk before the answer, as every step."""
        note = said.note if "note" in said.model_fields_set else None
        return await call_service(request, lambda: backend.begin(token_name(request), note), 201)

    @router.delete("", response_model=CommissioningState, responses=refusals)
    async def cancel_commissioning(request: Request) -> Response:
        """Discard the commissioning under way, at any step. Calibrations made before stay as they are."""
        return await call_service(request, lambda: backend.cancel(token_name(request)))

    @router.get("/lines", response_model=LinesFound)
    async def lines(request: Request) -> Response:
        """The available lines: of the package, of the administrator, uploaded."""
        return await call_service(request, backend.lines)

    @router.post("/lines", status_code=201, response_model=LinesFound, responses={**of_body, **problem_responses(413)})
    async def upload_line(request: Request, said: UploadLine) -> Response:
        """Upload a file to choose from, checked whole, with its signature if the service requires one; up to 1 MiB."""
        return await call_service(request, lambda: backend.upload(said.name, said.content, said.signature), 201)

    @router.post("/line", response_model=CommissioningState, responses={**of_body, **problem_responses(404)})
    async def choose_line(request: Request, said: ChooseLine) -> Response:
        """Which line the vehicle is of. May be changed until the calibration is made."""
        return await call_service(
            request, lambda: backend.choose_line(*((said.line.name, said.line.source) if said.line else (None, None)))
        )

    @router.post("/vehicle", response_model=CommissioningState, responses=of_body)
    async def state_vehicle(request: Request, said: Annotated[VehicleAnswers, BeforeValidator(utf8_only)]) -> Response:
        """The empty vehicle's weights, its wheelbase, and the sensor's position. May be changed until then, too.

        Answers that are unlikely are kept and asked about (``doubts``): correct them, or confirm.
        """
        return await call_service(request, lambda: backend.state_vehicle(said))

    @router.post("/confirm", response_model=CommissioningState, responses=refusals)
    async def confirm_doubts(request: Request) -> Response:
        """Every doubt that is open: it is so all the same. Confirming a doubt from the drive puts the fit to use."""
        return await call_service(request, lambda: backend.confirm(token_name(request)))

    @router.post("/empty", response_model=CommissioningState, responses=of_body)
    async def claim_empty(request: Request, said: ClaimEmpty) -> Response:
        """The vehicle is empty now: driving counts from now on, until the goal is reached."""
        return await call_service(request, lambda: backend.is_empty(token_name(request), again=said.again))

    @router.post("/fit", response_model=CommissioningState, responses=refusals)
    async def fit_now(request: Request) -> Response:
        """Calibrate with the data so far, whether sufficient or not."""
        return await call_service(request, lambda: backend.fit_now(token_name(request)))

    @router.post("/undo", response_model=CommissioningState, responses={**refusals, **problem_responses(422)})
    async def undo_commissioning(request: Request, query: Annotated[UndoQuery, Query()]) -> Response:
        """Take the last calibration made here out of use, or all of them, from the next drive on."""
        return await call_service(request, lambda: backend.undo(token_name(request), to_factory=query.to == "factory"))

    return router
