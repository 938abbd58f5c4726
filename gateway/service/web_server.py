"""The web server as a part of the service: signals are the gateway's, and it sleeps while nobody asks."""

import asyncio
import contextlib
from collections.abc import Iterator
from typing import Final

import uvicorn

TICK_S: Final = 1.0  # how often the Date of the answers is written anew


class WebServer(uvicorn.Server):
    """uvicorn without its own signal handling, which would raise the signal again after stopping."""

    def __init__(self, config: uvicorn.Config) -> None:
        super().__init__(config)
        self._ending = asyncio.Event()

    def end(self) -> None:
        """Begin to shut down; from the event loop's thread."""
        self.should_exit = True
        self._ending.set()

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Signals are the gateway's."""
        yield

    async def main_loop(self) -> None:
        """Until :meth:`end`. uvicorn's own looks ten times a second whether it is to end, parked vehicle or not."""
        while not await self.on_tick(0):  # 0: with what uvicorn does once a second
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._ending.wait(), TICK_S)
