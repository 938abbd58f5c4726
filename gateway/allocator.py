"""Memory that arrays give back stays with the process, to be used again.

The C library returns freed memory above a small mark to the system, and every array that follows pays for fresh pages:
an estimator that makes and drops arrays of a megabyte a thousand times a second spends a third of its time on that. The
marks are glibc's (mallopt(3)); other C libraries have none and need none.
"""

import ctypes
from typing import Final

M_TRIM_THRESHOLD: Final = -1
M_MMAP_THRESHOLD: Final = -3
KEPT_BYTES: Final = 32 << 20  # freed at the top of the heap: some batch's arrays together; chosen
MAPPED_BYTES: Final = 16 << 20  # an array from this size on has pages of its own and gives them back


def keep_freed_memory() -> None:
    """For this process, from now on."""
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(M_TRIM_THRESHOLD, KEPT_BYTES)
        mallopt(M_MMAP_THRESHOLD, MAPPED_BYTES)
