"""The service behind the routes: what they ask of it, and how they call it.

All calls may block and are made in threads. Those that answer with a text give JSON as the route describes it. Methods
that change something raise RefusedError, which becomes problem details.
"""

import asyncio
from collections.abc import Callable, Mapping, Sequence
from datetime import tzinfo
from typing import Annotated, Any, Final, ParamSpec, Protocol

from fastapi import Depends, Request
from starlette.responses import Response

from gateway.core.known_weights import KnownWeightKind
from gateway.stated.facts import StatedWeight, VehicleAnswers
from gateway.stated.learning import StatedVehicle
from gateway.stated.statement import StatementRecord
from gateway.web.schemas import problem_responses


class KnownWeightBackend(Protocol):
    """The known weights. ``add`` gives the new KnownWeightEntry, the others the KnownWeightState after it.

    Without a stated load ``add`` means that the vehicle is empty now.
    """

    def state(self, kinds: Sequence[KnownWeightKind] = ...) -> str: ...
    def add(self, kind: KnownWeightKind, by: str, note: str | None, stated: StatedWeight | None = None) -> str: ...
    def confirm(self, by: str, entry_id: str) -> str: ...
    def take_back(self, by: str, entry_id: str, kinds: Sequence[KnownWeightKind] = ...) -> str: ...
    def take_back_empty(self, by: str, *, to_factory: bool) -> str: ...


class VerificationBackend(Protocol):
    """The verifications; ``record`` is None for an unknown id."""

    def state(self) -> str: ...
    def record(self, record_id: str) -> Mapping[str, Any] | None: ...
    def verify(self, by: str, note: str | None, stated: Sequence[StatedWeight]) -> str: ...


class CommissioningBackend(Protocol):
    """The commissioning: every step gives the CommissioningState after it."""

    def state(self) -> str: ...
    def begin(self, by: str, note: str | None) -> str: ...
    def state_vehicle(self, answers: VehicleAnswers) -> str: ...
    def confirm(self, by: str) -> str: ...
    def is_empty(self, by: str, *, again: bool = False) -> str: ...
    def fit_now(self, by: str) -> str: ...
    def cancel(self, by: str) -> str: ...
    def undo(self, by: str, *, to_factory: bool) -> str: ...


class LearnerBackend(Protocol):
    """Statements and learning; ``vehicle`` is what somebody stated, None if nobody has."""

    def state(self, record: StatementRecord, by: str) -> str: ...
    def import_all(
        self, content: bytes, by: str, *, where: str, zone: tzinfo | None = None, is_dry_run: bool = False
    ) -> str: ...
    def statements(
        self, *, since_ns: int | None = None, state: str | None = None, limit: int = 500, cursor: str | None = None
    ) -> str: ...
    def withdraw(self, statement_id: str, by: str) -> str: ...
    def confirm(self, statement_id: str, by: str) -> str: ...
    def learning(self) -> str: ...
    def use(self, version: str, by: str) -> str: ...
    def vehicle(self) -> StatedVehicle | None: ...
    def state_vehicle(self, answers: VehicleAnswers, by: str, *, is_confirmed: bool) -> None: ...


LOCAL: Final = "local"  # name of the client if no tokens are in use
REFUSALS: Final = problem_responses(409, 503)
P = ParamSpec("P")


async def answered(ask: Callable[P, str], *args: P.args, **named: P.kwargs) -> Response:
    """The JSON that ``ask`` gives for these arguments."""
    return Response(await asyncio.to_thread(ask, *args, **named), media_type="application/json")


async def created(ask: Callable[P, str], *args: P.args, **named: P.kwargs) -> Response:
    """The same with the status of something new."""
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
