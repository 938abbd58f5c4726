"""Alarms on the dashboard: shown to everybody, acknowledged by who may, by keyboard as well."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.absent import of_no_vehicle
from support.alarms import LIMIT_KG, AlarmBench, of_load
from support.browser import expect
from support.dashboard import CONTRASTS, LEAST_CONTRAST, STATUS, Watched
from support.web import serving

from gateway.status import DeadLetter, WebhookStatus
from gateway.web.access.tokens import Scope, TokenFile
from gateway.web.app import create_app

OVER = LIMIT_KG + 60.0
WEBHOOK = WebhookStatus(
    "https://fleet.example:443",
    n_waiting=3,
    waiting_age_s=7200.0,
    n_dead=1,
    dead=(DeadLetter("alarm-1-a-1", "answered 422", "2026-11-22T08:00:00.000000Z"),),
    last_fault="https://fleet.example:443 answered 500",
)


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[AlarmBench]:
    made = AlarmBench(tmp_path / "store")
    yield made
    made.store.close()


def app_of(bench: AlarmBench, tokens: TokenFile | None = None) -> Any:
    status = STATUS.model_copy(update={"webhook": WEBHOOK})
    parts = of_no_vehicle(bench.store.path.parent, bench.store) | {"alarms": bench.desk}
    return create_app(bench.board, bench.store.reader(), lambda: status, tokens=tokens, **parts)


def test_an_alarm_comes_by_the_stream_and_is_acknowledged_by_keyboard(bench: AlarmBench, watched: Watched) -> None:
    page = watched.page
    with serving(app_of(bench)) as server:
        page.goto(server.url)
        expect(page.locator("#link")).to_have_text("live")
        expect(page.locator("#alarms")).to_be_hidden()
        bench.weigh(of_load(0, OVER))
        alarm = page.locator("#alarms-open li")
        expect(alarm).to_contain_text("Early warning: Whole vehicle: 2,560 ± 27 kg, limit 2,500 kg.")
        button = page.get_by_role("button", name="Acknowledge: Whole vehicle: 2,560")
        button.focus()
        bench.weigh(of_load(1, OVER, n_batches=2))
        expect(alarm).to_contain_text("Confirmed: Whole vehicle: 2,560")
        expect(button).to_be_focused()
        assert [text for contrast, text in page.evaluate(CONTRASTS) if contrast < LEAST_CONTRAST] == []
        page.keyboard.press("Enter")
        expect(page.get_by_role("dialog", name="Acknowledge this alarm?")).to_be_visible()
        expect(page.get_by_label("What is done about it")).to_be_focused()
        assert [text for contrast, text in page.evaluate(CONTRASTS) if contrast < LEAST_CONTRAST] == []
        page.get_by_label("What is done about it").fill("two pallets come off")
        page.keyboard.press("Enter")
        expect(page.get_by_role("dialog")).to_be_hidden()
        expect(alarm).to_contain_text("acknowledged by local")
        expect(alarm).to_contain_text("(two pallets come off)")
        expect(alarm.get_by_role("button")).to_have_count(0)
        expect(page.locator("#alarms-said")).to_have_text("Acknowledged.")
        bench.weigh(of_load(2, 100.0))
        expect(page.locator("#alarms")).to_be_hidden()  # what ended leaves the top
        expect(page.locator("#alarms-entries li")).to_contain_text("Ended: Whole vehicle: 2,560")
        assert [said for said in watched.complaints if "ERR_FAILED" not in said] == []
        bench.board.close()


def test_one_that_ended_unseen_is_still_there_until_somebody_has_seen_it(bench: AlarmBench, watched: Watched) -> None:
    for n, kg in enumerate((OVER, 100.0, OVER, 100.0)):
        bench.weigh(of_load(n, kg))
    page = watched.page
    with serving(app_of(bench)) as server:
        page.goto(server.url)
        expect(page.locator("#alarms-entries li")).to_have_count(2)
        expect(page.locator("#alarms")).to_be_hidden()
        expect(page.locator("#alarms-unseen")).to_have_text("1 not acknowledged")  # the earlier one no more can be
        page.get_by_role("button", name="Acknowledge:").click()
        page.get_by_role("button", name="Not yet").click()
        expect(page.locator("#alarms-unseen")).to_have_text("1 not acknowledged")
        page.get_by_role("button", name="Acknowledge:").click()
        page.get_by_role("button", name="Acknowledge", exact=True).click()
        expect(page.locator("#alarms-unseen")).to_be_hidden()
        expect(page.locator("#alarms-past-title")).to_be_focused()
        bench.board.close()


def test_it_wants_a_token_that_may_operate(tmp_path: Path, bench: AlarmBench, watched: Watched) -> None:
    tokens, page = TokenFile(tmp_path / "tokens.json"), watched.page
    reader, operator = tokens.create("dispatcher", Scope.READ), tokens.create("yard", Scope.OPERATE)
    bench.weigh(of_load(0, OVER))
    with serving(app_of(bench, tokens)) as server:
        page.goto(server.url)
        page.get_by_label("Token", exact=True).fill(reader)
        page.keyboard.press("Enter")
        page.get_by_role("button", name="Acknowledge:").click()
        page.get_by_role("button", name="Acknowledge", exact=True).click()
        expect(page.locator("#alarm-refusal")).to_contain_text("scope operate")
        page.get_by_label("Acknowledger's token").fill(operator)
        page.get_by_role("button", name="Acknowledge", exact=True).click()
        expect(page.locator("#alarms-open li")).to_contain_text("acknowledged by yard")
        expect(page.get_by_label("Acknowledger's token")).to_have_value("")
        bench.board.close()


def test_it_says_how_the_webhook_is(bench: AlarmBench, watched: Watched) -> None:
    with serving(app_of(bench)) as server:
        watched.page.goto(server.url)
        bus = watched.page.locator("#bus")
        expect(bus).to_contain_text("fails: https://fleet.example:443 answered 500; 3 waiting, the oldest for 2.0 h")
        expect(bus).to_contain_text("Messages it refused")
        bench.board.close()
