"""What stands in for a part of the service where there is none: a page without a service, a test."""

from collections.abc import Callable
from typing import Any


class _Absent:
    def __init__(self, refusal: Exception | None, answers: dict[str, Any]) -> None:
        self._refusal = refusal
        self._answers = answers

    def __getattr__(self, name: str) -> Callable[..., Any]:
        def asked(*_: Any, **__: Any) -> Any:
            if name not in self._answers and self._refusal is not None:
                raise self._refusal
            return self._answers[name]

        return asked


def absent(refusal: Exception | None = None, **answers: Any) -> Any:
    """A desk whose methods answer as named here; all others refuse."""
    return _Absent(refusal, answers)
