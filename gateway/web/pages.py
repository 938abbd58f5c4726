"""Pages for people: dashboard, cab page and the API's own documentation, every file from an installed package."""

from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Final

from fastapi import FastAPI
from starlette.responses import FileResponse, HTMLResponse, Response
from starlette.staticfiles import StaticFiles

from gateway.web.charting import LIBRARY_URL, library_response, style_ids
from gateway.web.door.headers import content_security_policy

ASSETS: Final = Path(str(files("gateway.web"))) / "assets"
SWAGGER_FILES: Final = Path(str(files("fastapi_offline"))) / "static"


def install(app: FastAPI, known_loads_path: str = "") -> None:
    """/, /cab, /docs and the files they load. ``known_loads_path`` is the address of the true loads, if there are
    any.
    """
    page = Template((ASSETS / "dashboard.html").read_text(encoding="utf-8")).substitute(
        chart_library=LIBRARY_URL, chart_styles=" ".join(style_ids()), known_loads=known_loads_path
    )
    asked_about = {"cache-control": "no-cache"}

    @app.get("/", include_in_schema=False)
    async def dashboard() -> Response:
        return HTMLResponse(page, headers=asked_about)

    @app.get("/cab", include_in_schema=False)
    async def cab() -> Response:
        return FileResponse(ASSETS / "cab.html", headers=asked_about)

    @app.get("/docs", include_in_schema=False)
    async def docs() -> Response:
        policy = content_security_policy("'unsafe-inline'")  # Swagger's own widgets write style attributes
        return FileResponse(ASSETS / "docs.html", headers=asked_about | {"content-security-policy": policy})

    app.add_route(LIBRARY_URL, library_response, include_in_schema=False)
    app.mount("/assets", StaticFiles(directory=ASSETS), name="assets")
    app.mount("/swagger", StaticFiles(directory=SWAGGER_FILES), name="swagger")
