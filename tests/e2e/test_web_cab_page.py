"""The cab page on a phone: what may go in, how sure and how old that is, and what it cannot see."""

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from support.browser import expect
from support.cab import BEFORE, VAN, cab_gateway, load_event, loaded, vaguely_loaded
from support.dashboard import CONTRASTS, LEAST_CONTRAST, Look, Watched
from support.web import Gateway, serving

from gateway.estimates.as_json import estimate_to_json
from gateway.records import Why, json_line
from gateway.status import AlarmsStatus, OwnReading, Standing, State
from gateway.web.access.tokens import Scope, TokenFile

PHONE: dict[str, Any] = {"viewport": {"width": 390, "height": 844}, "is_mobile": True, "has_touch": True}
HURRIED = "{ const set = setInterval; window.setInterval = (draw, ms) => set(draw, ms / 20); }"  # nobody has to wait
LEAST_NUMBER_PX = 70  # read at arm's length: 70 CSS pixels are about 11 mm on a phone
ENGLISH = re.compile(r"\b(the|and|not|is|of|load|weighed|limit)\b")
WAKE_LOCK = """(() => {
  const lock = Object.assign(new EventTarget(), {});
  const request = async (kind) => { window.asked = kind; return lock; };
  Object.defineProperty(navigator, "wakeLock", { value: { request } });
  window.letGo = () => lock.dispatchEvent(new Event("release"));
})()"""
NO_WAKE_LOCK = 'Object.defineProperty(navigator, "wakeLock", { value: undefined })'
INSECURE = 'Object.defineProperty(window, "isSecureContext", { value: false })'
REFUSED = 'Object.defineProperty(navigator, "wakeLock", { value: { request: async () => { throw new Error("no"); } } })'


@pytest.fixture
def gateway(tmp_path: Path) -> Iterator[Gateway]:
    with cab_gateway(tmp_path) as opened:
        yield opened


@pytest.fixture
def phone(browser: Any) -> Iterator[Watched]:
    """A phone with the dark theme of the night."""
    made = Watched(browser, color_scheme="dark", **PHONE)
    made.page.add_init_script(HURRIED)
    yield made
    made.page.close()


@pytest.fixture
def cab(gateway: Gateway, phone: Watched) -> Iterator[Look]:
    """Opens the page of the gateway."""
    with serving(gateway.app) as server:
        yield lambda: phone.opened(f"{server.url}/cab")
        phone.page.close()


def test_nothing_is_green_on_any_page_while_the_vehicle_learns(gateway: Gateway, phone: Watched) -> None:
    gateway.publish(vaguely_loaded(0, 100.0))
    page = phone.page
    with serving(gateway.app) as server:
        page.goto(f"{server.url}/cab")
        expect(page.locator("#light")).to_have_text("Still learning")
        expect(page.locator("#main")).to_have_attribute("data-light", "unknown")
        expect(page.locator("#question")).to_have_text("On board")
        expect(page.locator("#number")).to_have_text("100 kg")
        expect(page.locator("#why")).to_be_hidden()
        page.goto(f"{server.url}/")
        expect(page.locator("#state")).to_have_attribute("data-tone", "calm")
        expect(page.locator("#overload")).to_contain_text("Still learning")
        page.close()  # with its stream


