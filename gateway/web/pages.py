"""Pages for people: those of springscale, the API's documentation, and plotly.js of the installed package."""

import gzip
import re
from functools import cache
from importlib.metadata import distribution
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Final

from fastapi import FastAPI
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, Response, StreamingResponse
from starlette.staticfiles import StaticFiles

from gateway.web.access.middleware import content_security_policy

_PLOTLY: Final = distribution("plotly")  # found by its metadata: importlib.resources would import it
LIBRARY: Final = Path(str(_PLOTLY.locate_file("plotly/package_data/plotly.min.js")))
LIBRARY_URL: Final = f"/assets/plotly-{_PLOTLY.version}.min.js"
_KEPT: Final = {"cache-control": "public, max-age=31536000, immutable", "vary": "accept-encoding"}
PIECE_BYTES: Final = 65_536  # chosen: a slow client holds little more than this in memory
_MEDIA_TYPE: Final = "text/javascript; charset=utf-8"
_STYLE_ID: Final = re.compile(rb'getElementById\("([0-9a-f]{64})"\)')


@cache
def style_ids() -> tuple[str, ...]:
    """Ids of style elements that the library would write into the page on loading if they were missing.

    They style maps, which we do not draw; the page's policy forbids them, so the page has stand-ins.
    """
    return tuple(sorted({found.decode() for found in _STYLE_ID.findall(LIBRARY.read_bytes())}))


async def library_response(request: Request) -> Response:
    """The library; its address changes with its version, so a browser's copy never becomes stale."""
    if "gzip" not in request.headers.get("accept-encoding", ""):
        return FileResponse(LIBRARY, media_type=_MEDIA_TYPE, headers=_KEPT)
    packed = await run_in_threadpool(_packed)
    pieces = (packed[begin : begin + PIECE_BYTES] for begin in range(0, len(packed), PIECE_BYTES))
    headers = {**_KEPT, "content-encoding": "gzip", "content-length": str(len(packed))}
    return StreamingResponse(pieces, media_type=_MEDIA_TYPE, headers=headers)


@cache
def _packed() -> bytes:
    """Packed once, when first asked for: about 1.5 MB instead of 4.8."""
    return gzip.compress(LIBRARY.read_bytes(), compresslevel=6, mtime=0)


ASSETS: Final = Path(str(files("gateway.web"))) / "assets"
SWAGGER_FILES: Final = Path(str(files("fastapi_offline"))) / "static"


def install(app: FastAPI, known_loads_path: str = "") -> None:
    """/, /cab, /teach, /engineer, /docs and the files they load.

    ``known_loads_path`` is the address of the true loads, if there are any.

    Pages name files and routes relative to themselves, so that a proxy may serve them below a path of its own.
    """
    frame = Template((ASSETS / "frame.html").read_text(encoding="utf-8"))
    asked_about = {"cache-control": "no-cache"}

    def framed(cards: str, script: str) -> str:
        return frame.substitute(
            cards=(ASSETS / cards).read_text(encoding="utf-8"),
            script=script,
            chart_library=LIBRARY_URL[1:],
            chart_styles=" ".join(style_ids()),
            known_loads=known_loads_path[1:],
        )

    of_dispatcher, of_engineer = framed("dashboard.html", "main"), framed("engineer.html", "engineer")

    @app.get("/", include_in_schema=False)
    async def dashboard() -> Response:
        return HTMLResponse(of_dispatcher, headers=asked_about)

    @app.get("/engineer", include_in_schema=False)
    async def engineer() -> Response:
        return HTMLResponse(of_engineer, headers=asked_about)

    @app.get("/cab", include_in_schema=False)
    async def cab() -> Response:
        return FileResponse(ASSETS / "cab.html", headers=asked_about)

    @app.get("/teach", include_in_schema=False)
    async def teach() -> Response:
        return FileResponse(ASSETS / "teach.html", headers=asked_about)

    @app.get("/docs", include_in_schema=False)
    async def docs() -> Response:
        policy = content_security_policy("'unsafe-inline'")  # Swagger's own widgets write style attributes
        return FileResponse(ASSETS / "docs.html", headers=asked_about | {"content-security-policy": policy})

    app.add_route(LIBRARY_URL, library_response, include_in_schema=False)
    app.mount("/assets", StaticFiles(directory=ASSETS), name="assets")
    app.mount("/swagger", StaticFiles(directory=SWAGGER_FILES), name="swagger")
