"""Stand-ins for backends of the service that are absent, as in tests and benchmarks of the web alone."""

from typing import Any, Final

from gateway.errors import AlarmRefusedError, CommissioningRefusedError, WeightRefusedError
from gateway.records import json_line

_NOT_CALIBRATED: Final = WeightRefusedError(
    "no_calibration", "no calibration is loaded, so there is nothing to correct"
)
_NO_SUCH_WEIGHT: Final = WeightRefusedError("no_such_weight", "there is no such known weight in use")
_NOT_HERE: Final = CommissioningRefusedError("not_allowed", "there is no service behind this page that could calibrate")


class _Absent:
    """Answers each method as its table says: an exception is raised; a method that is not in the table is refused."""

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