def test_the_first_view_shows_the_room_and_a_tap_shows_the_rest(gateway: Gateway, phone: Watched) -> None:
    gateway.publish(loaded(0, 300.0, 48.0))
    load_event(gateway, 300, 240.0)
    page = phone.page
    with serving(gateway.app) as server:
        page.goto(f"{server.url}/cab")
        expect(page.locator("#light")).to_have_text("Go")
        expect(page.locator("#question")).to_have_text("You can still load")
        expect(page.locator("#number")).to_have_text("210 kg")
        expect(page.locator("#where")).to_have_text("in the front half of the loading area")
        expect(page.locator("#likely")).to_be_hidden()
        page.locator("#panel").tap()
        expect(page.locator("#likely")).to_be_visible()
        expect(page.locator("#likely")).to_have_text("Safe: 210 kg; best estimate 226 kg ± 12 kg.")
        expect(page.locator("#rooms")).to_contain_text("Whole vehicle300 kg spare")
        expect(page.locator("#aboard")).to_contain_text("On board: 300 kg (95 %: 288 to 312 kg), weighed 0 s ago.")
        expect(page.locator("#last-event")).to_have_text(
            "Last change, by 1 Jan 1970, 00:05: 240 kg loaded (95 %: 226 to 254 kg)."
        )
        assert page.locator("#main").get_attribute("data-is") == "current"
        assert page.locator("#number").evaluate("e => parseFloat(getComputedStyle(e).fontSize)") > LEAST_NUMBER_PX
        assert page.locator("g.go").is_visible()
        assert not page.locator("g.over").is_visible()
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        assert page.locator("#number").bounding_box()["y"] < 500  # without scrolling
        page.set_viewport_size({"width": 844, "height": 390})  # the phone lies across
        page.reload()
        expect(page.locator("#number")).to_have_text("210 kg")
        box = page.locator("#number").bounding_box()
        assert box["y"] + box["height"] < 390
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        assert {address.split("/")[2] for address in phone.addresses} == {server.url.split("/")[2]}
        assert phone.complaints == []
        page.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize(("payload_kg", "light"), [(300.0, "go"), (592.0, "near"), (620.0, "over")])
def test_text_has_enough_contrast_in_both_themes(
    gateway: Gateway, browser: Any, scheme: str, payload_kg: float, light: str
) -> None:
    gateway.publish(loaded(0, payload_kg, 50.0))
    gateway.status = BEFORE.model_copy(
        update={
            "standing": Standing(stood_s=95.0),
            "own_readings": (OwnReading(signal="axle_weight", number=912.0, unit="kg", age_s=0.2),),
        }
    )
    gateway.clock_s += 3600.0  # an old one: every colour there is
    watched = Watched(browser, color_scheme=scheme, **PHONE)
    with serving(gateway.app) as server:
        watched.page.goto(f"{server.url}/cab")
        expect(watched.page.locator("#main")).to_have_attribute("data-light", light)
        expect(watched.page.locator("#bar")).to_contain_text("old")
        assert [text for contrast, text in watched.page.evaluate(CONTRASTS) if contrast < LEAST_CONTRAST] == []
        watched.page.close()


def test_near_a_limit_nothing_is_promised_and_above_it_something_must_come_out(gateway: Gateway, cab: Look) -> None:
    gateway.publish(loaded(0, 592.0, 50.0))
    page = cab()
    expect(page.locator("#light")).to_have_text("Near the limit")
    expect(page.locator("#number")).to_have_text("0 kg")
    expect(page.locator("#likely")).to_contain_text("Safe: 0 kg; best estimate")
    expect(page.locator("#alarms")).to_be_hidden()
    gateway.publish(loaded(1, 620.0, 50.0))
    expect(page.locator("#light")).to_have_text("Too heavy")
    expect(page.locator("#about")).to_have_text("Whole vehicle, front axle: 99 % probability of overload.")
    expect(page.locator("#question")).to_have_text("Take out")
    expect(page.locator("#number")).to_have_text("80 kg")  # by the unfavourable ends, wherever in its half it lies
    expect(page.locator("#likely")).to_have_text("Overload: best estimate 20 kg ± 12 kg.")
    expect(page.locator("#rooms")).to_contain_text("Front axle10 kg too much")
    active = ("overload.gross", "sensor_fault.silent")
    gateway.status = BEFORE.model_copy(update={"alarms": AlarmsStatus(active=active)})
    expect(page.locator("#alarms")).to_have_text("Alarm: a sensor gives no valid sample.")  # the light says the other
    names = ("sensor_fault.refused", "overload.rear_left")
    gateway.status = BEFORE.model_copy(update={"alarms": AlarmsStatus(active=names)})
    gateway.publish(loaded(2, 300.0, 48.0))
    expect(page.locator("#alarms")).to_have_text("Alarm: a sensor gives implausible values.")
    expect(page.locator("#light")).to_have_text("Was too heavy; wait for the next weighing")  # of a wheel unknown now
    expect(page.locator("#about")).to_contain_text("Rear left wheel")


