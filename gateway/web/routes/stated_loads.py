"""/api/v1/statements and /api/v1/learning: what is said of loads, and what was learnt from it."""

import contextlib
import json
from collections.abc import Mapping
from typing import Annotated, Any, Final, Self
from zoneinfo import ZoneInfo

from fastapi import APIRouter, Path, Query, Request
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError, model_validator
from starlette.exceptions import HTTPException
from starlette.responses import Response

from gateway.stated.learning import (
    ImportTold,
    LearningState,
    StatementPage,
    StatementState,
    StatementTold,
)
from gateway.stated.statement import HALF_CHARACTER, TYPES, StatementRecord, is_text
from gateway.units import zone_of
from gateway.web.routes.service_calls import REFUSALS, By, LearnerBackend, answered, created
from gateway.web.schemas import Body, Instant, problem_responses

STATEMENTS_PATH: Final = "/statements"
LEARNING_PATH: Final = "/learning"
_ONE: Final = TypeAdapter(StatementRecord)
_BODY: Final[dict[str, Any]] = {
    "required": True,
    "content": {
        "application/json": {
            "schema": {
                "oneOf": [
                    {"$ref": "#/components/schemas/StatementRecord"},
                    {"type": "array", "items": {"$ref": "#/components/schemas/StatementRecord"}},
                ]
            },
            "examples": {
                "note": {"value": {"from": "2026-11-26T07:40:00Z", "source": "delivery_note",
                                   "load": {"payload_kg": 310, "plus_minus_kg": 25}, "ref": "LS-4711"}},
                "empty": {"value": {"from": "2026-11-26T07:40:00Z", "source": "empty"}},
            },
        },
        "text/csv": {"schema": {"type": "string", "examples": ["from;payload_kg;ref\n2026-11-26 07:40;310;LS-4711\n"]}},
    },
}  # fmt: skip
StatementId = Annotated[str, Path(max_length=200, description="as the list has it")]


class LearningChange(Body):
    """Which of the learnt calibrations to use, or that drives which look empty were not: one of both."""

    use: str | None = Field(
        None,
        max_length=80,
        description="id of a version: it is used from the next drive on, and none replaces it; `newest`: back to "
        "learning; `file`: that of the settings",
    )
    not_empty: list[Instant] | None = Field(
        None,
        min_length=1,
        max_length=1000,
        description="begins of drives that are asked about, as `propose` has them: they are not asked about again",
    )

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        if (self.use is None) is (self.not_empty is None):
            raise ValueError("give use or not_empty")
        return self


class ImportQuery(BaseModel):
    """How to read a table or a list."""

    model_config = ConfigDict(extra="forbid")

    dry_run: bool = Field(False, description="say what would become of the rows, and store nothing")
    timezone: str | None = Field(
        None, max_length=64, description="of times without one, such as Europe/Berlin [default: UTC]"
    )


class ListQuery(BaseModel):
    """Which statements to list."""

    model_config = ConfigDict(extra="forbid")

    since: Instant | None = Field(None, description="those that hold at this time or begin later")
    state: StatementState | None = None
    limit: int = Field(500, ge=1, le=1000)
    cursor: str | None = Field(None, max_length=200, description="`next_cursor` of the page before")


def statements_router(backend: LearnerBackend) -> APIRouter:
    router = APIRouter(prefix="/api/v1", tags=["learning"])
    of_body = {**REFUSALS, **problem_responses(400, 413, 415, 422)}
    of_id = {**REFUSALS, **problem_responses(404, 422)}

    @router.post(
        STATEMENTS_PATH,
        status_code=201,
        response_model=StatementTold | ImportTold,
        responses={**of_body, 200: {"model": ImportTold, "description": "a dry run"}},
        openapi_extra={"requestBody": _BODY},
    )
    async def state_load(by: By, request: Request, query: Annotated[ImportQuery, Query()]) -> Response:
        """State a load: before, during or after its drive. One statement, a list, or a table as CSV; on disk when
        answered.

        One statement answers with itself and what became of it. A list or a table answers with its rows: the good ones
        are stored, and every bad one is named. The same `ref` replaces; the same statement twice counts once.
        """
        kind, content = _kind(request), await request.body()
        if not query.dry_run and kind == "application/json" and not content.lstrip().startswith(b"["):
            return await created(backend.loads.state, _checked(content), by)
        where = "the list" if kind == "application/json" else "the table"
        ask = answered if query.dry_run else created
        zone = _zone(query.timezone)
        return await ask(backend.loads.import_all, content, by, where=where, zone=zone, is_dry_run=query.dry_run)

    @router.get(STATEMENTS_PATH, response_model=StatementPage, responses=problem_responses(409, 422))
    async def statements(query: Annotated[ListQuery, Query()]) -> Response:
        """Every statement with what became of it, the newest first: this list shows how well the vehicle is weighed."""
        return await answered(
            backend.loads.page, since_ns=query.since, state=query.state, limit=query.limit, cursor=query.cursor
        )

    @router.delete(STATEMENTS_PATH + "/{statement_id}", response_model=StatementTold, responses=of_id)
    async def withdraw_statement(by: By, statement_id: StatementId) -> Response:
        """Withdraw a statement: with the next fit it is as if it had never been stated."""
        return await answered(backend.loads.withdraw, statement_id, by)

    @router.post(STATEMENTS_PATH + "/{statement_id}/confirm", response_model=StatementTold, responses=of_id)
    async def confirm_statement(by: By, statement_id: StatementId) -> Response:
        """Confirm a statement that its drive contradicts: you have seen both numbers, and the stated one is right."""
        return await answered(backend.loads.confirm, statement_id, by)

    @router.get(LEARNING_PATH, response_model=LearningState)
    async def learning() -> Response:
        """How well a load is weighed now, what would help most, what is asked, and the versions learnt so far."""
        return await answered(backend.learnt.state)

    @router.put(LEARNING_PATH, response_model=LearningState, responses={**of_id, **problem_responses(400, 403)})
    async def change_learning(by: By, change: LearningChange) -> Response:
        """Use an earlier version, the newest, or the file of the settings, from the next drive on; or say that drives
        which look empty were not.
        """
        if change.not_empty is not None:
            return await answered(backend.learnt.not_empty, change.not_empty, by)
        return await answered(backend.learnt.use, change.use or "", by)

    return router


def _kind(request: Request) -> str:
    kind = request.headers.get("content-type", "application/json").partition(";")[0].strip().lower()
    if kind not in TYPES:
        raise HTTPException(415, f"{kind}: send application/json or text/csv")
    return kind


def _checked(content: bytes) -> StatementRecord:
    """Raises RequestValidationError, which becomes a problem that names every fault."""
    with contextlib.suppress(ValueError, RecursionError):
        if not is_text(json.loads(content)):
            raise RequestValidationError([{"type": "value_error", "loc": ("body",), "msg": HALF_CHARACTER}])
    try:
        return _ONE.validate_json(content)
    except ValidationError as fault:
        raise RequestValidationError(_in_body(fault.errors())) from None


def _in_body(errors: Any) -> list[Mapping[str, Any]]:
    return [{**one, "loc": ("body", *filter(None, [".".join(map(str, one["loc"]))]))} for one in errors]


def _zone(name: str | None) -> ZoneInfo | None:
    try:
        return None if name is None else zone_of(name)
    except ValueError as fault:
        told = {"type": "value_error", "loc": ("query", "timezone"), "msg": str(fault)}
        raise RequestValidationError([told]) from None
