"""For monitoring: health and metrics."""

from collections.abc import Callable

from fastapi import APIRouter, Request
from prometheus_client import CONTENT_TYPE_LATEST, CollectorRegistry, generate_latest
from starlette.responses import JSONResponse, Response

from gateway.status import Status
from gateway.web.access.problems import problem_response
from gateway.web.schemas import Alive, Ready, problem_responses


def health_router(status: Callable[[], Status], registry: CollectorRegistry) -> APIRouter:
    """/health/live, /health/ready, /metrics."""
    router = APIRouter(tags=["health"])

    @router.get("/health/live", response_model=Alive)
    async def live() -> Response:
        """200 as long as the process answers."""
        return JSONResponse(Alive().model_dump())

    @router.get("/health/ready", response_model=Ready, responses=problem_responses(503))
    async def ready(request: Request) -> Response:
        """200 while estimates are possible; else 503 with the reason."""
        now = status()
        if not now.is_ready:
            return problem_response(503, now.not_ready_reason or now.sentence(), request.url.path)
        return JSONResponse(Ready(state=now.state, warnings=list(now.warnings)).model_dump())

    @router.get(
        "/metrics",
        response_class=Response,
        responses={200: {"content": {"text/plain": {"schema": {"type": "string"}}}}},
    )
    async def metrics() -> Response:
        """Prometheus metrics, names springscale_*."""
        return Response(generate_latest(registry), media_type=CONTENT_TYPE_LATEST)

    return router
