"""Compiled functions work where nothing can be written beside them."""

from collections.abc import Callable

import pytest

from gateway.sim import compiled


def test_where_no_cache_can_be_written_it_compiles_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def njit_in_a_read_only_place(**options: object) -> Callable[[Callable[..., int]], Callable[..., int]]:
        asked.append(options.get("cache", False))
        if options.get("cache"):
            raise RuntimeError("cannot cache function: no locator available")
        return lambda function: function

    monkeypatch.setattr(compiled, "njit", njit_in_a_read_only_place)
    assert compiled.compiled(lambda x: x + 1)(2) == 3
    assert asked == [True, False]


def test_compiled_code_gives_what_python_gives() -> None:
    def alternating(n: int) -> float:
        total = 0.0
        for k in range(n):
            total += (-1.0) ** k / (2 * k + 1)
        return total

    assert compiled.compiled(alternating)(1000) == pytest.approx(alternating(1000), rel=1e-12)
