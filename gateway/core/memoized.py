"""Caches the last results of pure functions of arrays: a search repeats many calls with the same arguments."""

from collections.abc import Callable
from functools import lru_cache, wraps
from typing import Final

import numpy as np

from gateway.records import F64

MOST_KEPT: Final = 32  # chosen: results of one function


def memoized(function: Callable[..., F64]) -> Callable[..., F64]:
    """``function`` of positional float64 arrays with its last results cached by the arguments' content; results are
    read-only.
    """

    @lru_cache(maxsize=MOST_KEPT)
    def found(*arguments: tuple[bytes, tuple[int, ...]]) -> F64:
        result = function(*(np.frombuffer(content).reshape(shape) for content, shape in arguments))
        result.setflags(write=False)
        return result

    @wraps(function)
    def asked(*arrays: F64) -> F64:
        return found(*((array.tobytes(), array.shape) for array in arrays))

    return asked
