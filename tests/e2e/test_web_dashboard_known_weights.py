"""Known weights on the dashboard: shown to everybody, stated by who may, after a question, by keyboard as well."""

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from support.browser import expect
from support.dashboard import CONTRASTS, LEAST_CONTRAST, STATUS, Look, Watched
from support.estimates import make_estimate
from support.known_weights import KnownWeightBench, with_all_sources
from support.web import Gateway, serving

from gateway.budget import BudgetLine, budget_of
from gateway.web.access.tokens import Scope, TokenFile

NONE = "none: weighed by the calibration alone"


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[KnownWeightBench]:
    made = KnownWeightBench(tmp_path / "vehicle", 276.0, 398.0)
    yield made
    made.store.close()


@pytest.fixture
def gateway(tmp_path: Path, bench: KnownWeightBench) -> Iterator[Gateway]:
    """Without tokens, for this machine."""
    with Gateway(tmp_path / "store", known_weights=bench.service) as opened:
        opened.status = STATUS
        yield opened


def test_empty_now_is_stated_and_taken_back_after_a_question(
    bench: KnownWeightBench, watched: Watched, dashboard: Look
) -> None:
    page = dashboard()
    expect(page.locator("#weights-in-use")).to_have_text(NONE)
    expect(page.locator("#weights-offer")).to_contain_text("possible for the load weighed as 12 ± ")
    page.locator("#weights-empty").focus()
    page.keyboard.press("Enter")
    expect(page.get_by_role("dialog", name="The vehicle is empty now?")).to_be_visible()
    expect(page.locator("#weights-claimed")).to_be_focused()
    assert [text for contrast, text in page.evaluate(CONTRASTS) if contrast < LEAST_CONTRAST] == []
    page.get_by_role("button", name="It is empty", exact=True).click()  # without the claim
    expect(page.get_by_role("dialog")).to_be_visible()
    assert bench.state()["history"] == []
    page.keyboard.press("Space")
    page.get_by_label("Note").fill("yard")
    page.keyboard.press("Enter")
    expect(page.get_by_role("dialog")).to_be_hidden()
    expect(page.locator("#weights-in-use")).to_have_text("1; without them the error of estimates is +12 kg")
    expect(page.locator("#weights-said")).to_have_text("Kept. It counts from the next batch on.")
    page.get_by_text("All stated weights").click()
    expect(page.locator("#weights-entries li")).to_contain_text("empty: 0 ± 20 kg known, 12 ± ")
    expect(page.locator("#weights-entries li")).to_contain_text("by local (yard); in use")
    page.get_by_role("button", name="Take back: empty").click()
    page.get_by_role("button", name="Take it back").click()
    expect(page.locator("#weights-in-use")).to_have_text(NONE)
    expect(page.locator("#weights-entries li")).to_contain_text("taken back")
    assert watched.complaints == []


def test_a_ticket_that_contradicts_is_shown_with_both_numbers_and_confirmed(
    bench: KnownWeightBench, watched: Watched, dashboard: Look
) -> None:
    page = dashboard()
    page.get_by_role("button", name="State a known weight").click()
    dialog = page.locator("#known-dialog")
    expect(dialog).to_contain_text("A known weight that contradicts its estimate waits for a confirmation")
    expect(dialog.get_by_role("button", name="Add another load")).to_be_hidden()
    dialog.get_by_label("It comes from").select_option("delivery_note")
    dialog.get_by_label("Known is").select_option("payload")
    dialog.get_by_label("Payload [kg]").fill("400")
    dialog.get_by_label("Error of each number").fill("2")
    dialog.get_by_label("When it was so").fill(bench.stated(0, 400.0).at[:16])
    page.keyboard.press("Enter")
    expect(dialog).to_be_hidden()
    expect(page.locator("#weights-said")).to_have_text("Kept.")
    held = page.locator("#weights-held li")
    expect(held).to_contain_text("delivery note: 400 ± 4 kg known, 276 ± ")
    expect(held).to_contain_text("waits for a confirmation")
    expect(page.locator("#weights-in-use")).to_have_text(NONE)
    page.get_by_role("button", name="Confirm: delivery note").click()
    expect(page.get_by_role("dialog", name="Is it really 400 ± 4")).to_contain_text("The load was weighed as 276 ± ")
    page.get_by_role("button", name="The known weight is right").click()
    expect(page.locator("#weights-in-use")).to_have_text("1; without them the error of estimates is −124 kg")
    expect(held).to_have_count(0)
    assert watched.complaints == []


