"""Re-zeroing on the dashboard: shown to everybody, done by who may, after a question, by keyboard as well."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from support.dashboard import CONTRASTS, LEAST_CONTRAST, STATUS, Watched
from support.estimates import make_estimate
from support.tare import FakePipeline, tare_desk
from support.web import Gateway, serving

from gateway.service.tare_desk import TareDesk
from gateway.web import Scope, TokenFile

playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright (dependency group browser)")
expect = playwright.expect

CALIBRATED = "that of the calibration"


@pytest.fixture
def pipeline() -> FakePipeline:
    return FakePipeline()


@pytest.fixture
def desk(tmp_path: Path, pipeline: FakePipeline) -> TareDesk:
    return tare_desk(tmp_path, pipeline)


@pytest.fixture
def gateway(tmp_path: Path, desk: TareDesk) -> Iterator[Gateway]:
    """Without tokens, for this machine."""
    with Gateway(tmp_path / "store", tare=desk) as opened:
        opened.status = STATUS
        yield opened


def history(desk: TareDesk) -> list[dict[str, object]]:
    told: list[dict[str, object]] = json.loads(desk.told())["history"]
    return told


def test_it_is_set_and_undone_after_a_question(gateway: Gateway, desk: TareDesk, watched: Watched) -> None:
    page = watched.page
    with serving(gateway.app) as server:
        page.goto(server.url)
        expect(page.locator("#tare-active")).to_have_text(CALIBRATED)
        expect(page.locator("#tare-offer")).to_contain_text("would take off +12 ± 10 kg and +1.0 ± 0.8 points")
        page.locator("#tare-set").focus()
        page.keyboard.press("Enter")
        expect(page.get_by_role("dialog", name="Make this the zero of the empty vehicle?")).to_be_visible()
        expect(page.locator("#tare-empty")).to_be_focused()
        assert [text for contrast, text in page.evaluate(CONTRASTS) if contrast < LEAST_CONTRAST] == []
        page.get_by_role("button", name="Set the zero").click()  # without the claim
        expect(page.get_by_role("dialog")).to_be_visible()
        assert history(desk) == []
        page.keyboard.press("Space")
        page.get_by_label("Note").fill("yard")
        page.keyboard.press("Enter")
        expect(page.get_by_role("dialog")).to_be_hidden()
        expect(page.locator("#tare-active")).to_contain_text("+12 ± 10 kg and +1.0 ± 0.8 points on the front axle are")
        expect(page.locator("#tare-active")).to_contain_text("by local (yard)")
        expect(page.locator("#tare-said")).to_have_text("The zero is set. It counts from the next batch on.")
        expect(page.locator("#tare-set")).to_be_focused()
        page.get_by_role("button", name="Undo the last").click()
        page.get_by_role("button", name="Undo it").click()
        expect(page.locator("#tare-active")).to_have_text(CALIBRATED)
        expect(page.get_by_role("button", name="Undo the last")).to_be_hidden()
        page.get_by_text("What was done").click()
        expect(page.locator("#tare-entries li")).to_contain_text("by local (yard); undone")
        assert watched.complaints == []
        gateway.board.close()


def test_nothing_happens_where_the_question_is_not_confirmed(
    gateway: Gateway, desk: TareDesk, watched: Watched
) -> None:
    with serving(gateway.app) as server:
        watched.page.goto(server.url)
        for end in (
            lambda: watched.page.keyboard.press("Escape"),
            watched.page.get_by_role("button", name="Cancel", exact=True).click,
        ):
            watched.page.get_by_role("button", name="Re-zero").click()
            watched.page.locator("#tare-empty").check()
            end()
            expect(watched.page.get_by_role("dialog")).to_be_hidden()
            expect(watched.page.locator("#tare-empty")).not_to_be_checked()
        assert history(desk) == []
        gateway.board.close()


def test_a_refusal_is_told_where_it_was_asked(gateway: Gateway, pipeline: FakePipeline, watched: Watched) -> None:
    page = watched.page
    with serving(gateway.app) as server:
        page.goto(server.url)
        page.get_by_role("button", name="Re-zero").click()
        page.locator("#tare-empty").check()
        pipeline.weigh(200.0)  # meanwhile
        page.get_by_role("button", name="Set the zero").click()
        expect(page.get_by_role("alert")).to_contain_text("+200.0 kg off, a tare corrects up to")
        page.get_by_role("button", name="Cancel", exact=True).click()
        gateway.publish(make_estimate(0))  # news, whatever they are
        expect(page.locator("#tare-offer")).to_contain_text("not possible: the payload is +200.0 kg off")
        expect(page.locator("#tare-set")).to_be_disabled()
        gateway.board.close()


def test_it_wants_a_token_that_may_operate_and_does_not_keep_it(
    tmp_path: Path, desk: TareDesk, watched: Watched
) -> None:
    tokens, page = TokenFile(tmp_path / "tokens.json"), watched.page
    reader, operator = tokens.create("dispatcher", Scope.READ), tokens.create("workshop", Scope.OPERATE)
    with Gateway(tmp_path / "store", tokens=tokens, tare=desk) as gateway, serving(gateway.app) as server:
        gateway.status = STATUS
        page.goto(server.url)
        page.get_by_label("Token", exact=True).fill(reader)
        page.keyboard.press("Enter")
        page.get_by_role("button", name="Re-zero").click()
        page.locator("#tare-empty").check()
        page.get_by_role("button", name="Set the zero").click()
        expect(page.get_by_role("alert")).to_have_text("this needs a token with scope operate")
        assert history(desk) == []
        page.get_by_label("Token that may operate, used this once").fill(operator)
        page.get_by_role("button", name="Set the zero").click()
        expect(page.locator("#tare-active")).to_contain_text("by workshop")
        assert page.evaluate("Object.values({...sessionStorage, ...localStorage})") == [reader]
        assert page.evaluate("document.getElementById('tare-token-text').value") == ""
        assert not any("spr_" in address for address in watched.addresses)
        gateway.board.close()
        gateway.board.close()
