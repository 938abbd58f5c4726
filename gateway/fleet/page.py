"""The page of the fleet, /fleet, and what it asks: /api/v1/fleet."""

import threading
from collections import Counter
from collections.abc import Callable

import uvicorn
from fastapi import FastAPI
from pydantic import BaseModel
from starlette.responses import FileResponse, RedirectResponse, Response
from starlette.staticfiles import StaticFiles

from gateway.fleet.lines import Line
from gateway.web.door import SecurityHeaders
from gateway.web.pages import ASSETS


class Fleet(BaseModel):
    """Every vehicle that was ever heard, by name."""

    items: list[Line]


def fleet_app(lines: Callable[[], list[Line]]) -> FastAPI:
    """The application; ``lines`` are asked for in a worker thread. Raises what they raise, as status 500."""
    app = FastAPI(title="Springscale fleet", docs_url=None, redoc_url=None)
    app.add_middleware(SecurityHeaders, counts=Counter())

    @app.get("/api/v1/fleet")
    def fleet() -> Fleet:
        """The fleet now, a line per vehicle."""
        return Fleet(items=lines())

    @app.get("/fleet", include_in_schema=False)
    async def page() -> Response:
        return FileResponse(ASSETS / "fleet.html", headers={"cache-control": "no-cache"})

    @app.get("/", include_in_schema=False)
    async def root() -> Response:
        return RedirectResponse("/fleet")

    app.mount("/assets", StaticFiles(directory=ASSETS), name="assets")
    return app


class FleetPage:
    """Serves the application from a thread of its own, so that whoever writes the book is not held up."""

    def __init__(self, app: FastAPI, host: str, port: int) -> None:
        config = uvicorn.Config(
            app, log_config=None, access_log=False, server_header=False, timeout_graceful_shutdown=1
        )
        self._server = uvicorn.Server(config)
        config.host, config.port = host, port
        self._socket = config.bind_socket()  # here, so that a port in use is told at once
        self._thread = threading.Thread(
            target=self._server.run, kwargs={"sockets": [self._socket]}, name="fleet-page", daemon=True
        )

    @property
    def port(self) -> int:
        """Where it listens; of use where the system chose one."""
        return int(self._socket.getsockname()[1])

    def start(self) -> None:
        """Begin to answer."""
        self._thread.start()

    def stop(self) -> None:
        """End; answers under way have a second."""
        self._server.should_exit = True
        self._thread.join(5.0)
