"""For monitoring: health, and the status as Prometheus metrics.

Metrics follow from the status by one rule (``samples_of``), so that a new number there is a metric without more ado.
"""

import json
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from fastapi import APIRouter, Request
from prometheus_client import CONTENT_TYPE_LATEST, CollectorRegistry, ProcessCollector, generate_latest
from prometheus_client.core import Metric, UnknownMetricFamily
from starlette.responses import JSONResponse, Response

from gateway.estimates.field_kinds import WEIGHTS
from gateway.status import Status
from gateway.web.access.problems import problem_response
from gateway.web.live.board import Board
from gateway.web.routes.present_load import Scales
from gateway.web.schemas import Alive, Ready, problem_responses

_NAME: Final = re.compile(r"[\w.:/+-]{1,80}")


def alive_router() -> APIRouter:
    """/health/live, which tells nothing of the vehicle and needs no token."""
    router = APIRouter(tags=["health"])

    @router.get("/health/live", response_model=Alive)
    async def live() -> Response:
        """200 as long as the process answers."""
        return JSONResponse(Alive().model_dump())

    return router


def health_router(status: Callable[[], Status], registry: CollectorRegistry) -> APIRouter:
    """/health/ready, /metrics."""
    router = APIRouter(tags=["health"])

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
        """Prometheus metrics: springscale_ and the names on the way to a number of the status, joined by _."""
        return Response(generate_latest(registry), media_type=CONTENT_TYPE_LATEST)

    return router


def samples_of(name: str, told: object, labels: Mapping[str, str]) -> Iterator[tuple[str, Mapping[str, str], float]]:
    """Every sample (name, labels, number) below a place of a JSON object.

    Its name is the names on the way to it, joined by _. True is 1, and unknown is absent. A text gives 1: a name stands
    in the label ``is``, a sentence nowhere. The texts of an object in a list are labels of its numbers.

    >>> list(samples_of("a", {"b": 2, "state": "ok", "c": [{"of": "d", "n": 3}], "e": None}, {}))
    [('a_b', {}, 2.0), ('a_state', {'is': 'ok'}, 1.0), ('a_c_n', {'of': 'd'}, 3.0)]
    """
    if isinstance(told, Mapping):
        for key, below in told.items():
            yield from samples_of(f"{name}_{key}", below, labels)
    elif isinstance(told, list):
        for one in told:
            texts = (
                {key: below for key, below in one.items() if isinstance(below, str)} if isinstance(one, dict) else {}
            )
            below = {key: one[key] for key in one if key not in texts} if texts else one
            yield from samples_of(name, below, {**labels, **texts})
    elif isinstance(told, str):
        yield name, {**labels, "is": told} if _NAME.fullmatch(told) else labels, 1.0
    elif isinstance(told, int | float):
        yield name, labels, float(told)


@dataclass(frozen=True, slots=True, eq=False)
class StatusCollector:
    """Turns the present status into metrics at each request. The registry tells collectors apart by identity."""

    board: Board
    scales: Scales
    status: Callable[[], Status]
    responses: Mapping[int, int]

    def collect(self) -> Iterator[Metric]:
        families: dict[str, Metric] = {}
        for name, labels, reading in samples_of("springscale", self._told(), {}):
            family = families.setdefault(name, UnknownMetricFamily(name, "as /openapi.json describes it"))
            family.add_sample(name, dict(labels), reading)
        yield from families.values()

    def _told(self) -> dict[str, Any]:
        """The status but for its sentences, the numbers of the latest estimate, its weights, and the answers so far."""
        latest = json.loads(self.board.latest()[1])
        return {
            **self.status().model_dump(mode="json", exclude={"state_in_words", "warnings"}),
            "estimate": {name: figure for name, figure in latest.items() if isinstance(figure, int | float)},
            "weights": WEIGHTS.write(self.scales.weigh(self.board.shown().estimate)),
            "http_responses": self.responses,
            "stream_clients": self.board.fanout.n_subscribers,
        }


def metrics_registry(
    board: Board, scales: Scales, status: Callable[[], Status], responses: Counter[int]
) -> CollectorRegistry:
    """A registry of its own, so that two applications in one process do not interfere."""
    registry = CollectorRegistry(auto_describe=False)
    registry.register(StatusCollector(board, scales, status, responses))
    ProcessCollector(namespace="springscale", registry=registry)
    return registry