def test_a_lorrys_number_fits_too(tmp_path: Path, phone: Watched) -> None:
    lorry = replace(VAN.vehicle, gross_limit_kg=18000.0, front_axle_limit_kg=None, rear_axle_limit_kg=None)
    with Gateway(tmp_path, calibrated=replace(VAN, vehicle=lorry)) as gateway, serving(gateway.app) as server:
        gateway.status = BEFORE
        gateway.publish(loaded(0, 300.0, 48.0))
        phone.page.goto(f"{server.url}/cab")
        expect(phone.page.locator("#number")).to_have_text("16,285 kg")
        assert phone.page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        phone.page.close()


def test_a_standing_vehicle_warns_that_new_loads_are_not_seen(gateway: Gateway, cab: Look) -> None:
    gateway.publish(loaded(0, 300.0, 48.0))
    page = cab()
    expect(page.locator("#number")).to_have_text("210 kg")
    expect(page.locator("#tell")).to_be_hidden()
    readings = (
        OwnReading(signal="air_spring_pressure", number=412.35, unit="kPa", age_s=0.4),
        OwnReading(signal="ride_height", number=-12.0, unit="mm", age_s=200.0),
    )
    gateway.status = BEFORE.model_copy(
        update={"standing": Standing(stood_s=240.0), "state": State.WAITING_FOR_SPEED, "own_readings": readings}
    )
    expect(page.locator("#not-seen")).to_have_text(
        "Parked for 4 min. Last weighed at 1 Jan 1970, 00:05. Loading since then is not included."
    )
    expect(page.locator("#light")).to_have_text("Go, when last weighed")
    expect(page.locator("#question")).to_have_text("You can still load, when last weighed")
    expect(page.locator("#main")).to_have_attribute("data-is", "earlier")
    expect(page.locator("#own-readings")).to_contain_text("Air spring pressure412.4 kPa")
    expect(page.locator("#own-readings")).to_contain_text("Ride height−12 mm, silent for 3 min")
    expect(page.locator("#own")).to_contain_text("Not weighed by Springscale.")

    expect(page.get_by_text("Not known? Just drive.")).to_be_visible()
    page.get_by_label("Kilograms").fill("310")
    page.get_by_role("button", name="That is aboard").click()
    expect(page.locator("#told")).to_have_text("Noted. The vehicle learns from it after the drive.")
    (stated,) = page.evaluate("fetch('api/v1/statements').then((answer) => answer.json())")["items"]
    assert (stated["source"], stated["load"]["payload_kg"]) == ("delivery_note", 310.0)
    page.get_by_role("button", name="It is empty").click()
    page.wait_for_function(
        "fetch('api/v1/statements').then(async (answer) => (await answer.json()).items.length === 2)"
    )

    gateway.status = BEFORE.model_copy(update={"standing": Standing(is_load_weighed=False)})
    expect(page.locator("#not-seen")).to_contain_text("The load may have changed at the last stop.")
    expect(page.locator("#own")).to_be_hidden()
    expect(page.locator("#tell")).to_be_hidden()
    gateway.status = BEFORE
    expect(page.locator("#not-seen")).to_be_hidden()
    expect(page.locator("#main")).to_have_attribute("data-is", "current")


def test_a_number_of_before_the_machine_was_started_is_old(gateway: Gateway, phone: Watched, cab: Look) -> None:
    """Nobody knows how old it is."""
    gateway.board.restore(json_line(estimate_to_json(loaded(0, 300.0, 48.0))), None, None)
    page = cab()
    expect(page.locator("#bar")).to_contain_text("These numbers are old.")
    expect(page.locator("#bar")).to_contain_text("Weighed before the gateway started.")
    expect(page.locator("#aboard")).to_contain_text("weighed before the gateway started.")
    assert phone.complaints == []


def test_an_old_number_is_crossed_through_and_announced(gateway: Gateway, cab: Look) -> None:
    gateway.publish(loaded(0, 300.0, 48.0))
    gateway.clock_s += 3.0 * 3600.0
    page = cab()
    expect(page.get_by_role("alert")).to_have_text("These numbers are old.")
    expect(page.locator("#bar")).to_have_text("These numbers are old. Weighed 3.0 h ago.")
    expect(page.locator("#light")).to_have_text("Go, when last weighed")
    crossed = page.locator("#number").evaluate("e => getComputedStyle(e).textDecorationLine")
    assert crossed == "line-through"


