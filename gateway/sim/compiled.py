"""The only entry to numba: compiles functions to machine code, cached on disk."""

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

from numba import njit

P = ParamSpec("P")
R = TypeVar("R")


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile ``function`` on its first call, release the GIL in it, keep the machine code on disk.

    If no cache directory is writable, each process compiles again.
    """
    try:
        return cast(Callable[P, R], njit(cache=True, nogil=True, error_model="numpy")(function))
    except RuntimeError:  # numba: "no locator available", nowhere to write the cache
        return cast(Callable[P, R], njit(nogil=True, error_model="numpy")(function))
