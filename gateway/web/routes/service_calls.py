"""The service behind the routes: what they ask of it, and how they call it.

All calls may block and are made in threads. Those that answer with a text give JSON as the route describes it. Methods
that change something raise RefusedError, which becomes problem details.
"""

import asyncio
from collections.abc import Callable, Sequence
from datetime import tzinfo
from typing import Annotated, Final, ParamSpec, Protocol

from fastapi import Depends, Request
from starlette.responses import Response

from gateway.stated.facts import VehicleAnswers
from gateway.stated.learning import SisterTold, StatedVehicle
from gateway.stated.statement import StatementRecord
from gateway.web.schemas import problem_responses


class LoadsBackend(Protocol):
    """Statements of loads."""

    def state(self, record: StatementRecord, by: str) -> str: ...
    def import_all(
        self, content: bytes, by: str, *, where: str, zone: tzinfo | None = None, is_dry_run: bool = False
    ) -> str: ...
    def page(
        self, *, since_ns: int | None = None, state: str | None = None, limit: int = 500, cursor: str | None = None
    ) -> str: ...
    def withdraw(self, statement_id: str, by: str) -> str: ...
    def confirm(self, statement_id: str, by: str) -> str: ...


class VanBackend(Protocol):
    """The vehicle; ``told`` is what somebody stated, None if nobody has."""

    def told(self) -> StatedVehicle | None: ...
    def state(self, answers: VehicleAnswers, by: str, *, is_confirmed: bool) -> None: ...
    def sister(self) -> SisterTold | None: ...
    def state_sister(self, content: bytes, by: str) -> None: ...
    def forget_sister(self, by: str) -> None: ...


class LearntBackend(Protocol):
    """What is learnt so far."""

    def state(self) -> str: ...
    def use(self, version: str, by: str) -> str: ...
    def not_empty(self, begins_ns: Sequence[int], by: str) -> str: ...


class LearnerBackend(Protocol):
    """What teaches the vehicle, and what it has learnt."""

    @property
    def loads(self) -> LoadsBackend: ...
    @property
    def van(self) -> VanBackend: ...
    @property
    def learnt(self) -> LearntBackend: ...


LOCAL: Final = "local"  # name of the client if no tokens are in use
REFUSALS: Final = problem_responses(409, 503)
P = ParamSpec("P")


async def answered(ask: Callable[P, str], *args: P.args, **named: P.kwargs) -> Response:
    """The JSON that ``ask`` gives for these arguments."""
    return Response(await asyncio.to_thread(ask, *args, **named), media_type="application/json")


async def created(ask: Callable[P, str], *args: P.args, **named: P.kwargs) -> Response:
    """The answer with the status of something new."""
    return Response(await asyncio.to_thread(ask, *args, **named), 201, media_type="application/json")


async def _token_name(request: Request) -> str:
    name: str = getattr(request.state, "token_name", LOCAL)
    return name


By = Annotated[str, Depends(_token_name)]
"""Name of the client's token."""


Shown = Callable[[str], str]


async def _shown_to(request: Request) -> Shown:
    shown: Shown = request.state.client.shown
    return shown


AsShown = Annotated[Shown, Depends(_shown_to)]
"""Turns the JSON of a record into what this client may see of it; raises PermissionError once it may see none."""