def test_a_lost_gateway_is_announced_until_it_is_back(gateway: Gateway, phone: Watched, cab: Look) -> None:
    """The page's clocks run ahead, so that nobody has to wait."""
    gateway.publish(loaded(0, 300.0, 48.0))
    phone.page.clock.install()
    page = cab()
    expect(page.locator("#number")).to_have_text("210 kg")
    page.route("**/api/v1/cab", lambda route: route.abort())
    page.clock.run_for(12_000)
    expect(page.locator("#bar")).to_be_hidden()
    page.clock.run_for(48_000)
    expect(page.get_by_role("alert")).to_have_text("The gateway does not answer. These are its last values.")
    expect(page.locator("#bar-how-long")).to_have_text(re.compile(r"For (6\d|[7-9]\d|\d{3}) s\."))  # real time runs on
    expect(page.locator("#main")).to_have_attribute("data-is", "old")
    expect(page.locator("#number")).to_have_text("210 kg")
    expect(page.locator("#aboard")).to_contain_text(re.compile(r"weighed \d+ s ago"))
    page.unroute("**/api/v1/cab")
    page.clock.run_for(6_000)
    expect(page.locator("#bar")).to_be_hidden()
    expect(page.locator("#main")).to_have_attribute("data-is", "current")


def test_while_batches_are_refused_the_light_is_not_green(gateway: Gateway, phone: Watched, cab: Look) -> None:
    """An early look between two refused batches brings it back no more than what was weighed before."""
    gateway.publish(loaded(0, 300.0, 48.0), loaded(1, 300.0, 48.0).refused(Why.MODEL_MISFIT))
    gateway.board.publish(replace(loaded(9, 300.0, 48.0), is_provisional=True))
    page = cab()
    expect(page.locator("#light")).to_have_text("Not known")
    expect(page.locator("#number")).to_have_text("?")
    expect(page.locator("#why")).to_have_text("The last minutes could not be weighed: model misfit.")
    expect(page.locator("#main")).to_have_attribute("data-is", "earlier")
    gateway.publish(loaded(9, 300.0, 48.0))
    expect(page.locator("#light")).to_have_text("Go")
    expect(page.locator("#main")).to_have_attribute("data-is", "current")
    gateway.publish(loaded(10, 0.0, 50.0).refused(Why.ACCELERATION_MISSING))
    gateway.status = BEFORE.model_copy(update={"state": State.SENSOR_FAULT})
    expect(page.get_by_role("alert")).to_contain_text("weighing has stopped")
    expect(page.locator("#aboard")).to_contain_text("Not weighed since: acceleration missing.")
    assert phone.complaints == []


def test_before_the_first_estimate_and_without_limits_it_claims_nothing(tmp_path: Path, phone: Watched) -> None:
    unlimited = replace(VAN.vehicle, gross_limit_kg=None, front_axle_limit_kg=None, rear_axle_limit_kg=None)
    page = phone.page
    with Gateway(tmp_path, calibrated=replace(VAN, vehicle=unlimited)) as gateway, serving(gateway.app) as server:
        gateway.status = BEFORE
        page.goto(f"{server.url}/cab")
        expect(page.locator("#light")).to_have_text("Ready: weighs after the next five minutes of driving")
        expect(page.locator("#number")).to_have_text("?")
        expect(page.locator("#why")).to_have_text("The first weight comes after a few minutes of driving.")
        gateway.publish(loaded(0, 300.0, 48.0))
        expect(page.locator("#light")).to_have_text("No limit is known")
        expect(page.locator("#number")).to_have_text("300 kg")
        expect(page.locator("#question")).to_have_text("On board")
        expect(page.locator("#why")).to_contain_text("no limit is stated (/teach, settings)")
        page.close()


