"""The wizard in a real browser: from the offer to the calibration, on a page as wide as a phone."""

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
from gateway.calibration.commissioning.job import Result
from gateway.stated.commissioning import FindingTold
from support.browser import expect
from support.commissioning import ANSWERS, NOW_NS, Bench, fitted, in_steps, replaced
from support.dashboard import CONTRASTS, LEAST_CONTRAST, STATUS, Look, Watched
from support.estimates import make_estimate
from support.web import Gateway, serving

from gateway.calibration.file.calibration_file import CalibrationFile
from gateway.records import Why
from gateway.stated.doubt import Doubt, DoubtKind
from gateway.stated.facts import VehicleAnswers
from gateway.units import NS_PER_S
from gateway.web.access.tokens import Scope, TokenFile

FAULT = FindingTold(
    kind="pitch_rate_sign", severity="fault", text="the pitch rate is turned over", advice="set sign = -1"
)
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
    page.get_by_label("How long the load is along the floor").fill("2.4")
    page.get_by_label("Part of it may be on the roof").check()


def fill(page: Any, *answers: str) -> None:
    """The vehicle's form."""
    for label, said in zip(
        ("Under the front axle", "Under the rear axle", "Wheelbase", "Sensor behind"), answers, strict=True
    ):
        page.get_by_label(label).fill(said)


def test_a_fitter_walks_through_it(gateway: Gateway, bench: Bench, browser: Any) -> None:
    watched = Watched(browser, **PHONE)
    page = watched.page
    with serving(gateway.app) as server:
        page.goto(server.url)
        expect(page.locator("#commissioning-said")).to_contain_text("This vehicle is not calibrated.")
        page.get_by_role("button", name="Commission …").click()
        expect(page.get_by_label("Under the front axle [kg]")).to_be_visible()
        assert [text for contrast, text in page.evaluate(CONTRASTS) if contrast < LEAST_CONTRAST] == []
        fill(page, "690", "20", "2.75", "1.2")
        page.get_by_role("button", name="Next").click()
        expect(page.locator("#commissioning-refusal")).to_contain_text("unsprung masses")
        page.get_by_label("Under the rear axle").fill("710")
        say_what_is_carried(page)
        page.get_by_role("button", name="Next").click()
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
        expect(page.locator("#commissioning-learned")).to_contain_text("50 % of the goal")
        assert page.locator("#commissioning-progress").evaluate("(bar) => bar.value") == 0.5
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        bench.drive(2)
        bench.worker.finish(fitted(payload_std_kg=15.0))
        news(gateway, watched)
        expect(page.locator("#commissioning-said")).to_contain_text("It counts from the next drive on")
        expect(page.locator("#commissioning-in-use")).to_contain_text("like any vehicle, from 2 windows")
        assert watched.complaints == [] or all("409" in said for said in watched.complaints)
        gateway.board.close()
    page.close()


def test_what_was_made_is_undone_after_a_question(bench: Bench, watched: Watched, dashboard: Look) -> None:
    in_steps(bench)
    for n in range(2):
        bench.drive(n)
    bench.worker.finish(fitted())
    page = dashboard()
    expect(page.locator("#commissioning-in-use")).to_contain_text("van-17, like any vehicle, from 2 windows")
    page.locator("#commissioning-undo").click()
    page.get_by_role("button", name="Yes").click()
    expect(page.locator("#commissioning-in-use")).to_contain_text("the one named in the settings")
    page.get_by_text("What was made here").click()
    expect(page.locator("#commissioning-entries li")).to_contain_text("undone")
    assert watched.complaints == []


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


CONTRADICTED = Doubt.of(
    DoubtKind.DRIVEN_WEIGHT,
    front_kg=823.0, front_95_kg=59.0, rear_kg=1010.0, rear_95_kg=56.0, said_front_kg=713.0, said_rear_kg=704.0,
)  # fmt: skip
ENGLISH = re.compile(
    r"\b(the|and|not|of|load|window|windows|known|axle|drive|driven|vehicle|by|back|undone)\b", re.IGNORECASE
)


