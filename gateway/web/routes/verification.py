"""/api/v1/calibration/verifications: known loads compared with the estimates, as dated records."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Final, Literal, Protocol

from fastapi import APIRouter, Path, Request
from pydantic import BaseModel, Field
from starlette.responses import HTMLResponse, Response

from gateway.stated_weight import StatedWeight
from gateway.status import VerificationStatus
from gateway.web.access.problems import problem_response
from gateway.web.routes.service_calls import REFUSALS, call_service, token_name
from gateway.web.routes.stated_weights import Stated
from gateway.web.routes.verification_page import POLICY, verification_page
from gateway.web.schemas import Body, problem_responses

VERIFICATIONS_PATH: Final = "/calibration/verifications"
_PAGE: Final[dict[int | str, dict[str, Any]]] = {
    200: {"content": {"text/html": {"schema": {"type": "string"}}}, "description": "the page"}
}


class VerificationBackend(Protocol):
    """The service's verifications. Blocking calls, made in threads; answers are JSON as described below."""

    def state(self) -> str:
        """A VerificationState."""
        ...

    def record(self, record_id: str) -> Mapping[str, Any] | None:
        """A VerificationRecord; None if none has this id."""
        ...

    def verify(self, by: str, note: str | None, stated: Sequence[StatedWeight]) -> str:
        """The new VerificationRecord. Raises WeightRefusedError."""
        ...


class VerificationRequest(Body):
    """The loads that were weighed, and a word on them."""

    loads: list[Stated] = Field(min_length=1, max_length=10)
    note: str = Field("", max_length=200, description="kept with the record: scales used, place, weather")


class Rule(BaseModel):
    """The requirements ([verification] in the settings)."""

    permitted_error_pct: float = Field(description="of the known gross weight")
    permitted_axle_error_pct: float | None = Field(description="of each axle's known weight; null: not judged")
    loads: int


class AxleErrorTold(BaseModel):
    """Weighed less known."""

    known_kg: float
    error_kg: float
    error_pct: float


class LoadTold(BaseModel):
    """One load: stated, weighed, and the errors."""

    stated: StatedWeight
    t_start: str
    t_end: str
    n_batches: int
    batch_ids: list[str]
    known_payload_kg: float
    known_reference_kg: float = Field(description="gross; without unsprung masses the sprung mass alone")
    payload_kg: float
    payload_std_kg: float
    error_kg: float
    error_pct: float = Field(description="of known_reference_kg")
    front_axle: AxleErrorTold | None
    rear_axle: AxleErrorTold | None
    is_within: bool


class VerificationRecord(BaseModel):
    """A dated record; it is never changed."""

    id: str = Field(examples=["sha256:9f86d081"])
    at: str = Field(json_schema_extra={"format": "date-time"})
    by: str = Field(description="name of the token; `local` if none are in use")
    note: str | None
    vehicle_id: str | None
    calibration_id: str
    estimator: str
    known_weights_id: str | None = Field(description="known weights that the estimate used; null: none")
    rule: Rule
    loads: list[LoadTold]
    verdict: Literal["passed", "failed"]


class VerificationState(BaseModel):
    """The requirements, when the next one is due, and the records, newest first."""

    rule: Rule
    due: VerificationStatus
    warning: str | None = Field(description="what is wrong with the file of the records")
    history: list[VerificationRecord]


def verification_router(backend: VerificationBackend) -> APIRouter:
    """The routes of verification."""
    router = APIRouter(prefix="/api/v1", tags=["calibration"])

    @router.get(VERIFICATIONS_PATH, response_model=VerificationState)
    async def verification_state(request: Request) -> Response:
        """The requirements, when a verification is due, and the records."""
        return await call_service(request, backend.state)

    @router.post(
        VERIFICATIONS_PATH,
        status_code=201,
        response_model=VerificationRecord,
        responses={**REFUSALS, **problem_responses(400, 422)},
    )
    async def verify(request: Request, claim: VerificationRequest) -> Response:
        """Compare known loads with their estimates. The calibration does not change; the record is on disk before the
        answer.
        """
        stated = [load.stated() for load in claim.loads]
        return await call_service(request, lambda: backend.verify(token_name(request), claim.note or None, stated), 201)

    @router.get(
        VERIFICATIONS_PATH + "/{record_id}",
        response_class=Response,
        responses={**_PAGE, **problem_responses(404, 422)},
    )
    async def verification_record(
        request: Request, record_id: Annotated[str, Path(max_length=80, description="as the list has it")]
    ) -> Response:
        """One record as a page to print, or to keep as a file: it needs nothing else."""
        record = backend.record(record_id)
        if record is None:
            return problem_response(404, "there is no such record: the list has all of them", request.url.path)
        return HTMLResponse(verification_page(record), headers={"content-security-policy": POLICY})

    return router
