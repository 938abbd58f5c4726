"""Blocking calls of routes to the service, in a thread; refusals become problem details."""

import asyncio
from collections.abc import Callable
from typing import Any, Final

from fastapi import Request
from starlette.responses import Response

from gateway.errors import AlarmRefusedError, CommissioningRefusedError, WeightRefusedError
from gateway.web.access.problems import problem_response
from gateway.web.schemas import problem_responses

LOCAL: Final = "local"  # name of the client if no tokens are in use
REFUSALS: Final = problem_responses(409, 503)
_CODES: Final = {
    "not_stored": 503,
    "not_allowed": 403,
    "no_such_line": 404,
    "no_such_alarm": 404,
    "no_such_weight": 404,
}  # of reasons; else 409


async def call_service(request: Request, ask: Callable[[], str], status: int = 200) -> Response:
    """The JSON returned by ``ask``, or problem details if it refuses."""
    try:
        return Response(await asyncio.to_thread(ask), status, media_type="application/json")
    except (AlarmRefusedError, CommissioningRefusedError, WeightRefusedError) as refusal:
        code = _CODES.get(refusal.reason, 409)
        return problem_response(code, str(refusal), request.url.path, reason=refusal.reason)


def token_name(request: Request) -> str:
    """Name of the client's token."""
    name: Any = getattr(request.state, "token_name", None)
    return LOCAL if name is None else str(name)