@pytest.fixture
def with_sister(tmp_path: Path) -> Iterator[tuple[Gateway, Bench]]:
    """A sister: 700 kg on each axle, 2.8 m from axle to axle, 900 kg of payload."""
    sister = json.loads((Path(str(files("gateway"))) / "demo" / "paper_van.json").read_text())
    sister["vehicle"] |= {
        "payload_range_kg": [0.0, 900.0], "track_width_m": 1.6, "kerb_front_axle_kg": 700.0, "kerb_rear_axle_kg": 700.0,
    }  # fmt: skip
    held = CalibrationFile.model_validate({key: part for key, part in sister.items() if key != "id"})
    bench = Bench(tmp_path / "service", replaced(sister=replace(held.vehicle, name="van-16")))
    with Gateway(tmp_path / "store", commissioning=bench.desk) as opened:
        opened.status = STATUS.model_copy(update={"calibration_id": None})
        yield opened, bench


def typed_into(page: Any, **answers: str) -> None:
    for name, answer in answers.items():
        page.locator(f"#commissioning-vehicle [name={name}]").fill(answer)


def in_order(page: Any, locale: str) -> None:
    """No English where German is spoken, contrast, and no sideways scrolling."""
    card = page.locator("#commissioning")
    if locale.startswith("de"):
        said = card.inner_text().replace("van-17", "").replace("van-16", "").splitlines()
        assert [line for line in said if ENGLISH.search(line)] == []
    assert [text for contrast, text in page.evaluate(CONTRASTS) if contrast < LEAST_CONTRAST] == []
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


@pytest.fixture(params=[("en-GB", "light", 1400), ("de-DE", "dark", 390)], ids=["desk", "phone in German"])
def seen(request: pytest.FixtureRequest, browser: Any) -> Iterator[tuple[Watched, str]]:
    """A page on a wide desk, and one on a phone in German and in the dark; with its locale."""
    locale, scheme, width = request.param
    made = Watched(browser, locale=locale, color_scheme=scheme, viewport={"width": width, "height": 900})
    made.page.route("**/plotly-*", lambda route: route.abort())
    yield made, locale
    assert [said for said in made.complaints if "ERR_FAILED" not in said] == []
    made.page.close()


def test_unlikely_answers_are_asked_about_and_nothing_typed_is_lost(
    with_sister: tuple[Gateway, Bench], seen: tuple[Watched, str]
) -> None:
    gateway, _ = with_sister
    page, locale = seen[0].page, seen[1]
    with serving(gateway.app) as server:
        page.goto(server.url)
        page.locator("#commissioning-begin").click()
        sign = "," if locale.startswith("de") else "."
        typed_into(page, kerb_front_axle_kg=f"71{sign}3", kerb_rear_axle_kg="704", sensor_position_m="3.2")
        typed_into(page, wheelbase_m=f"2{sign}8", track_width_m=f"1{sign}6")
        page.reload()  # what was typed and not sent is there again
        expect(page.locator("[name=kerb_front_axle_kg]")).to_have_value(f"71{sign}3")
        expect(page.locator("[name=track_width_m]")).to_have_value(f"1{sign}6")
        page.locator("#commissioning-vehicle .go").click()
        expect(page.locator("#commissioning-meant")).to_contain_text("713 kg")
        in_order(page, locale)
        page.locator("#commissioning-meant").click()
        expect(page.locator("#commissioning-claim")).to_be_visible()
        expect(page.locator("#commissioning-doubts")).to_be_hidden()
        expect(page.locator("#commissioning-entered")).to_contain_text("713")
        page.locator("#commissioning-empty .back").click()
        expect(page.locator("[name=kerb_front_axle_kg]")).to_have_value("713")
        page.locator("#commissioning-vehicle .go").click()
        expect(page.locator("#commissioning-claim")).to_be_visible()
        gateway.board.close()


