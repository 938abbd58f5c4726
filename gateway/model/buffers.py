"""Memory that is used again: a search computes the same large arrays hundreds of times.

An allocator hands such arrays back to the system when they are freed, and asks for them again; filling the new pages
then takes longer than the arithmetic.
"""

import threading
from math import prod

import numpy as np

from gateway.records import C128, F64


class _Buffers(threading.local):
    """One thread's arrays by name, each as large as it ever had to be."""

    def __init__(self) -> None:
        self.flat: dict[str, F64] = {}


_BUFFERS = _Buffers()


def buffer(name: str, shape: tuple[int, ...]) -> F64:
    """An array of this shape with any content. It is the caller's until somebody asks for the same name again."""
    size = prod(shape)
    flat = _BUFFERS.flat.get(name)
    if flat is None or flat.size < size:
        flat = _BUFFERS.flat[name] = np.empty(size)
    return flat[:size].reshape(shape)


def complex_buffer(name: str, shape: tuple[int, ...]) -> C128:
    """A buffer of complex numbers."""
    return buffer(name, (*shape[:-1], 2 * shape[-1])).view(complex)
