"""One typed door to numba: what passes through it runs as machine code and is cached on disk."""

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

from numba import njit

P = ParamSpec("P")
R = TypeVar("R")


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile ``function`` on its first call, release the GIL in it, keep the machine code on disk.

    Where no directory for the cache can be written, the code is compiled anew in each process.
    """
    try:
        return cast(Callable[P, R], njit(cache=True, nogil=True, error_model="numpy")(function))
    except RuntimeError:  # numba: "no locator available", nowhere to write the cache
        return cast(Callable[P, R], njit(nogil=True, error_model="numpy")(function))
