"""The service behind the routes: what they ask of it, how they call it, and what answers where it is absent.

All calls may block and are made in threads. Those that answer with a text give JSON as the route describes it. Methods
that change something raise a refusal (gateway.errors), which becomes problem details.
"""

import asyncio
from collections.abc import Callable, Mapping, Sequence
from typing import Any, BinaryIO, Final, Literal, Protocol

from fastapi import Request
from starlette.responses import Response

from gateway.core.known_weights import KnownWeightKind
from gateway.errors import AlarmRefusedError, CommissioningRefusedError, WeightRefusedError
from gateway.records import json_line
from gateway.stated.facts import StatedWeight, VehicleAnswers
from gateway.web.access.problems import problem_response
from gateway.web.schemas import problem_responses

Source = Literal["package", "administrator", "uploaded"]


class AlarmBackend(Protocol):
    """The alarms: ``standing`` is an array of Alarm, the worst first; ``acknowledge`` gives the Alarm after it."""

    def standing(self) -> str: ...
    def acknowledge(self, alarm_id: str, by: str, note: str | None) -> str: ...


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


class TrendBackend(Protocol):
    """The trend of the vehicle's parameters."""

    def state(self) -> str: ...


class CommissioningBackend(Protocol):
    """The commissioning: every step gives the CommissioningState after it, ``lines`` and ``upload`` the LinesFound."""

    def state(self) -> str: ...
    def lines(self) -> str: ...
    def begin(self, by: str, note: str | None) -> str: ...
    def upload(self, name: str, content: str, signature: str | None) -> str: ...
    def choose_line(self, name: str | None, source: Source | None) -> str: ...
    def state_vehicle(self, answers: VehicleAnswers) -> str: ...
    def confirm(self, by: str) -> str: ...
    def is_empty(self, by: str, *, again: bool = False) -> str: ...
    def fit_now(self, by: str) -> str: ...
    def cancel(self, by: str) -> str: ...
    def undo(self, by: str, *, to_factory: bool) -> str: ...


class KeptSegment(Protocol):
    """A file of the ring log, as far as it can be fetched."""

    @property
    def name(self) -> str: ...
    @property
    def n_bytes(self) -> int: ...
    @property
    def n_frames(self) -> int: ...
    @property
    def first_ns(self) -> int: ...
    @property
    def last_ns(self) -> int: ...


class FrameLog(Protocol):
    """The ring log, oldest segment first. ``open`` gives a segment and the number of its bytes, None for an unknown
    name, and raises OSError if the disk fails.
    """

    def segments(self) -> Sequence[KeptSegment]: ...
    def open(self, name: str) -> tuple[BinaryIO, int] | None: ...


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


_NOT_CALIBRATED: Final = WeightRefusedError(
    "no_calibration", "no calibration is loaded, so there is nothing to correct"
)
_NO_SUCH_WEIGHT: Final = WeightRefusedError("no_such_weight", "there is no such known weight in use")
_NOT_HERE: Final = CommissioningRefusedError("not_allowed", "there is no service behind this page that could calibrate")


class _Absent:
    """A backend that is absent, as in tests of the web alone: it gives or raises what its table says of the method.

    A method that is not in the table is refused.
    """

    def __init__(self, refusal: Exception, **answers: Any) -> None:
        self._refusal = refusal
        self._answers = answers

    def __getattr__(self, name: str) -> Any:
        answer = self._answers.get(name, self._refusal)

        def asked(*_: Any, **__: Any) -> Any:
            if isinstance(answer, Exception):
                raise answer
            return answer

        return asked


_OFFER: Final = {"is_possible": False, "reason": _NOT_CALIBRATED.reason, "detail": str(_NOT_CALIBRATED), "load": None}
_DUE: Final = {"n_records": 0, "last_at": None, "last_verdict": None, "due_at": None, "is_due": False}

NO_KNOWN_WEIGHTS: Final[Any] = _Absent(
    _NO_SUCH_WEIGHT,
    add=_NOT_CALIBRATED,
    state=json_line(
        {
            **dict.fromkeys(("known_weights_id", "mean_error_kg", "error_std_kg", "fault")),
            "n_teaching": 0,
            "offer": _OFFER,
            "history": [],
        }
    ),
)
NO_VERIFICATION: Final[Any] = _Absent(
    WeightRefusedError("no_calibration", "there is no calibration, and so nothing to verify"),
    record=None,
    state=json_line(
        {
            "rule": {"permitted_error_pct": 5.0, "permitted_axle_error_pct": None, "loads": 1},
            "due": _DUE,
            "warning": None,
            "history": [],
        }
    ),
)
NO_TREND: Final[Any] = _Absent(_NOT_CALIBRATED, state=json_line({"calibration_id": None, "parameters": []}))
NO_ALARMS: Final[Any] = _Absent(
    AlarmRefusedError("no_such_alarm", "it is not an alarm that can be acknowledged"), standing="[]"
)
NO_RECORD: Final[Any] = _Absent(_NOT_HERE, segments=(), open=None)
NO_COMMISSIONING: Final[Any] = _Absent(
    _NOT_HERE,
    lines=json_line({"items": []}),
    state=json_line(
        {
            "is_allowed": False,
            "why_not": str(_NOT_HERE),
            "is_offered": False,
            "is_pending": False,
            "underway": None,
            "active": None,
            "history": [],
        }
    ),
)
