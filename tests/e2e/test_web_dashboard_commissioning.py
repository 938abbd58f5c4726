"""The wizard in a real browser: from the offer to the calibration, on a page as wide as a phone."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.calibrated import calibration_file
from support.commissioning import Bench, fitted, in_steps
from support.dashboard import CONTRASTS, LEAST_CONTRAST, STATUS, Watched
from support.web import Gateway, serving

from gateway.calibration.commissioning import Result
from gateway.calibration.commissioning.job import Found
from gateway.web import Scope, TokenFile

playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright (dependency group browser)")
expect = playwright.expect

FAULT = Found(kind="pitch_rate_sign", severity="fault", text="the pitch rate is turned over", advice="set sign = -1")
PHONE = {"viewport": {"width": 390, "height": 844}}


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path / "service")


@pytest.fixture
def gateway(tmp_path: Path, bench: Bench) -> Iterator[Gateway]:
    with Gateway(tmp_path / "store", commissioning=bench.desk) as opened:
        opened.status = STATUS.model_copy(update={"calibration_id": None})
        yield opened


def news(gateway: Gateway, watched: Watched) -> None:
    """The page asks anew, as it does every five seconds."""
    watched.page.evaluate("import('/assets/dashboard/feed.js').then((feed) => feed.askCommissioning())")


def say_what_is_carried(page: Any) -> None:
    page.get_by_label("What it usually carries").select_option("parcels")
    page.get_by_label("How far along the floor").fill("2.4")
    page.get_by_label("Part of it may lie on the roof").check()


def fill(page: Any, *answers: str) -> None:
    """The vehicle's form."""
    for label, said in zip(
        ("Under the front axle", "Under the rear axle", "Wheelbase", "Sensor behind"), answers, strict=True
    ):
        page.get_by_label(label).fill(said)


def test_a_fitter_walks_through_it(gateway: Gateway, bench: Bench, browser: Any, tmp_path: Path) -> None:
    sister = tmp_path / "sister.json"
    sister.write_text(calibration_file().to_json())
    watched = Watched(browser, **PHONE)
    page = watched.page
    with serving(gateway.app) as server:
        page.goto(server.url)
        expect(page.locator("#commissioning-said")).to_contain_text("This vehicle is not calibrated.")
        page.get_by_role("button", name="Commission …").click()
        expect(page.get_by_text("Which vehicles is it like?")).to_be_visible()
        page.locator("#commissioning-file").set_input_files(str(sister))
        page.get_by_role("button", name="Take this line").click()
        expect(page.locator("#commissioning-refusal")).to_contain_text("holds no cross_spectrum calibration")
        page.locator("#commissioning-file").set_input_files([])
        page.locator("#commissioning-choice").select_option("")
        page.get_by_role("button", name="Take this line").click()
        expect(page.get_by_label("Under the front axle [kg]")).to_be_visible()
        assert [text for contrast, text in page.evaluate(CONTRASTS) if contrast < LEAST_CONTRAST] == []
        fill(page, "690", "20", "2.75", "1.2")
        page.get_by_role("button", name="Go on").click()
        expect(page.locator("#commissioning-refusal")).to_contain_text("unsprung masses")
        page.get_by_label("Under the rear axle").fill("710")
        say_what_is_carried(page)
        page.get_by_role("button", name="Go on").click()
        expect(page.locator("#commissioning-claim")).to_be_visible()
        bench.drive(0, 60, is_provisional=True)
        bench.worker.finish(Result(findings=(FAULT,)))
        news(gateway, watched)
        expect(page.locator("#commissioning-findings")).to_contain_text("turned over: set sign = -1")
        page.locator("#commissioning-claim").check()
        page.get_by_role("button", name="It is empty: begin").click()
        expect(page.locator("#commissioning-refusal")).to_contain_text("turned over")
        bench.drive(0, 120, is_provisional=True)
        bench.worker.finish(Result())
        page.get_by_role("button", name="It is empty: begin").click()
        expect(page.locator("#commissioning-looked")).to_contain_text("all is well")
        expect(page.locator("#commissioning-fit")).to_be_disabled()
        bench.drive(1)
        bench.worker.finish(fitted(payload_std_kg=36.0))
        news(gateway, watched)
        expect(page.locator("#commissioning-learned")).to_contain_text("50 % of what is wanted is known")
        assert page.locator("#commissioning-progress").evaluate("(bar) => bar.value") == 0.5
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        bench.drive(2)
        bench.worker.finish(fitted(payload_std_kg=15.0))
        news(gateway, watched)
        expect(page.locator("#commissioning-said")).to_contain_text("It counts from the next drive on")
        expect(page.locator("#commissioning-in-use")).to_contain_text("without a line, from 2 windows")
        assert watched.complaints == [] or all("409" in said for said in watched.complaints)
        gateway.board.close()
    page.close()


def test_what_was_made_is_undone_after_a_question(gateway: Gateway, bench: Bench, watched: Watched) -> None:
    in_steps(bench)
    for n in range(2):
        bench.drive(n)
    bench.worker.finish(fitted())
    with serving(gateway.app) as server:
        watched.page.goto(server.url)
        expect(watched.page.locator("#commissioning-in-use")).to_contain_text("van-17, without a line, from 2 windows")
        watched.page.locator("#commissioning-undo").click()
        watched.page.get_by_role("button", name="Yes").click()
        expect(watched.page.locator("#commissioning-in-use")).to_contain_text("that of the settings")
        watched.page.get_by_text("What was made here").click()
        expect(watched.page.locator("#commissioning-entries li")).to_contain_text("undone")
        assert watched.complaints == []
        gateway.board.close()


def test_cancel_wants_a_yes_and_a_token_that_may_operate(tmp_path: Path, bench: Bench, watched: Watched) -> None:
    tokens, page = TokenFile(tmp_path / "tokens.json"), watched.page
    reader, operator = tokens.create("dispatcher", Scope.READ), tokens.create("workshop", Scope.OPERATE)
    with (
        Gateway(tmp_path / "store", tokens=tokens, commissioning=bench.desk) as gateway,
        serving(gateway.app) as server,
    ):
        gateway.status = STATUS
        page.goto(server.url)
        page.get_by_label("Token", exact=True).fill(reader)
        page.keyboard.press("Enter")
        page.get_by_role("button", name="Commission …").click()
        expect(page.locator("#commissioning-refusal")).to_have_text("this needs a token with scope operate")
        page.locator("#commissioning-token-text").fill(operator)
        page.get_by_role("button", name="Commission …").click()
        expect(page.locator("#commissioning-said")).to_contain_text("by workshop")
        page.get_by_role("button", name="Cancel it").click()
        page.get_by_role("button", name="No", exact=True).click()
        expect(page.locator("#commissioning-cancel")).to_be_visible()
        page.get_by_role("button", name="Cancel it").click()
        page.get_by_role("button", name="Yes").click()
        expect(page.locator("#commissioning-begin")).to_be_visible()
        assert operator not in page.evaluate("JSON.stringify({...sessionStorage, ...localStorage})")
        gateway.board.close()
