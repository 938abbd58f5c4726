"""A real browser, for the tests of the dashboard."""

import shutil
from collections.abc import Iterator
from typing import Any

import pytest
from support.dashboard import Look, Watched, furnished
from support.patience import PATIENCE_S
from support.web import Gateway, serving


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright (dependency group browser)")
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        pytest.skip("needs Debian's chromium")
    playwright.expect.set_options(timeout=1000 * PATIENCE_S)
    with playwright.sync_playwright() as running:
        opened = running.chromium.launch(executable_path=chromium, args=["--no-sandbox"], timeout=1000 * PATIENCE_S)
        yield opened
        opened.close()


@pytest.fixture
def watched(browser: Any) -> Iterator[Watched]:
    """A page to which the charts' library does not come: quick, and everything but the charts must be there."""
    made = Watched(browser, color_scheme="dark")
    made.page.route("**/plotly-*", lambda route: route.abort())
    yield made
    made.page.close()


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Where a gateway with something to look at is; nobody changes it."""
    with furnished(tmp_path_factory.mktemp("site")) as gateway, serving(gateway.app) as server:
        yield server.url
        gateway.board.close()


@pytest.fixture
def dashboard(gateway: Gateway, watched: Watched) -> Iterator[Look]:
    """Opens the dashboard of the module's own gateway."""
    with serving(gateway.app) as server:
        yield lambda: watched.opened(server.url)
        gateway.board.close()
