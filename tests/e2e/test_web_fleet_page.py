"""The fleet's page in a browser: a line per vehicle, alarmed ones first, found by a word, kept up to date."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.browser import expect
from support.dashboard import CONTRASTS, LEAST_CONTRAST, Watched
from support.fleet_messages import alarm, estimate, message

from gateway.fleet import Book, fleet_app, served

NOW_S = 1_800_000_000.0
HURRIED = "{ const set = setInterval; window.setInterval = (draw, ms) => set(draw, ms / 20); }"  # nobody has to wait
ENGLISH = re.compile(r"\b(the|and|of|vehicle|limit|ago|search)\b", re.IGNORECASE)


@pytest.fixture
def book(tmp_path: Path) -> Iterator[Book]:
    opened = Book(str(tmp_path / "fleet.sqlite"), lambda: NOW_S)
    opened.write([
        message("van-1", "status", state="online", vin="WVWZZZ1KZAW000001"),
        estimate("van-1", 55, 200.0), estimate("van-2", 40, 620.0), alarm("van-2", 1, is_active=True),
        message("van-10", "status", state="offline"),
    ])  # fmt: skip
    yield opened
    opened.close()


@pytest.fixture
def url(book: Book) -> Iterator[str]:
    with served(fleet_app(book), "127.0.0.1", 0) as port:
        yield f"http://127.0.0.1:{port}"


def test_vehicles_with_alarms_come_first_and_the_search_works_by_keyboard(url: str, book: Book, browser: Any) -> None:
    watched = Watched(browser)
    page = watched.page
    page.add_init_script(HURRIED)
    page.goto(url)  # leads to /fleet
    rows = page.locator("#vehicles tr")
    expect(page.locator("#said")).to_have_text("3 vehicles, 1 over a limit, 1 with an alarm.")
    expect(rows).to_have_text([
        re.compile(r"van-2620 ± 18\skg2,120\skg of 2,000\skgover the limit: whole vehicle20 min agoWhole vehicle too"),
        re.compile(r"van-1WVWZZZ1KZAW000001200 ± 18\skg1,700\skg of 2,000\skg5 min ago"),
        re.compile(r"van-10offlineunknownunknownunknown"),
    ])  # fmt: skip
    filled = "spans => spans.map(s => s.getBoundingClientRect().width / s.parentElement.getBoundingClientRect().width)"
    assert page.locator(".bar span").evaluate_all(filled) == pytest.approx([1.0, 0.4], abs=0.01)
    first, second = (rows.nth(n).element_handle() for n in range(2))
    page.keyboard.press("Tab")
    page.keyboard.type("kzaw")
    expect(rows).to_have_count(1)
    expect(page.locator("#said")).to_contain_text("1 of 3 shown")
    book.write([alarm("van-1", 1, is_active=True)])
    expect(rows.locator("li")).to_contain_text("Whole vehicle too heavy")
    assert second.evaluate("row => row.isConnected && row.innerText.includes('too heavy')")  # changed in its place
    page.keyboard.press("Control+A")
    page.keyboard.press("Backspace")
    expect(rows).to_have_count(3)
    assert [row.evaluate("row => [...row.parentElement.children].indexOf(row)") for row in (first, second)] == [0, 1]
    book.write([message("van-1", "trips")])
    expect(page.locator("#said")).to_contain_text("1 record could not be read.")
    assert page.evaluate("document.activeElement.id") == "search"
    assert {address.split("/")[2] for address in watched.addresses} == {url.split("/")[2]}
    assert watched.complaints == []
    page.close()


@pytest.mark.parametrize("width", [390, 1280])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_in_german_on_a_phone_and_on_a_desk(url: str, browser: Any, width: int, scheme: str) -> None:
    watched = Watched(browser, locale="de-DE", color_scheme=scheme, viewport={"width": width, "height": 800})
    page = watched.page
    page.goto(f"{url}/fleet")
    expect(page.locator("#said")).to_have_text("3 Fahrzeuge, 1 über einer Grenze, 1 mit Alarm.")
    expect(page.locator("#vehicles tr").first).to_contain_text("2.120\u00a0kg von 2.000\u00a0kg")
    assert not ENGLISH.search(page.locator("body").inner_text())
    label = page.get_by_text("Suchen").bounding_box()
    field = page.get_by_role("searchbox", name="Suchen").bounding_box()
    assert label["x"] < field["x"]
    assert abs(label["y"] - field["y"]) < 20.0  # on the same line
    assert [text for contrast, text in page.evaluate(CONTRASTS) if contrast < LEAST_CONTRAST] == []
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert watched.complaints == []
    page.close()


def test_a_lost_service_is_shown(browser: Any, book: Book) -> None:
    watched = Watched(browser)
    watched.page.add_init_script(HURRIED)
    with served(fleet_app(book), "127.0.0.1", 0) as port:
        watched.page.goto(f"http://127.0.0.1:{port}/fleet")
        expect(watched.page.locator("#vehicles tr")).to_have_count(3)
    expect(watched.page.locator("#said")).to_have_text(re.compile("does not answer"))
    expect(watched.page.locator("#vehicles tr")).to_have_count(3)
    watched.page.close()