def test_a_drive_that_contradicts_is_asked_about_and_the_end_says_how_good_it_is(
    with_sister: tuple[Gateway, Bench], seen: tuple[Watched, str]
) -> None:
    gateway, bench = with_sister
    watched, locale = seen
    page = watched.page
    bench.desk.begin("workshop", None)
    bench.desk.state_vehicle(VehicleAnswers(**{**ANSWERS, "wheelbase_m": 2.8}))
    with serving(gateway.app) as server:
        page.goto(server.url)
        page.locator("#commissioning-claim").check()
        page.locator("#commissioning-empty .go").click()
        expect(page.locator("#commissioning-fit")).to_be_visible()
        bench.drives.drive_start_ns = NOW_NS
        bench.drives.open_window_ns = (NOW_NS, NOW_NS + 50 * NS_PER_S)
        news(gateway, watched)
        expect(page.locator("#commissioning-window")).to_contain_text("4:")
        bench.drive(1)
        bench.worker.finish(fitted(payload_std_kg=15.0).model_copy(update={"doubts": (CONTRADICTED,)}))
        bench.drive(2)
        bench.worker.finish(fitted(payload_std_kg=15.0).model_copy(update={"doubts": (CONTRADICTED,)}))
        news(gateway, watched)
        expect(page.locator("#commissioning-asked")).to_contain_text("823")
        in_order(page, locale)
        page.locator("#commissioning-again").click()
        page.locator("#commissioning-yes").click()
        expect(page.locator("#commissioning-doubts")).to_be_hidden()
        for n in (3, 4):
            bench.drive(n)
            bench.worker.finish(fitted(payload_std_kg=15.0))
        news(gateway, watched)
        expect(page.locator("#commissioning-reached")).to_contain_text("± 29")
        expect(page.locator("#commissioning-better")).to_be_visible()
        in_order(page, locale)
        page.locator("#commissioning-undo").click()
        expect(page.locator("#commissioning-effect")).to_contain_text("van-17")
        page.locator("#commissioning-yes").click()
        expect(page.locator("#commissioning-said")).to_contain_text("van-17")
        expect(page.locator("#commissioning-said")).to_contain_text("van-16")
        in_order(page, locale)
        gateway.board.close()


def test_by_keyboard_alone(with_sister: tuple[Gateway, Bench], watched: Watched) -> None:
    """Every step is taken, and taken back, without a pointer."""
    gateway, _ = with_sister
    page = watched.page

    def press(selector: str) -> None:
        page.locator(selector).focus()
        assert page.evaluate("document.activeElement.matches(':focus-visible')")
        page.keyboard.press("Enter")

    with serving(gateway.app) as server:
        page.goto(server.url)
        expect(page.locator("#commissioning-begin")).to_be_visible()
        page.keyboard.press("Tab")  # from here on the browser takes us for a keyboard
        press("#commissioning-begin")
        expect(page.locator("[name=kerb_front_axle_kg]")).to_be_visible()
        page.locator("[name=kerb_front_axle_kg]").focus()
        for answer in ("404", "1013", "2.8"):
            page.keyboard.type(answer)
            page.keyboard.press("Tab")
        page.keyboard.type("3.2")
        page.keyboard.press("Enter")
        expect(page.locator("#commissioning-asked")).to_contain_text("29 % of the empty weight on the front axle")
        press("#commissioning-confirm")
        expect(page.locator("#commissioning-claim")).to_be_visible()
        expect(page.locator("#commissioning-entered")).to_contain_text("Confirmed though unusual")
        press("#commissioning-empty .back")
        expect(page.locator("[name=kerb_front_axle_kg]")).to_be_focused()
        assert [said for said in watched.complaints if "ERR_FAILED" not in said] == []
        gateway.board.close()


def test_meanwhile_the_load_says_that_it_is_being_calibrated(gateway: Gateway, bench: Bench, dashboard: Look) -> None:
    gateway.publish(make_estimate(0, Why.NO_CALIBRATION))
    in_steps(bench)
    page = dashboard()
    expect(page.locator("#note")).to_contain_text("the vehicle is being calibrated")
    expect(page.locator("#note")).not_to_contain_text("springscale")
    expect(page.locator("#rejected")).not_to_contain_text("springscale", use_inner_text=False)
