"""Time limits of tests: a limit costs time only when a test fails, and machines are busy."""

import asyncio
import time
from collections.abc import Callable
from typing import Final

PATIENCE_S: Final = 120.0


def wait_until(holds: Callable[[], bool]) -> bool:
    """True as soon as ``holds`` is true, False when patience ends."""
    end_s = time.monotonic() + PATIENCE_S
    while not (is_true := holds()) and time.monotonic() < end_s:
        time.sleep(0.005)
    return is_true


async def until(holds: Callable[[], bool]) -> None:
    """Return as soon as ``holds`` is true, in an event loop; TimeoutError when patience ends."""
    async with asyncio.timeout(PATIENCE_S):
        while not holds():
            await asyncio.sleep(0.005)