def test_nothing_happens_where_the_question_is_not_confirmed(bench: KnownWeightBench, dashboard: Look) -> None:
    page = dashboard()
    for end in (
        lambda: page.keyboard.press("Escape"),
        page.get_by_role("button", name="Cancel", exact=True).click,
    ):
        page.locator("#weights-empty").click()
        page.locator("#weights-claimed").check()
        end()
        expect(page.get_by_role("dialog")).to_be_hidden()
        expect(page.locator("#weights-claimed")).not_to_be_checked()
    assert bench.state()["history"] == []


def test_a_refusal_is_told_where_it_was_asked(gateway: Gateway, bench: KnownWeightBench, dashboard: Look) -> None:
    page = dashboard()
    page.locator("#weights-empty").click()
    page.locator("#weights-claimed").check()
    bench.pipeline.age_s = 1000.0  # meanwhile
    page.get_by_role("button", name="It is empty", exact=True).click()
    expect(page.get_by_role("alert")).to_contain_text("it was weighed 1000 s ago")
    page.get_by_role("button", name="Cancel", exact=True).click()
    gateway.publish(make_estimate(0))  # news, whatever they are
    expect(page.locator("#weights-offer")).to_contain_text("Not possible: the last weighing is too old.")
    expect(page.locator("#weights-empty")).to_be_disabled()


def test_it_wants_a_token_that_may_operate_and_does_not_keep_it(
    tmp_path: Path, bench: KnownWeightBench, watched: Watched
) -> None:
    tokens, page = TokenFile(tmp_path / "tokens.json"), watched.page
    reader, operator = tokens.create("dispatcher", Scope.READ), tokens.create("workshop", Scope.OPERATE)
    opened = Gateway(tmp_path / "store", tokens=tokens, known_weights=bench.service)
    with opened as gateway, serving(gateway.app) as server:
        gateway.status = STATUS
        page.goto(server.url)
        page.get_by_label("Token", exact=True).fill(reader)
        page.keyboard.press("Enter")
        page.locator("#weights-empty").click()
        page.locator("#weights-claimed").check()
        page.get_by_role("button", name="It is empty", exact=True).click()
        expect(page.get_by_role("alert")).to_have_text("this needs a token with scope operate")
        assert bench.state()["history"] == []
        page.get_by_role("dialog").get_by_label("Token with scope operate, used once").fill(operator)
        page.get_by_role("button", name="It is empty", exact=True).click()
        expect(page.get_by_role("dialog")).to_be_hidden()
        assert json.loads(bench.service.state())["history"][0]["by"] == "workshop"
        assert page.evaluate("Object.values({...sessionStorage, ...localStorage})") == [reader]
        assert page.evaluate("document.getElementById('weights-token-text').value") == ""
        assert not any("spr_" in address for address in watched.addresses)
        gateway.board.close()


def test_why_an_estimate_is_uncertain_is_said_largest_source_first(
    gateway: Gateway, watched: Watched, dashboard: Look
) -> None:
    posterior = with_all_sources(300.0)
    budget = budget_of(posterior, is_shape_said=False)
    of_grams = replace(budget[-1], payload_kg=0.2)
    gateway.publish(replace(make_estimate(0).answered(posterior), error_budget=(*budget, of_grams)))
    page = dashboard()
    half = round(1.96 * posterior.std(0))
    expect(page.locator("#budget-why")).to_have_text(f"Why ± {half} kg?")
    expect(page.locator("#budget")).to_have_attribute("open", "")  # there is room for it
    first = page.locator("#budget-lines li").first
    expect(first).to_have_text(re.compile(r"vehicle's loads\s*±\s43\skg"))
    remedies = page.locator("#budget-remedies li")
    said = remedies.all_inner_texts()
    assert len({*said}) == len(said) == len({line.remedy for line in budget if helps(line, posterior.std(0))})
    expect(page.locator("#budget-remedies")).to_contain_text("State in the vehicle's data what it carries")
    expect(remedies.first).to_contain_text(f"± {half} kg becomes ± ")
    assert page.locator("#budget-lines li").count() == sum(line.payload_kg > 0.0 for line in budget)  # no ± 0 kg
    assert [text for contrast, text in page.evaluate(CONTRASTS) if contrast < LEAST_CONTRAST] == []
    assert [said for said in watched.complaints if "ERR_FAILED" not in said] == []  # the charts' library


def helps(line: BudgetLine, std_kg: float) -> bool:
    """What a remedy leaves is another number than what stands now, as the page rounds both."""
    then_kg = line.payload_with_remedy_kg
    return line.remedy is not None and round(1.96 * then_kg) != round(1.96 * std_kg)
