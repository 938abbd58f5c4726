"""The power goes between any two changes of the disk."""

import os
from collections.abc import Callable
from typing import Any

import pytest


class KilledError(BaseException):
    """The power is gone: nothing after it is done, and nobody may catch it."""


def kill_at(monkeypatch: pytest.MonkeyPatch, n: int) -> None:
    """Let n changes of the disk happen and no more."""
    left = [n]

    def until_killed(does: Callable[..., Any]) -> Callable[..., Any]:
        def change(*arguments: Any, **more: Any) -> Any:
            left[0] -= 1
            if left[0] < 0:
                raise KilledError
            return does(*arguments, **more)

        return change

    for name in ("open", "fsync", "rename", "unlink"):
        monkeypatch.setattr(os, name, until_killed(getattr(os, name)))
