"""A memoized function returns what the function itself would return."""

import numpy as np
import pytest

from gateway.core.memoized import memoized
from gateway.records import F64


def test_it_is_worked_out_once_for_the_same_content_and_anew_for_another() -> None:
    asked: list[tuple[int, ...]] = []

    @memoized
    def doubled(x: F64) -> F64:
        asked.append(x.shape)
        return 2.0 * x

    x = np.arange(6.0)
    assert doubled(x).tolist() == doubled(x.copy()).tolist() == [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]
    assert doubled(x.reshape(2, 3)).shape == (2, 3)
    x[0] = 7.0
    assert doubled(x)[0] == 14.0
    assert asked == [(6,), (2, 3), (6,)]


def test_nobody_can_change_what_is_kept() -> None:
    @memoized
    def doubled(x: F64) -> F64:
        return 2.0 * x

    with pytest.raises(ValueError, match="read-only"):
        doubled(np.ones(2))[0] = 0.0
