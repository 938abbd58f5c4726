"""The fleet's page, /fleet, and its API, /api/v1/fleet.

They ask nobody for a token, and so answer only under the names that the settings give the subscriber: a page from
elsewhere cannot read them by a name of its own that leads here.
"""

import threading
from collections import Counter
from collections.abc import Collection, Iterator
from contextlib import contextmanager

import uvicorn
from fastapi import Depends, FastAPI, HTTPException, Request
from starlette.responses import FileResponse, RedirectResponse, Response
from starlette.staticfiles import StaticFiles

from gateway.config.permission import LOCAL_NAMES, Encryption, Holder, Kind, may_leave, name_in
from gateway.fleet.book import Book
from gateway.fleet.messages import Fleet
from gateway.web.access.middleware import SecurityHeaders
from gateway.web.pages import ASSETS


def fleet_app(book: Book, names: Collection[str] = ()) -> FastAPI:
    """The application over a book, which it asks in a worker thread. It answers under ``names`` and local names."""

    async def is_asked_for(request: Request) -> None:
        """Raise HTTPException for a request under another name."""
        known = {*LOCAL_NAMES, *map(str.lower, names)}
        holder = Holder.MACHINE if name_in(request.headers.get("host", "")) in known else Holder.NOBODY
        if not may_leave(Kind.RECORD, Encryption.LOCAL, holder):  # a proxy on this machine encrypts and asks who it is
            raise HTTPException(421, f"answered for are {', '.join(sorted(known))}: name others in FLEET_NAMES")

    app = FastAPI(title="Springscale fleet", docs_url=None, redoc_url=None)
    app.add_middleware(SecurityHeaders, counts=Counter())

    @app.get("/api/v1/fleet", dependencies=[Depends(is_asked_for)])
    def fleet() -> Fleet:
        """The fleet now, a line per vehicle."""
        return book.fleet()

    @app.get("/fleet", include_in_schema=False)
    async def page() -> Response:
        return FileResponse(ASSETS / "fleet.html", headers={"cache-control": "no-cache"})

    @app.get("/", include_in_schema=False)
    async def root() -> Response:
        return RedirectResponse("fleet")  # relative, as the page's own links: a proxy may serve it below a path

    app.mount("/assets", StaticFiles(directory=ASSETS), name="assets")
    return app


@contextmanager
def served(app: FastAPI, host: str, port: int) -> Iterator[int]:
    """Serve it from a thread of its own, which does not delay the subscriber -> the port, which may have been 0."""
    config = uvicorn.Config(
        app, host, port, log_config=None, access_log=False, server_header=False, timeout_graceful_shutdown=1
    )
    server, bound = uvicorn.Server(config), config.bind_socket()  # here, so that a port in use is reported at once
    bound.listen()  # who asks before the thread runs waits, and is not refused
    thread = threading.Thread(target=server.run, args=([bound],), name="fleet-page", daemon=True)
    thread.start()
    try:
        yield int(bound.getsockname()[1])
    finally:
        server.should_exit = True
        thread.join(5.0)
