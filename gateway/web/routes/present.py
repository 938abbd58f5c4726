"""The present: the latest estimate, the status, and the stream of what comes."""

from collections.abc import AsyncIterator, Callable
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Header, HTTPException, Request
from fastapi.sse import EventSourceResponse, ServerSentEvent
from pydantic.json_schema import SkipJsonSchema
from starlette.responses import Response

from gateway.status import Status
from gateway.store import StoreReader
from gateway.web.live.board import Board, LatestResponse
from gateway.web.live.stream import EVENT_SCHEMA, TooManyStreamsError
from gateway.web.routes.history import Cursor
from gateway.web.routes.service_calls import AsShown
from gateway.web.schemas import Latest, problem_responses


def present_router(board: Board, reader: StoreReader, status: Callable[[], Status]) -> APIRouter:
    router = APIRouter(prefix="/api/v1", tags=["api"])

    @router.get(
        "/estimates/latest", response_model=Latest, responses={304: {"description": "nothing but the age has changed"}}
    )
    async def latest(request: Request, shown: AsShown) -> Response:
        """The last good estimate and its age. Its ETag changes with all but the age."""
        return LatestResponse(board, request.scope, shown)

    @router.get("/status", response_model=Status)
    async def status_now() -> Status:
        """The state of the service, as a sentence and as numbers."""
        return status()

    async def joined(
        shown: AsShown, last_event_id: Annotated[Cursor | SkipJsonSchema[None], Header()] = None
    ) -> AsyncIterator[Any]:
        try:
            with board.fanout.joined(reader, last_event_id, shown) as subscription:
                yield subscription
        except TooManyStreamsError as refusal:
            raise HTTPException(503, str(refusal)) from None

    @router.get(
        "/stream",
        response_class=EventSourceResponse,
        responses={
            200: {"content": {EventSourceResponse.media_type: {"itemSchema": EVENT_SCHEMA}}},
            **problem_responses(422, 503),
        },
    )
    async def stream(subscription: Annotated[Any, Depends(joined)]) -> AsyncIterator[ServerSentEvent]:
        """Server-sent events: estimate, rejection, provisional; data is the estimate object.

        With Last-Event-ID, missed events come first. 503: too many streams are open.
        """
        async for event in subscription.events():
            yield event

    return router