@pytest.mark.parametrize(
    ("script", "said"),
    [
        (WAKE_LOCK, "The screen stays on."),
        (NO_WAKE_LOCK, "the browser does not keep it on"),
        (f"{NO_WAKE_LOCK}; {INSECURE}", "browsers keep it on over HTTPS only"),
        (REFUSED, "the browser does not keep it on"),
    ],
)
def test_the_page_keeps_the_screen_on_or_warns(phone: Watched, cab: Look, script: str, said: str) -> None:
    phone.page.add_init_script(script)
    page = cab()
    expect(page.locator("#awake")).to_contain_text(said)
    if script == WAKE_LOCK:
        assert page.evaluate("window.asked") == "screen"
        page.evaluate("window.letGo()")
        expect(page.locator("#awake")).to_contain_text("Touch the page to try again")
        page.locator("#awake").tap()
        expect(page.locator("#awake")).to_have_text("The screen stays on.")


def test_the_page_shows_nothing_before_a_required_token_is_given(tmp_path: Path, phone: Watched) -> None:
    tokens = TokenFile(tmp_path / "tokens.json")
    token = tokens.create("driver", Scope.READ)
    page = phone.page
    with Gateway(tmp_path / "store", tokens=tokens, calibrated=VAN) as gateway, serving(gateway.app) as server:
        gateway.status = BEFORE
        gateway.publish(loaded(0, 300.0, 48.0))
        page.goto(f"{server.url}/cab")
        expect(page.get_by_role("alert")).to_have_text("The gateway needs a token.")
        expect(page.locator("#main")).to_be_hidden()
        page.get_by_label("Token").fill(token)
        page.get_by_label("Token").press("Enter")
        expect(page.locator("#number")).to_have_text("210 kg")
        expect(page.locator("#token")).to_be_hidden()
        page.close()


@pytest.mark.parametrize(("width", "scheme"), [(390, "dark"), (1280, "light")])
def test_in_german_on_a_phone_and_on_a_tablet(gateway: Gateway, browser: Any, width: int, scheme: str) -> None:
    """Numbers as Germans write them; no word of English but names; by keyboard alone."""
    gateway.publish(loaded(0, 620.0, 50.0))
    load_event(gateway, 300, 240.0)
    watched = Watched(browser, locale="de-DE", color_scheme=scheme, viewport={"width": width, "height": 800})
    page = watched.page
    with serving(gateway.app) as server:
        page.goto(f"{server.url}/cab")
        expect(page.locator("#light")).to_have_text("Zu schwer")
        expect(page.locator("#question")).to_have_text("Laden Sie aus")
        assert page.evaluate("document.documentElement.lang") == "de"
        page.get_by_text("Einzelheiten").focus()
        page.keyboard.press("Enter")
        expect(page.locator("#rooms")).to_contain_text("Vorderachse10 kg zu viel")
        expect(page.locator("#last-event")).to_have_text(
            "Letzte Änderung, bis 1. Jan. 1970, 00:05: 240 kg geladen (95 %: 226 bis 254 kg)."
        )
        assert not ENGLISH.search(page.locator("body").inner_text())
        assert [text for contrast, text in page.evaluate(CONTRASTS) if contrast < LEAST_CONTRAST] == []
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        panel = page.locator("#panel").bounding_box()
        assert (panel["x"], panel["width"]) == (0, width)
        assert watched.complaints == []
        page.close()


def test_an_overloaded_wheel_asks_to_move_the_load(tmp_path: Path, phone: Watched) -> None:
    """More goes in nowhere, but taking something out is not what is asked for."""
    answer = {"light": "over", "says": "uneven", "light_about": ["rear_left"], "over_limit_probability": 0.97}
    with cab_gateway(tmp_path) as gateway, serving(gateway.app) as server:
        gateway.publish(loaded(0, 300.0, 48.0))
        phone.page.route("**/api/v1/cab", lambda route: route.fulfill(json={**route.fetch().json(), **answer}))
        phone.page.goto(f"{server.url}/cab")
        expect(phone.page.locator("#light")).to_have_text("Move the load")
        expect(phone.page.locator("#about")).to_have_text("Rear left wheel: 97 % probability of overload.")
        expect(phone.page.locator("#number")).to_have_text("0 kg")
        phone.page.unroute_all(behavior="ignoreErrors")  # the page asks on, and an answer under way outlives it
        phone.page.close()
