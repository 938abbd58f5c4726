"""The dashboard must not show an old number as new, "no batch" that nobody counted, or another batch's load."""

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from support.browser import expect
from support.dashboard import STATUS, Look, Watched, demo_calibration, weighed
from support.estimates import make_estimate
from support.web import Gateway, serving

from gateway.records import Why
from gateway.status import State

PHONE: dict[str, Any] = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
MOST_SCREENS_ON_A_PHONE = 3.0


@pytest.fixture
def gateway(tmp_path: Path) -> Iterator[Gateway]:
    with Gateway(tmp_path / "store", calibrated=demo_calibration()) as opened:
        opened.status = STATUS
        yield opened


@pytest.mark.parametrize("options", [{"viewport": {"width": 1240, "height": 800}}, PHONE], ids=["laptop", "phone"])
def test_the_state_stays_in_view(site: str, browser: Any, options: dict[str, Any]) -> None:
    page = browser.new_page(**options)
    page.goto(site)
    expect(page.locator("#payload-chart[data-drawn]")).to_be_visible()
    page.locator("footer").scroll_into_view_if_needed()
    assert page.evaluate("scrollY") > 400
    expect(page.locator("#state")).to_be_in_viewport(ratio=1.0)
    page.close()


def test_a_number_that_nobody_confirms_is_grey(gateway: Gateway, watched: Watched) -> None:
    page = watched.page
    gateway.publish(weighed(0, 270.0, 48.0, demo_calibration()))
    with serving(gateway.app) as server:
        page.goto(server.url)
        expect(page.locator("#payload")).to_have_text("270 kg")
        fresh = page.evaluate(NUMBERS_COLOUR)
        gateway.board.close()
    expect(page.locator("#state-name")).to_have_text("Offline")
    assert page.evaluate(NUMBERS_COLOUR) != fresh
    expect(page.locator("#van")).to_have_class(re.compile("stale"))


NUMBERS_COLOUR = "getComputedStyle(document.getElementById('payload')).color"


def test_without_scripts_it_shows_where_the_numbers_are_and_claims_nothing(site: str, browser: Any) -> None:
    page = browser.new_page(java_script_enabled=False)
    page.goto(site)
    seen = page.locator("body").inner_text()
    assert "This page needs JavaScript. The numbers are at /api/v1/estimates/latest." in seen
    assert not re.search("no batch|none|unknown|loading|connecting|asking", seen, re.IGNORECASE), seen
    page.close()


def test_the_reason_is_shown_in_place_of_a_refused_number(gateway: Gateway, dashboard: Look) -> None:
    gateway.status = STATUS.model_copy(update={"state": State.COLLECTING})
    gateway.publish(make_estimate(0, Why.TOO_SLOW))
    page = dashboard()
    note = page.locator("#note")
    expect(note).to_contain_text("No estimate yet. The last batch could not be weighed: too slow.")
    expect(note).to_contain_text("What to do: nothing; an open road is enough.")


def test_a_vehicle_that_is_not_taught_is_sent_to_teach_and_not_to_a_command(gateway: Gateway, dashboard: Look) -> None:
    gateway.status = STATUS.model_copy(update={"calibration_id": None})
    gateway.publish(make_estimate(0, Why.NO_CALIBRATION))
    page = dashboard()
    expect(page.locator("#note")).to_contain_text("the vehicle is not taught yet. “Teach” says what comes next.")
    expect(page.locator("#note")).not_to_contain_text("springscale")
    page.get_by_role("link", name="For engineers").click()
    expect(page.locator("#rejected")).to_contain_text("the vehicle is not taught yet", use_inner_text=False)
    expect(page.locator("#rejected")).not_to_contain_text("springscale", use_inner_text=False)


def test_a_refused_batch_casts_doubt_on_the_number_before_it_and_on_early_ones(
    gateway: Gateway, dashboard: Look
) -> None:
    calibrated = demo_calibration()
    gateway.publish(weighed(0, 270.0, 48.0, calibrated), make_estimate(1, Why.TOO_SLOW))
    page = dashboard()
    expect(page.locator("#payload")).to_have_text("270 kg")
    expect(page.locator("#note")).to_be_hidden()  # of the road: nothing against it
    gateway.publish(make_estimate(2, Why.MODEL_MISFIT))
    expect(page.locator("#note")).to_contain_text("could not be weighed: model misfit. This number may be wrong")
    gateway.board.publish(replace(weighed(4, 270.0, 48.0, calibrated), is_provisional=True))
    expect(page.locator("#note")).to_contain_text("Early value")
    expect(page.locator("#note")).to_contain_text("model misfit")
    gateway.publish(weighed(4, 270.0, 48.0, calibrated))
    expect(page.locator("#note")).to_be_hidden()


def test_a_load_is_not_drawn_with_the_payload_of_another_estimate(
    gateway: Gateway, watched: Watched, dashboard: Look
) -> None:
    """A negative payload came before its weights did: the radius was the square root of a negative number."""
    calibrated = demo_calibration()
    gateway.publish(weighed(0, 270.0, 48.0, calibrated))
    page = dashboard()
    expect(page.locator("#van circle.load")).to_have_count(1)
    gateway.publish(weighed(1, -14.0, 50.0, calibrated))
    expect(page.locator("#payload")).to_have_text("−14 kg")
    expect(page.locator("#van circle.load")).to_have_count(0)
    assert [said for said in watched.complaints if "attribute" in said] == []


def test_a_phone_shows_the_load_and_folds_the_rest(site: str, browser: Any) -> None:
    watched = Watched(browser, **PHONE)
    page = watched.page
    page.goto(site)
    expect(page.locator("#payload-chart[data-drawn]")).to_be_visible()
    assert page.evaluate("document.documentElement.scrollHeight / innerHeight") < MOST_SCREENS_ON_A_PHONE
    assert page.evaluate("document.documentElement.scrollWidth") <= PHONE["viewport"]["width"]
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
