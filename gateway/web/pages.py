"""Pages for people: the dashboard and the API's own documentation, every file from an installed package."""

from importlib.resources import files
from pathlib import Path
from typing import Final

from fastapi import FastAPI
from starlette.responses import FileResponse, Response
from starlette.staticfiles import StaticFiles

ASSETS: Final = Path(str(files("gateway.web"))) / "assets"
SWAGGER_FILES: Final = Path(str(files("fastapi_offline"))) / "static"


def install(app: FastAPI) -> None:
    """/, /docs and the files they load."""

    @app.get("/", include_in_schema=False)
    async def dashboard() -> Response:
        return FileResponse(ASSETS / "dashboard.html", headers={"cache-control": "no-cache"})

    @app.get("/docs", include_in_schema=False)
    async def docs() -> Response:
        return FileResponse(ASSETS / "docs.html", headers={"cache-control": "no-cache"})

    app.mount("/assets", StaticFiles(directory=ASSETS), name="assets")
    app.mount("/swagger", StaticFiles(directory=SWAGGER_FILES), name="swagger")
