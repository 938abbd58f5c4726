"""The dashboard of a day that is over: what it shows to whom, on every screen, by keyboard and behind a proxy."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from support.browser import expect
from support.dashboard import CHARTS_FOLLOW, CONTRASTS, LEAST_CONTRAST, STATUS, Watched, furnished
from support.estimates import make_estimate
from support.learner import ANSWERS, LearnerBench, at, found
from support.web import Gateway, below, serving

from gateway.estimates.batch_estimate import Z95
from gateway.web.access.tokens import Scope, TokenFile

PHONE: dict[str, Any] = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
MOST_SCREENS_ON_A_PHONE = 3.0


@pytest.fixture(scope="module")
def drawn(site: str, browser: Any) -> Iterator[Watched]:
    """The dashboard with every chart drawn and every table opened; tests must leave it as it was."""
    made = Watched(browser, color_scheme="light")
    made.page.goto(site)
    made.wait_for_charts()
    for summary in made.page.locator("summary:visible").all():
        summary.click()
    yield made
    made.page.close()


def test_the_dispatchers_page_shows_load_place_and_history_without_charts(site: str, watched: Watched) -> None:
    page = watched.page
    page.goto(site)
    expect(page.locator("#payload")).to_have_text("270 kg")
    expect(page.locator("#payload-range")).to_have_text("95 %: 258 to 282 kg")
    expect(page.locator("#share")).to_have_text("48.0 %")
    expect(page.locator("#share-range")).to_have_text("95 %: 47.6 to 48.4 %")
    expect(page.locator("#load-so-far")).to_have_text("270 ± 8 kg over 2 batches")
    expect(page.locator("#age")).to_have_text(re.compile(r"^\d+ s ago$"))
    expect(page.locator("#state")).to_contain_text("Estimating Driving; the estimate is kept up to date.")
    expect(page.locator("#vehicle")).to_have_text("van-17")
    expect(page).to_have_title("270 kg – Springscale")

    expect(page.locator("#weights")).to_contain_text("1.71 ± ")  # 270 kg that leave 48.0 % in front: (3)
    drawing = page.get_by_role(
        "img", name="Van from above. The load's centre is 1.71 m behind the front axle. Front axle"
    )
    expect(drawing).to_be_visible()
    front, rear = (float(x) for x in page.evaluate(AXLE_PLACES))
    centre = float(drawing.locator("circle.load").get_attribute("cx"))
    assert (centre - front) / (rear - front) == pytest.approx(1.71 / 2.8, abs=0.01)
    expect(page.locator("#overload")).to_have_text("Rear axle: too heavy.")
    expect(drawing.locator("text.over")).to_contain_text(["865", "limit 850"])

    expect(page.locator("#recent tr")).to_have_count(4)
    page.get_by_text("History as a table").click()
    expect(page.locator("#recent tr").nth(0)).to_contain_text("258 to 282 kg")
    expect(page.locator("#recent tr").nth(1)).to_contain_text("not weighed: too slow, gap")
    with page.expect_request(lambda request: "limit=1000" in request.url):
        page.get_by_label("7 days").check()


AXLE_PLACES = "[...document.querySelectorAll('#van line.axle')].map((line) => line.getAttribute('x1'))"


def test_the_engineers_page_says_what_was_refused_and_what_is_silent(site: str, watched: Watched) -> None:
    page = watched.page
    page.goto(f"{site}/engineer")
    item = page.locator("#rejected li")
    expect(item).to_have_count(1)
    expect(item).to_contain_text(
        "Too slow: the speed was below speed_min_mps for too much of the window: town traffic, a queue, a yard."
    )
    expect(item).to_contain_text("What to do: nothing; an open road is enough.")
    expect(item).to_contain_text("Gap: frames of both sensors are missing")
    rows = page.locator("#signals tr")
    expect(rows.nth(0)).to_contain_text("100.2 Hz")
    expect(rows.nth(1).locator(".silent")).to_have_text("silent for 75 s")
    expect(rows.nth(2).locator(".silent")).to_have_text("never heard")
    expect(rows.nth(3)).to_have_text("Optional, not sent: door, odometer")
    expect(rows.nth(3).locator(".silent")).to_have_count(0)
    expect(page.locator("#bus")).to_contain_text("socketcan can0: receiving")
    expect(page.locator("#bus")).to_contain_text("connected; 31 waiting, the oldest for 2.6 h")
    expect(page.locator("#calibrated")).to_contain_text("0 to 420 kg")


def test_it_shows_how_exactly_a_load_is_weighed_and_what_to_teach_next(tmp_path: Path, watched: Watched) -> None:
    bench, page = LearnerBench(tmp_path / "learner"), watched.page
    with Gateway(tmp_path / "store", learner=bench.learner) as gateway, serving(gateway.app) as server:
        gateway.status = STATUS
        page.goto(server.url)
        expect(page.locator("#teach-accuracy")).to_have_text("nothing is learnt yet")
        expect(page.locator("#teach-help")).to_have_text("state the van")
        expect(page.locator("#teach-questions")).to_have_text("none")
        httpx.put(f"{server.url}/api/v1/vehicle", json=ANSWERS).raise_for_status()
        load = {"from": at(60), "source": "delivery_note", "load": {"payload_kg": 310.0}}
        httpx.post(f"{server.url}/api/v1/statements", json=load).raise_for_status()
        bench.drive(60)
        bench.turn()
        helps = [{"do": "scale", "then_plus_minus_kg": 17.0}, {"do": "empty_drive", "then_plus_minus_kg": 30.0}]
        learning = {"plus_minus_kg": 34.0, "helps": helps}
        bench.finish(learning=learning, **found(bench, "held", 120.0, "is it of another drive?"))
        expect(page.locator("#teach-accuracy")).to_have_text("± 34 kg")
        expect(page.locator("#teach-help")).to_have_text("a large load on a scale: then ± 17 kg")
        expect(page.locator("#teach-questions")).to_have_text("1")
        page.locator("#teach").get_by_role("link", name="Teach the vehicle").click()
        expect(page).to_have_url(f"{server.url}/teach")
        gateway.board.close()


def test_the_charts_show_estimates_bands_and_truth(drawn: Watched) -> None:
    page = drawn.page
    truth, band, _early, estimate, refused = page.evaluate("document.getElementById('payload-chart').data")
    assert [y for y in truth["y"] if y is not None] == [0, 270, 270]
    ends_kg = [kg + side * Z95 * 6.0 for kg in (2.0, 270.0) for side in (-1.0, 1.0)]
    assert sorted({y for y in band["y"] if y is not None}) == pytest.approx(ends_kg, abs=1e-5)
    assert [y for y in estimate["y"] if y is not None] == [2, 2, 2, 2, 270, 270]
    assert refused["text"] == ["not weighed: too slow, gap<br>until 1 Jan 1970, 00:15"]
    expect(page.locator("#payload-chart-words")).to_contain_text("3 of 4 batches weighed; the last 270 kg")
    expect(page.locator("#history-legend")).to_contain_text("actual load (simulator)")


def test_the_page_loads_from_the_gateway_alone_and_numbers_first(site: str, drawn: Watched) -> None:
    assert [address for address in drawn.addresses if not address.startswith(f"{site}/")] == []
    (library,) = [n for n, address in enumerate(drawn.addresses) if "plotly" in address]
    assert library > drawn.addresses.index(f"{site}/api/v1/estimates/latest")
    assert drawn.complaints == []  # not of the page's policy either


@pytest.mark.parametrize("width", [390, 1800])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_in_german_on_a_phone_and_on_a_wide_desk(site: str, browser: Any, width: int, scheme: str) -> None:
    """Numbers and times as Germans write them, and no word of English."""
    made = Watched(browser, locale="de-DE", color_scheme=scheme, viewport={"width": width, "height": 1000})
    page = made.page
    page.route("**/plotly-*", lambda route: route.abort())
    page.goto(site)
    expect(page.locator("#payload")).to_have_text("270 kg")
    expect(page.locator("#share")).to_have_text("48,0 %")
    expect(page.locator("#payload-range")).to_have_text("95 %: 258 bis 282 kg")
    expect(page.locator("#state-name")).to_have_text("Wiegt")
    expect(page.locator("#overload")).to_have_text("Hinterachse: zu schwer.")
    assert_german_and_readable(page)
    page.goto(f"{site}/engineer")
    expect(page.locator("#calibrated")).to_contain_text("Kreuzspektren", use_inner_text=False)
    expect(page.locator("#rejected")).to_contain_text(
        "Zu langsam: zu viel des Abschnitts war langsamer", use_inner_text=False
    )
    assert_german_and_readable(page)
    assert [said for said in made.complaints if "ERR_FAILED" not in said] == []
    page.close()


def assert_german_and_readable(page: Any) -> None:
    """All of it opened: no word of English, enough contrast, nothing wider than the screen."""
    for fold in page.locator("button.fold:visible").all():
        fold.click()
    for summary in page.locator("summary:visible").all():
        summary.click()
    assert [line for line in page.locator("body").inner_text().splitlines() if ENGLISH.search(line)] == []
    assert [text for contrast, text in page.evaluate(CONTRASTS) if contrast < LEAST_CONTRAST] == []
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_a_wide_screen_is_used_and_charts_write_numbers_as_the_page_does(site: str, browser: Any) -> None:
    """Three cards beside each other, to the edges; those for engineers fill three columns."""
    made = Watched(browser, locale="de-DE", viewport={"width": 1800, "height": 1000})
    made.page.goto(site)
    expect(made.page.locator("#payload")).to_have_text("270 kg")
    boxes = [made.page.locator(card).bounding_box() for card in ("#latest", "#place", "#day")]
    assert len({box["y"] for box in boxes}) == 1
    assert boxes[-1]["x"] + boxes[-1]["width"] > 1750
    expect(made.page.locator("#payload-chart[data-drawn]")).to_be_visible()
    assert made.page.evaluate("document.getElementById('payload-chart').layout.separators") == ",."
    made.page.goto(f"{site}/engineer")
    made.wait_until(IN_THREE_COLUMNS)
    made.page.close()


# The cards move until all their numbers have come.
IN_THREE_COLUMNS = """new Set([...document.querySelectorAll("#packed > .card:not([hidden])")].map(
  card => card.getBoundingClientRect().x)).size === 3"""
ENGLISH = re.compile(r"\b(the|and|not|of|load|weighed|batch|unknown|heard|never)\b")


def test_the_state_stays_in_view(drawn: Watched) -> None:
    drawn.page.locator("footer").scroll_into_view_if_needed()
    assert drawn.page.evaluate("scrollY") > 400
    expect(drawn.page.locator("#state")).to_be_in_viewport(ratio=1.0)


def test_a_phone_shows_the_load_and_folds_the_rest(site: str, browser: Any) -> None:
    watched = Watched(browser, **PHONE)
    page = watched.page
    page.goto(site)
    expect(page.locator("#payload-chart[data-drawn]")).to_be_visible()
    assert page.evaluate("document.documentElement.scrollHeight / innerHeight") < MOST_SCREENS_ON_A_PHONE
    assert page.evaluate("document.documentElement.scrollWidth") <= PHONE["viewport"]["width"]
    page.locator("footer").scroll_into_view_if_needed()
    assert page.evaluate("scrollY") > 400
    expect(page.locator("#state")).to_be_in_viewport(ratio=1.0)
    page.goto(f"{site}/engineer")
    fold = page.get_by_role("button", name="Batches that could not be weighed")
    expect(fold).to_have_attribute("aria-expanded", "false")
    expect(page.locator("#rejected")).to_be_hidden()
    fold.click()
    expect(page.locator("#rejected")).to_be_visible()
    fold.click()
    expect(page.locator("#rejected")).to_be_hidden()
    page.set_viewport_size({"width": 1240, "height": 800})
    expect(page.locator("#rejected")).to_be_visible()
    expect(fold).to_have_count(0)
    assert watched.complaints == []
    page.close()


def test_without_scripts_it_shows_where_the_numbers_are_and_claims_nothing(site: str, browser: Any) -> None:
    page = browser.new_page(java_script_enabled=False)
    page.goto(site)
    seen = page.locator("body").inner_text()
    assert "This page needs JavaScript. The numbers are at /api/v1/estimates/latest." in seen
    assert not re.search("no batch|none|unknown|loading|connecting|asking", seen, re.IGNORECASE), seen
    page.close()


def test_it_asks_for_a_token_where_one_is_needed_and_claims_nothing_before(tmp_path: Path, watched: Watched) -> None:
    tokens = TokenFile(tmp_path / "tokens.json")
    tokens.create("somebody else", Scope.READ)
    with Gateway(tmp_path / "store", tokens=tokens) as gateway, serving(gateway.app) as server:
        gateway.publish(make_estimate(0))
        page = watched.page
        page.goto(server.url)
        expect(page.locator("#state")).to_contain_text("Locked The gateway needs a token.")
        seen = page.locator("body").inner_text()
        assert not re.search("no batch|none|unknown|nothing", seen, re.IGNORECASE), seen
        page.get_by_label("Token", exact=True).fill(tokens.create("dispatcher", Scope.READ))
        page.keyboard.press("Enter")
        expect(page.locator("#payload")).to_have_text("100 kg")
        expect(page.locator("#link")).to_have_text("live")
        expect(page.locator("#token")).to_be_hidden()
        assert not any("spr_" in address for address in watched.addresses)
        page.get_by_text("History as a table").click()
        with page.expect_download() as download:
            page.get_by_text("Download all as CSV").click()
        assert "payload_kg" in Path(download.value.path()).read_text()
        gateway.board.close()


@pytest.mark.parametrize("scheme", ["dark", "light"])
def test_every_text_has_contrast_in_light_and_dark(drawn: Watched, scheme: str) -> None:
    drawn.page.emulate_media(color_scheme=scheme)
    drawn.wait_until(CHARTS_FOLLOW)
    seen = drawn.page.evaluate(CONTRASTS)
    assert len(seen) > 60
    assert [text for contrast, text in seen if contrast < LEAST_CONTRAST] == []


def test_the_keyboard_reaches_everything_in_order(site: str, watched: Watched) -> None:
    page = watched.page
    page.goto(site)
    expect(page.locator("#recent tr")).to_have_count(4)
    for late in ("History as a table", "state the van"):
        expect(page.get_by_text(late)).to_be_visible()  # each is drawn when its numbers come
    expect(page.locator("#link")).to_have_text("live")
    watched.wait_until(f"{REACHABLE} === 12")  # the span's three buttons are one stop
    order = []
    for _ in range(10):
        page.keyboard.press("Tab")
        order.append(page.evaluate(FOCUSED))
        assert page.evaluate("getComputedStyle(document.activeElement).outlineStyle") == "solid", order[-1]
    assert order[:3] == ["Skip to the load", "24", "History as a table"]
    assert order[3:] == [
        "Teach the vehicle",
        "Dashboard",
        "In the cab",
        "Teach the vehicle",
        "For engineers",
        "API",
        "Metrics",
    ]
    page.reload()
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    watched.wait_until("document.activeElement.id === 'main'")


REACHABLE = """[...document.querySelectorAll("a[href], button, select, input, summary, [tabindex='0']")]
  .filter(e => e.checkVisibility() && !e.disabled).length"""
FOCUSED = """(() => { const e = document.activeElement;
  const label = document.getElementById(e.getAttribute("aria-labelledby"))?.textContent;
  return e === document.body ? "BODY" : e.getAttribute("aria-label") ?? label ?? (e.value || e.textContent.trim());
})()"""


def test_it_is_built_for_screen_readers(drawn: Watched) -> None:
    page = drawn.page
    for role in ("banner", "main", "contentinfo"):
        expect(page.get_by_role(role)).to_have_count(1)
    assert [level for level in page.evaluate(HEADINGS) if level not in ("H1", "H2")] == []
    assert page.evaluate(HEADINGS)[0] == "H1"
    assert page.evaluate(HEADINGS).count("H1") == 1
    assert page.evaluate("document.documentElement.lang") == "en"
    assert page.evaluate(NAMELESS) == []
    assert page.evaluate(REPEATED_IDS) == []
    assert page.locator("th:not([scope])").count() == 0
    assert page.locator("[role=status][aria-live=polite]").count() == 2


HEADINGS = "[...document.querySelectorAll('h1, h2, h3, h4, h5, h6')].map((heading) => heading.tagName)"
REPEATED_IDS = "[...document.querySelectorAll('[id]')].map((e) => e.id).filter((id, n, all) => all.indexOf(id) !== n)"
NAMELESS = """[...document.querySelectorAll("[role=img], [role=region], section, button, input, a, fieldset")]
  .filter((e) => !e.closest(".js-plotly-plot") || e.getAttribute("role"))
  .filter((e) => {
    const by = (e.getAttribute("aria-labelledby") ?? "").split(" ").map((id) => document.getElementById(id));
    const named = [e.getAttribute("aria-label"), ...by.map((other) => other?.textContent)].some((name) => name?.trim());
    return !named && !e.labels?.length && !e.textContent.trim();
  })
  .map((e) => e.outerHTML.slice(0, 80))"""


def test_pages_work_below_a_path_of_a_proxy(tmp_path: Path, watched: Watched) -> None:
    """One host for several vehicles: the proxy serves each below a path of its own, and cuts that off."""
    page = watched.page
    with furnished(tmp_path) as gateway, serving(below("/vans/17", gateway.app)) as server:
        page.goto(f"{server.url}/vans/17/")
        expect(page.locator("#payload")).to_have_text("270 kg")
        page.locator("footer a", has_text="In the cab").click()
        expect(page).to_have_url(f"{server.url}/vans/17/cab")
        expect(page.locator("body")).to_contain_text("270 kg")
        page.goto(f"{server.url}/vans/17/docs")
        page.get_by_text("/health/live").first.click()
        page.get_by_role("button", name="Try it out").click()
        page.get_by_role("button", name="Execute").click()
        expect(page.locator(".request-url")).to_contain_text(f"{server.url}/vans/17/health/live")
        expect(page.locator(".live-responses-table tbody .response-col_status").first).to_contain_text("200")
        gateway.board.close()
    ours = [address for address in watched.addresses if not address.startswith("data:")]
    assert all(address.startswith(f"{server.url}/vans/17/") for address in ours), ours
    assert [text for text in watched.complaints if "plotly" not in text and "ERR_FAILED" not in text] == []
