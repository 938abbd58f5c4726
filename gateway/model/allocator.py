"""Keeps freed memory in the process for reuse.

glibc returns freed memory above a small threshold to the system, so every new array pays for fresh pages. An estimator
that creates and drops arrays of a megabyte a thousand times a second spends a third of its time on that. The thresholds
are glibc's (mallopt(3)); other C libraries have none and need none.
"""

import ctypes
from typing import Final

M_TRIM_THRESHOLD: Final = -1  # malloc.h, as the next
M_MMAP_THRESHOLD: Final = -3
KEPT_BYTES: Final = 32 << 20  # kept at the top of the heap: about the arrays of one batch; chosen
MAPPED_BYTES: Final = 16 << 20  # an array of at least this size is mapped, and unmapped when it is freed


def keep_freed_memory() -> None:
    """Set the thresholds for this process."""
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(M_TRIM_THRESHOLD, KEPT_BYTES)
        mallopt(M_MMAP_THRESHOLD, MAPPED_BYTES)
