"""Every error leaves as problem details (RFC 9457): what is wrong, where, and how to mend it."""

import http
from collections.abc import Mapping, Sequence
from typing import Any, Final

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse, Response

from gateway.errors import RefusedError, StoreError
from gateway.web.schemas import Fault, Problem

MEDIA_TYPE: Final = "application/problem+json"
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
    return JSONResponse(problem.model_dump(exclude_none=True), status, headers=headers, media_type=MEDIA_TYPE)


def install(app: FastAPI) -> None:
    """Answer every error in ``app`` with problem details."""
    app.add_exception_handler(HTTPException, _http)
    app.add_exception_handler(RequestValidationError, _invalid)
    app.add_exception_handler(RefusedError, _refused)
    app.add_exception_handler(StoreError, _unavailable)
    app.add_exception_handler(TimeoutError, _unavailable)
    app.add_exception_handler(Exception, _unforeseen)


def describe_problems(schema: dict[str, Any]) -> None:
    """Declare in the API's description the media type of problems."""
    for operations in schema["paths"].values():
        for operation in operations.values():
            for code, response in operation["responses"].items():
                content = response.get("content", {})
                if int(code) >= 400 and "application/json" in content:
                    content[MEDIA_TYPE] = content.pop("application/json")


async def _http(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    detail = error.detail
    if error.status_code == 404 and detail == http.HTTPStatus.NOT_FOUND.phrase:
        detail = "there is nothing at this address: /openapi.json lists what there is"
    elif error.status_code == 405:
        detail = f"{request.method} is not possible here"
    headers = _with_all_methods(request, error.headers)
    return problem_response(error.status_code, detail, request.url.path, headers=headers)


def _with_all_methods(request: Request, headers: Mapping[str, str] | None) -> Mapping[str, str] | None:
    """Every method of this address; each is a route of its own that knows only itself.

    HEAD is allowed wherever GET is (headers.HeadAsGet), which the routes do not know.
    """
    if headers is None or "Allow" not in headers:
        return headers
    described = request.app.openapi()["paths"].get(request.url.path, {})
    allowed = dict.fromkeys([*headers["Allow"].split(", "), *(method.upper() for method in described)])
    if "GET" in allowed:
        allowed["HEAD"] = None
    return {**headers, "Allow": ", ".join(allowed)}


async def _invalid(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    said: dict[str, str] = {}
    for fault in error.errors():  # all parameters are flat; deeper places are pydantic's own branches
        what = _PLAINER.get(fault["type"], fault["msg"].removeprefix("Value error, "))
        said.setdefault(".".join(map(str, fault["loc"][:2])), what)
    detail = "; ".join(f"{where}: {what}" for where, what in said.items())
    faults = [Fault(where=where, what=what) for where, what in said.items()]
    return problem_response(422, detail, request.url.path, faults)


_CODES: Final = {
    "not_stored": 503,
    "not_allowed": 403,
    "no_such_line": 404,
    "no_such_weight": 404,
}  # of reasons; else 409


async def _refused(request: Request, refusal: Exception) -> Response:
    assert isinstance(refusal, RefusedError)
    code = _CODES.get(refusal.reason, 409)
    return problem_response(code, str(refusal), request.url.path, reason=refusal.reason)


async def _unavailable(request: Request, error: Exception) -> Response:
    return problem_response(503, str(error), request.url.path)


async def _unforeseen(request: Request, _error: Exception) -> Response:
    return problem_response(500, "the service met an error it did not expect; its log has it", request.url.path)
