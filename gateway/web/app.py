"""The web application: one function that puts the parts together."""

from collections import Counter
from collections.abc import Awaitable, Callable
from typing import Any, Final

from fastapi import Depends, FastAPI
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route
from starlette.types import ASGIApp

from gateway.status import Status
from gateway.store import StoreReader
from gateway.web import pages
from gateway.web.access import problems
from gateway.web.access.guard import Access, bearer
from gateway.web.access.middleware import BodyLimit, HeadAsGet, SecurityHeaders
from gateway.web.access.tokens import TokenFile
from gateway.web.live.board import LATEST_PATH, Board, LatestResponse
from gateway.web.routes import service_calls as service
from gateway.web.routes.cab import cab_router
from gateway.web.routes.events_trips_alarms import alarms_router, events_router
from gateway.web.routes.explanations import reasons_router
from gateway.web.routes.history import estimates_router
from gateway.web.routes.monitoring import alive_router, health_router, metrics_registry
from gateway.web.routes.present import present_router
from gateway.web.routes.present_load import Scales
from gateway.web.routes.stated_loads import statements_router
from gateway.web.routes.vehicle_in_use import vehicle_router
from gateway.web.routes.weights import (
    KNOWN_LOADS_PATH,
    KnownLoads,
    known_loads_router,
    standards_router,
    weights_router,
)
from gateway.web.schemas import problem_responses
from gateway.weighing.calibrated import CalibratedVehicle

API_VERSION: Final = "1.0.0"
BODY_BYTES: Final = 2_000_000  # chosen: a table of statements, twenty thousand rows; all other bodies are small
_DESCRIPTION: Final = """Payload and front axle share of a vehicle, weighed while it drives.

Names end in the unit. Unknown is null. Errors are problem details (RFC 9457)."""


def create_app(
    board: Board,
    reader: StoreReader,
    status: Callable[[], Status],
    calibrated: CalibratedVehicle | None = None,
    tokens: TokenFile | None = None,
    known_loads: KnownLoads | None = None,
    alarms: Callable[[], str] | None = None,
    learner: service.LearnerBackend | None = None,
    *,
    are_places_read: bool = False,
) -> FastAPI:
    """The application over the pipeline's publications (``board``), the store (``reader``) and the service's state
    (``status``, called in the event loop: quick and thread-safe). ``known_loads`` are shown beside the estimates if
    there are any.

    There are no routes to a part of the service that is None. ``are_places_read``: read tokens get positions.
    Call ``board.close()`` before the server stops: it ends the streams.
    """
    responses: Counter[int] = Counter()

    app = _Application(
        wrap=lambda inner: SecurityHeaders(HeadAsGet(BodyLimit(inner, BODY_BYTES)), responses),
        title="Springscale",
        version=API_VERSION,
        description=_DESCRIPTION,
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
    )
    scales = Scales(calibrated)
    metrics = metrics_registry(board, scales, status, responses)
    routers = [
        present_router(board, reader, status),
        estimates_router(reader),
        reasons_router(),
        vehicle_router(status, calibrated, learner),
        *([statements_router(learner)] if learner else ()),
        events_router(reader),
        *([alarms_router(reader, alarms)] if alarms else ()),
        weights_router(board, scales, status),
        cab_router(board, reader, status, scales),
        standards_router(board, scales),
        health_router(status, metrics),
        *([known_loads_router(known_loads)] if known_loads else ()),
    ]
    access = Access(tokens, are_places_read=are_places_read)
    app.router.routes.insert(0, Route(LATEST_PATH, _latest(board, access)))
    app.include_router(alive_router())
    for router in routers:
        app.include_router(router, dependencies=[Depends(access)], responses=problem_responses(401, 403, 421))
    pages.install(app, KNOWN_LOADS_PATH if known_loads else "")
    problems.install(app, [route for router in routers for route in router.routes if isinstance(route, Route)])
    return app


class _Application(FastAPI):
    """FastAPI inside our own layers, so that they see every answer, also that of an unforeseen error."""

    def __init__(self, *, wrap: Callable[[ASGIApp], ASGIApp], **settings: Any) -> None:
        self._wrap = wrap
        super().__init__(**settings)

    def build_middleware_stack(self) -> ASGIApp:
        return self._wrap(super().build_middleware_stack())


def _latest(board: Board, access: Access) -> Callable[[Request], Awaitable[Response]]:
    """GET latest without FastAPI's layers, which take longer than the answer; the route of the same path stays declared
    for the API's description and gives the same answer.
    """

    async def latest(request: Request) -> Response:
        await access(request, await bearer(request))
        return LatestResponse(board, request.scope, request.state.client.shown)

    return latest
