"""Every error leaves as problem details (RFC 9457): what is wrong, where, and how to mend it."""

import http
from collections.abc import Mapping, Sequence
from typing import Final

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from gateway.errors import RefusedError, StoreError
from gateway.files.toml_file import beyond
from gateway.web.schemas import PROBLEM_TYPE, Fault, Problem

_PLAINER: Final = {  # replacements of pydantic's messages
    "extra_forbidden": "unknown here: /docs lists what is available",
    "model_attributes_type": "send a JSON object, with Content-Type: application/json",
    "json_invalid": "this is no JSON",
}


def problem_response(
    status: int,
    detail: str,
    instance: str | None = None,
    errors: Sequence[Fault] | None = None,
    reason: str | None = None,
    headers: Mapping[str, str] | None = None,
) -> Response:
    """A problem as sent; ``instance`` is the requested path, if known."""
    problem = Problem(
        title=http.HTTPStatus(status).phrase,
        status=status,
        detail=detail,
        instance=instance,
        reason=reason,
        errors=None if errors is None else list(errors),
    )
    return JSONResponse(problem.model_dump(exclude_none=True), status, headers=headers, media_type=PROBLEM_TYPE)


def install(app: FastAPI, routes: Sequence[Route]) -> None:
    """Answer every error in ``app`` with problem details; ``routes`` tell which methods an address takes."""

    async def not_here(request: Request, _error: Exception) -> Response:
        path = request.url.path
        found = {method for route in routes if route.path_regex.match(path) for method in route.methods or ()}
        allowed = sorted((found or {"GET"}) | ({"HEAD"} if "GET" in found or not found else set()))
        headers = {"allow": ", ".join(allowed)}
        return problem_response(405, f"{request.method} is not possible here", path, headers=headers)

    app.add_exception_handler(405, not_here)
    app.add_exception_handler(HTTPException, _http)
    app.add_exception_handler(RequestValidationError, _invalid)
    app.add_exception_handler(RefusedError, _refused)
    app.add_exception_handler(StoreError, _unavailable)
    app.add_exception_handler(TimeoutError, _unavailable)
    app.add_exception_handler(ClientDisconnect, _broken_off)
    app.add_exception_handler(Exception, _unforeseen)


async def _http(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    detail = error.detail
    if error.status_code == 404 and detail == http.HTTPStatus.NOT_FOUND.phrase:
        detail = "there is nothing at this address: /openapi.json lists what there is"
    return problem_response(error.status_code, detail, request.url.path, headers=error.headers)


async def _invalid(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    said: dict[str, str] = {}
    for fault in error.errors():  # all parameters are flat; deeper places are pydantic's own branches
        what = beyond(fault) or _PLAINER.get(fault["type"], fault["msg"].removeprefix("Value error, "))
        said.setdefault(".".join(map(str, fault["loc"][:2])), what)
    detail = "; ".join(f"{where}: {what}" for where, what in said.items())
    faults = [Fault(where=where, what=what) for where, what in said.items()]
    return problem_response(422, detail, request.url.path, faults)


_CODES: Final = {
    "not_stored": 503,
    "not_allowed": 403,
    "no_such_statement": 404,
    "no_such_version": 404,
    "no_such_drive": 404,
    "unreadable": 422,
}  # of reasons; else 409


async def _refused(request: Request, refusal: Exception) -> Response:
    assert isinstance(refusal, RefusedError)
    code = _CODES.get(refusal.reason, 409)
    return problem_response(code, str(refusal), request.url.path, reason=refusal.reason)


async def _unavailable(request: Request, error: Exception) -> Response:
    return problem_response(503, str(error), request.url.path)


async def _broken_off(request: Request, _error: Exception) -> Response:
    """For nobody: the client has left in the middle of its request, or sent what is none."""
    return problem_response(400, "the request broke off", request.url.path)


async def _unforeseen(request: Request, _error: Exception) -> Response:
    return problem_response(500, "the service met an error it did not expect; its log has it", request.url.path)
