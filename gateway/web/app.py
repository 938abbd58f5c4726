"""The web application: one function that puts the parts together."""

from collections import Counter
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any, Final

from fastapi import FastAPI
from starlette.types import ASGIApp

from gateway.core.calibrated import CalibratedVehicle
from gateway.status import Status
from gateway.store import StoreReader
from gateway.web import pages
from gateway.web.access import problems
from gateway.web.access.guard import Guard, WrongTokens, describe_guard
from gateway.web.access.middleware import HeadAsGet, SecurityHeaders
from gateway.web.access.tokens import TokenFile
from gateway.web.live.board import Board, LatestShortcut
from gateway.web.routes import service_calls as service
from gateway.web.routes.alarms import alarms_router
from gateway.web.routes.cab import cab_router
from gateway.web.routes.commissioning import commissioning_router
from gateway.web.routes.history import api_router, events_router, export_router
from gateway.web.routes.known_weights import known_weights_router
from gateway.web.routes.monitoring import health_router, metrics_registry
from gateway.web.routes.reasons import reasons_router
from gateway.web.routes.spectra import spectra_router
from gateway.web.routes.vehicle import vehicle_router
from gateway.web.routes.verification import trend_router, verification_router
from gateway.web.routes.weights import (
    KNOWN_LOADS_PATH,
    KnownLoads,
    Scales,
    known_loads_router,
    standards_router,
    weights_router,
)

API_VERSION: Final = "1.0.0"
BODY_BYTES: Final = 32_768  # chosen: no route but an upload needs a tenth of it
_DESCRIPTION: Final = """Payload and front axle share of a vehicle, weighed while it drives.

Names end in the unit. Unknown is null. Errors are problem details (RFC 9457)."""


@dataclass(frozen=True, slots=True)
class WebSettings:
    """Limits of the application.

    After ``n_wrong_tokens_per_min`` wrong tokens from one address, further ones are answered with 429.
    """

    n_wrong_tokens_per_min: int = 10


def create_app(
    board: Board,
    reader: StoreReader,
    status: Callable[[], Status],
    settings: WebSettings | None = None,
    calibrated: CalibratedVehicle | None = None,
    tokens: TokenFile | None = None,
    known_weights: service.KnownWeightBackend | None = None,
    commissioning: service.CommissioningBackend | None = None,
    known_loads: KnownLoads | None = None,
    verification: service.VerificationBackend | None = None,
    trend: service.TrendBackend | None = None,
    alarms: Callable[[], str] | None = None,
) -> FastAPI:
    """The application over the pipeline's publications (``board``), the store (``reader``) and the service's state
    (``status``, called in the event loop: quick and thread-safe). ``known_loads`` are shown beside the estimates if
    there are any.

    There are no routes to a part of the service that is None, but those of the ring log: it may be switched off. Call
    ``board.close()`` before the server stops: it ends the streams.
    """
    chosen = settings or WebSettings()
    responses: Counter[int] = Counter()

    @asynccontextmanager
    async def lifespan(_app: FastAPI) -> AsyncIterator[None]:
        yield
        board.close()

    failures = WrongTokens(chosen.n_wrong_tokens_per_min)
    app = _Application(
        wrap=lambda inner: SecurityHeaders(HeadAsGet(Guard(LatestShortcut(inner, board), tokens, failures)), responses),
        title="Springscale",
        version=API_VERSION,
        description=_DESCRIPTION,
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
        max_body_size=BODY_BYTES,
    )
    problems.install(app)
    scales = Scales(calibrated)
    metrics = metrics_registry(board, scales, status, responses)
    routers = [
        api_router(board, reader, status),
        reasons_router(),
        vehicle_router(status, calibrated),
        spectra_router(board, calibrated),
        *([known_weights_router(known_weights)] if known_weights else ()),
        *([verification_router(verification)] if verification else ()),
        *([trend_router(trend)] if trend else ()),
        *([commissioning_router(commissioning)] if commissioning else ()),
        export_router(reader),
        events_router(reader),
        *([alarms_router(reader, alarms)] if alarms else ()),
        weights_router(board, scales),
        cab_router(board, reader, status, scales),
        standards_router(board, scales),
        health_router(status, metrics),
        *([known_loads_router(known_loads)] if known_loads else ()),
    ]
    for router in routers:
        app.include_router(router)
    pages.install(app, KNOWN_LOADS_PATH if known_loads else "")
    _describe(app, tokens)
    return app


class _Application(FastAPI):
    """FastAPI inside our own layers, so that they see every answer, also that of an unforeseen error."""

    def __init__(self, *, wrap: Callable[[ASGIApp], ASGIApp], **settings: Any) -> None:
        self._wrap = wrap
        super().__init__(**settings)

    def build_middleware_stack(self) -> ASGIApp:
        return self._wrap(super().build_middleware_stack())


def _summarize(schema: dict[str, Any]) -> None:
    """Each operation's summary is the first line of its description, not the name of a function."""
    for path in schema["paths"].values():
        for operation in path.values():
            summary, _, rest = operation.pop("description", "").partition("\n")
            operation["summary"] = summary.rstrip(".") or operation.get("summary", "")
            if rest.strip():
                operation["description"] = rest.strip()


def _describe(app: FastAPI, tokens: TokenFile | None) -> None:
    """Declare in the description that problems are application/problem+json, and when tokens are needed."""
    describe = app.openapi
    told: dict[bool, dict[str, Any]] = {}

    def openapi() -> dict[str, Any]:
        is_guarded = tokens is not None and tokens.are_required()
        if is_guarded not in told:
            app.openapi_schema = None
            schema = told[is_guarded] = describe()
            problems.describe_problems(schema)
            _summarize(schema)
            if is_guarded:
                describe_guard(schema)
        return told[is_guarded]

    app.openapi = openapi  # type: ignore[method-assign]  # FastAPI's documented way to extend the description
