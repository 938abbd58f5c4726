"""The dashboard in a real browser: it shows, follows, grows old, comes back, and loads nothing from elsewhere."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.estimates import make_record
from support.web import Gateway, serving

from gateway.records import Why
from gateway.web import BusStatus, Scope, SignalHealth, State, Status, TokenFile

playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright (dependency group browser)")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="needs Debian's chromium")
expect = playwright.expect


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with playwright.sync_playwright() as running:
        opened = running.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield opened
        opened.close()


class Watched:
    """A page, what it loaded from where, and what its console said."""

    def __init__(self, browser: Any, **options: Any) -> None:
        self.page = browser.new_page(**options)
        self.page.set_default_timeout(20_000)
        self.addresses: list[str] = []
        self.complaints: list[str] = []
        self.page.on("request", lambda request: self.addresses.append(request.url))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("console", lambda said: self.complaints.append(said.text) if said.type == "error" else None)


@pytest.fixture
def watched(browser: Any) -> Iterator[Watched]:
    made = Watched(browser, locale="en-GB", timezone_id="UTC")
    yield made
    made.page.close()


@pytest.fixture
def gateway(tmp_path: Path) -> Iterator[Gateway]:
    with Gateway(tmp_path / "store") as opened:
        opened.status = Status(
            version="1.2.3",
            state=State.ESTIMATING,
            uptime_s=3600.0,
            vehicle_id="van-17",
            calibration_id="sha256:ab",
            bus=BusStatus(interface="socketcan", channel="can0", state="connected", n_frames=12345),
            signals=(SignalHealth(signal="vertical_acceleration", rate_hz=100.2, last_age_s=0.0, rejected_share=0.01),),
        )
        yield opened


def test_it_shows_the_load_its_band_and_the_recent_batches(gateway: Gateway, watched: Watched) -> None:
    gateway.publish(make_record(0), make_record(1, Why.TOO_SLOW, Why.GAP))
    with serving(gateway.app) as server:
        page = watched.page
        page.goto(server.url)
        expect(page.locator("#payload")).to_have_text("100 kg")
        expect(page.locator("#payload-range")).to_have_text("88 to 112 kg (95 %)")
        expect(page.locator("#share")).to_have_text("50.5 %")
        expect(page.locator("#state")).to_contain_text("the estimate is kept up to date")
        expect(page.locator("#vehicle")).to_have_text("van-17")
        rows = page.locator("#recent tr")
        expect(rows).to_have_count(2)
        expect(rows.nth(0)).to_contain_text("rejected: too slow, gap")
        expect(page.locator("#signals")).to_contain_text("100.2 Hz")
        assert all(address.startswith(server.url) for address in watched.addresses)
    assert not watched.complaints


def test_it_follows_what_happens(gateway: Gateway, watched: Watched) -> None:
    with serving(gateway.app) as server:
        page = watched.page
        page.goto(server.url)
        expect(page.locator("#payload")).to_have_text("unknown")
        expect(page.locator("#note")).to_have_text("No estimate: no estimate yet.")
        expect(page.locator("#link")).to_have_text("live")
        gateway.publish(make_record(7))
        expect(page.locator("#payload")).to_have_text("107 kg")
        expect(page.locator("#note")).to_be_hidden()
        expect(page.locator("#recent tr")).to_have_count(1)
        gateway.board.publish(make_record(20, is_provisional=True))
        expect(page.locator("#note")).to_contain_text("Early value")


def test_an_old_estimate_is_said_to_be_old(gateway: Gateway, watched: Watched) -> None:
    gateway.publish(make_record(0))
    gateway.clock_s += 7200.0
    with serving(gateway.app) as server:
        watched.page.goto(server.url)
        expect(watched.page.locator("#note")).to_contain_text("This estimate is old")
        expect(watched.page.locator("#age")).to_have_text("2.0 h")


def test_it_stays_readable_without_the_service_and_comes_back_with_it(gateway: Gateway, watched: Watched) -> None:
    gateway.publish(make_record(0))
    page = watched.page
    with serving(gateway.app) as server:
        page.goto(server.url)
        expect(page.locator("#link")).to_have_text("live")
        port = server.socket.getsockname()[1]
        gateway.board.close()
    expect(page.locator("#link")).to_have_text("not connected: trying again")
    expect(page.locator("#state")).to_contain_text("does not answer")
    expect(page.locator("#payload")).to_have_text("100 kg")
    gateway.restart_board()
    with serving(gateway.app, port=port):
        gateway.publish(make_record(1))
        expect(page.locator("#link")).to_have_text("live")
        expect(page.locator("#payload")).to_have_text("101 kg")
        expect(page.locator("#recent tr")).to_have_count(2)
        gateway.board.close()


def test_it_asks_for_a_token_where_one_is_needed(tmp_path: Path, watched: Watched) -> None:
    tokens = TokenFile(tmp_path / "tokens.json")
    with Gateway(tmp_path / "store", tokens=tokens) as gateway, serving(gateway.app) as server:
        gateway.publish(make_record(0))
        page = watched.page
        page.goto(server.url)
        expect(page.locator("#state")).to_have_text("The gateway wants a token.")
        page.get_by_label("Token").fill(tokens.create("dispatcher", Scope.READ))
        page.keyboard.press("Enter")
        expect(page.locator("#payload")).to_have_text("100 kg")
        expect(page.locator("#link")).to_have_text("live")
        expect(page.locator("#token")).to_be_hidden()
        assert not any("spr_" in address for address in watched.addresses)
        gateway.board.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_is_readable_on_a_phone_in_light_and_dark(gateway: Gateway, browser: Any, scheme: str) -> None:
    gateway.publish(make_record(0))
    watched = Watched(browser, viewport={"width": 360, "height": 740}, color_scheme=scheme)
    with serving(gateway.app) as server:
        page = watched.page
        page.goto(server.url)
        expect(page.locator("#payload")).to_have_text("100 kg")
        assert page.evaluate("document.documentElement.scrollWidth") <= 360
        ink, ground = (
            page.evaluate(f"getComputedStyle(document.body).{name}") for name in ("color", "backgroundColor")
        )
        assert contrast(ink, ground) > 7.0  # WCAG 2.2, level AAA
        page.close()


def contrast(one: str, other: str) -> float:
    """WCAG 2.2 contrast ratio of two CSS rgb() colours."""
    light, dark = sorted((luminance(one), luminance(other)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def luminance(colour: str) -> float:
    channels = [int(part) / 255.0 for part in colour.removeprefix("rgb(").removesuffix(")").split(",")]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_the_api_documentation_renders_without_a_network(gateway: Gateway, watched: Watched) -> None:
    with serving(gateway.app) as server:
        watched.page.goto(f"{server.url}/docs")
        expect(watched.page.get_by_text("/api/v1/estimates/latest").first).to_be_visible()
        assert all(address.startswith((server.url, "data:")) for address in watched.addresses)
    assert not watched.complaints
