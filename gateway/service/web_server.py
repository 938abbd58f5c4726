"""The web server as a part of the service: signals are the gateway's."""

import contextlib
from collections.abc import Iterator

import uvicorn


class WebServer(uvicorn.Server):
    """uvicorn without its own signal handling: it would raise the signal again after stopping."""

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Signals are the gateway's."""
        yield
