"""The fleet's page, /fleet, and its API, /api/v1/fleet."""

import threading
from collections import Counter

import uvicorn
from fastapi import FastAPI
from pydantic import BaseModel, Field
from starlette.responses import FileResponse, RedirectResponse, Response
from starlette.staticfiles import StaticFiles

from gateway.fleet.book import Book
from gateway.fleet.lines import Line
from gateway.web.access.middleware import SecurityHeaders
from gateway.web.pages import ASSETS


class Fleet(BaseModel):
    """Every vehicle that has ever sent a record, by name."""

    items: list[Line]
    n_unreadable: int = Field(description="records that could not be read; the table `unreadable` has them")


def fleet_app(book: Book) -> FastAPI:
    """The application over a book, which it asks in a worker thread."""
    app = FastAPI(title="Springscale fleet", docs_url=None, redoc_url=None)
    app.add_middleware(SecurityHeaders, counts=Counter())

    @app.get("/api/v1/fleet")
    def fleet() -> Fleet:
        """The fleet now, a line per vehicle."""
        return Fleet(items=book.lines(), n_unreadable=book.n_unreadable())

    @app.get("/fleet", include_in_schema=False)
    async def page() -> Response:
        return FileResponse(ASSETS / "fleet.html", headers={"cache-control": "no-cache"})

    @app.get("/", include_in_schema=False)
    async def root() -> Response:
        return RedirectResponse("/fleet")

    app.mount("/assets", StaticFiles(directory=ASSETS), name="assets")
    return app


class FleetPage:
    """Serves the application from its own thread, so that it does not delay the subscriber."""

    def __init__(self, app: FastAPI, host: str, port: int) -> None:
        config = uvicorn.Config(
            app, host, port, log_config=None, access_log=False, server_header=False, timeout_graceful_shutdown=1
        )
        self._server = uvicorn.Server(config)
        self._socket = config.bind_socket()  # here, so that a port in use is reported at once
        self.port = int(self._socket.getsockname()[1])  # which the system may have chosen
        self._thread = threading.Thread(
            target=self._server.run, kwargs={"sockets": [self._socket]}, name="fleet-page", daemon=True
        )

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        """Stop; requests in progress have one second."""
        self._server.should_exit = True
        self._thread.join(5.0)
