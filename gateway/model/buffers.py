"""Memory that is used again: a search computes the same large arrays hundreds of times.

An allocator hands such arrays back to the system when they are freed, and asks for them again; filling the new pages
then takes longer than the arithmetic.
"""

import threading
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gateway.records import C128, F32


class _Buffers(threading.local):
    """One thread's arrays by name, each as large as it ever had to be."""

    def __init__(self) -> None:
        self.flat: dict[str, NDArray[Any]] = {}


_BUFFERS = _Buffers()


def buffer(name: str, shape: tuple[int, ...]) -> F32:
    """An array of this shape with any content. It is the caller's until somebody asks for the same name again."""
    return _of(name, prod(shape), np.dtype(np.float32)).reshape(shape)


def complex_buffer(name: str, shape: tuple[int, ...]) -> C128:
    """A buffer of complex numbers."""
    return _of(name, prod(shape), np.dtype(complex)).reshape(shape)


def _of(name: str, size: int, dtype: np.dtype[Any]) -> NDArray[Any]:
    flat = _BUFFERS.flat.get(name)
    if flat is None or flat.size < size:
        flat = _BUFFERS.flat[name] = np.empty(size, dtype)
    return flat[:size]
