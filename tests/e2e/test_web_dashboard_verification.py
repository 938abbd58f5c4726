"""Known loads on the dashboard: judged after a question, the record shown, saved and announced as due."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from gateway.service.verification.verification import VerificationService
from support.browser import expect
from support.dashboard import CONTRASTS, LEAST_CONTRAST, STATUS, Look, Watched
from support.epochs import drive_of, stored
from support.verification import CALIBRATED, verification_desk
from support.web import Gateway, serving

from gateway.store import Store


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    """A drive weighed as 112 kg; browser and stamps are in UTC."""
    opened = stored(tmp_path / "weighed", drive_of(3, 112.0, calibration_id=CALIBRATED.id))
    yield opened
    opened.close()


@pytest.fixture
def desk(tmp_path: Path, store: Store) -> VerificationService:
    return verification_desk(tmp_path, store, every_days=30.0)


@pytest.fixture
def gateway(tmp_path: Path, desk: VerificationService) -> Iterator[Gateway]:
    with Gateway(tmp_path / "store", verification=desk) as opened:
        opened.status = STATUS
        yield opened


def test_a_known_load_is_judged_after_a_question(desk: VerificationService, watched: Watched, dashboard: Look) -> None:
    page = dashboard()
    dialog = page.locator("#known-dialog")
    expect(page.locator("#verified-last")).to_have_text("never")
    expect(page.locator("#verified-due")).to_have_text("now")
    page.get_by_role("button", name="Verify with a known load").click()
    expect(page.get_by_role("dialog", name="What do you know about the load?")).to_be_visible()
    assert [text for contrast, text in page.evaluate(CONTRASTS) if contrast < LEAST_CONTRAST] == []
    dialog.get_by_label("Known is").select_option("payload")
    expect(dialog.get_by_label("Gross weight [kg]")).to_be_hidden()
    page.get_by_role("button", name="Judge and keep").click()  # nothing typed
    expect(page.get_by_role("dialog")).to_be_visible()
    dialog.get_by_label("Payload [kg]").fill("100")
    dialog.get_by_label("When it was so").fill("2020-01-01T00:00")
    page.get_by_role("button", name="Judge and keep").click()
    expect(page.get_by_role("alert").filter(has_text="no load was weighed around 2020-01-01T00:00Z")).to_be_visible()
    assert json.loads(desk.state())["history"] == []
    dialog.get_by_label("When it was so").fill("2026-09-21T14:15")  # within the drive
    page.get_by_role("button", name="Add another load").click()
    expect(page.locator("#known-listed")).to_have_text("1 more in this record.")
    dialog.get_by_label("Payload [kg]").fill("112")
    dialog.get_by_label("Remark, kept with it").fill("yard")
    page.keyboard.press("Enter")
    expect(page.get_by_role("dialog")).to_be_hidden()
    expect(page.locator("#verified-last")).to_contain_text("by local: passed; 100 kg on board was weighed +12")
    expect(page.locator("#verified-last")).to_contain_text("112 kg on board was weighed 0")
    expect(page.locator("#verified-due")).to_contain_text("on 21 Oct")
    page.get_by_text("Records").click()
    with page.expect_download() as download:
        page.get_by_role("button", name="Save the page of").click()
    assert "Verification of on-board weighing" in Path(download.value.path()).read_text()
    (record,) = json.loads(desk.state())["history"]
    assert (len(record["loads"]), record["note"]) == (2, "yard")
    refusals = [said for said in watched.complaints if "409" not in said]
    assert refusals == []


def test_a_decimal_comma_is_a_comma_in_german_and_refused_in_english(gateway: Gateway, browser: Any) -> None:
    """A field of type "number" made 15 of a typed "1,5" where the browser itself is English."""
    with serving(gateway.app) as server:
        for locale, typed, is_valid in (
            ("de-DE", "1240,5", True),
            ("de-DE", "1240.5", True),
            ("de-DE", "1.240,5", False),
            ("en-GB", "1240.5", True),
            ("en-GB", "1,240.5", False),
        ):
            page = browser.new_page(locale=locale)
            page.goto(server.url)
            page.locator("#known-add").click()
            field = page.locator("[name=gross_kg]")
            field.press_sequentially(typed)
            assert field.evaluate("field => field.validity.valid") == is_valid
            if is_valid:
                with page.expect_request(lambda asked: asked.method == "POST") as sent:
                    page.locator("#known-confirm").click()
                assert sent.value.post_data_json["loads"][0]["gross_kg"] == 1240.5
            page.close()
        gateway.board.close()


def test_what_was_mistyped_for_another_kind_of_weight_does_not_block_the_form(
    gateway: Gateway, watched: Watched
) -> None:
    page = watched.page
    with serving(gateway.app) as server:
        page.goto(server.url)
        page.locator("#known-add").click()
        page.locator("[name=gross_kg]").fill("12 tons")
        page.locator("#known-by").select_option("payload")
        page.locator("[name=payload_kg]").fill("100")
        with page.expect_request(lambda asked: asked.method == "POST") as sent:
            page.locator("#known-confirm").click()
        assert sent.value.post_data_json["loads"] == [{"by": "payload", "payload_kg": 100.0}]
        gateway.board.close()
