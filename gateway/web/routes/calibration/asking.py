"""Calls to parts of the service: in a thread of its own, refusals as problems."""

import asyncio
from collections.abc import Callable
from typing import Any, Final

from fastapi import Request
from starlette.responses import Response

from gateway.errors import AlarmRefusedError, CommissioningRefusedError, WeightRefusedError
from gateway.web.door.problems import problem_response
from gateway.web.schemas import problem_responses

LOCAL: Final = "local"  # who asks where no tokens are in use
REFUSALS: Final = problem_responses(409, 503)
_CODES: Final = {
    "not_stored": 503,
    "not_allowed": 403,
    "no_such_line": 404,
    "no_such_alarm": 404,
    "no_such_weight": 404,
}  # of reasons; else 409


async def answered(request: Request, ask: Callable[[], str], status: int = 200) -> Response:
    """The answer of ``ask``, or the problem with which it refuses."""
    try:
        return json_response(await asyncio.to_thread(ask), status)
    except (AlarmRefusedError, CommissioningRefusedError, WeightRefusedError) as refusal:
        code = _CODES.get(refusal.reason, 409)
        return problem_response(code, str(refusal), request.url.path, reason=refusal.reason)


def who(request: Request) -> str:
    """Name of the token that was shown."""
    name: Any = getattr(request.state, "token_name", None)
    return LOCAL if name is None else str(name)


def json_response(text: str, status: int = 200) -> Response:
    """JSON that is ready to be sent."""
    return Response(text, status, media_type="application/json")
