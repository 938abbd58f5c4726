"""The dashboard while the vehicle drives: it follows the stream, doubts what may be wrong, and says why."""

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.absent import of_no_vehicle
from support.alarms import LIMIT_KG, AlarmBench, of_load
from support.browser import expect
from support.dashboard import CONTRASTS, LEAST_CONTRAST, STATUS, Look, Watched, demo_calibration, weighed
from support.estimates import make_estimate
from support.web import Gateway, serving

from gateway.estimates.budget import BudgetLine, budget_of
from gateway.estimates.posterior import Posterior, Source
from gateway.records import Why
from gateway.status import State
from gateway.web.app import create_app

CALIBRATED = demo_calibration()


@pytest.fixture
def gateway(tmp_path: Path) -> Iterator[Gateway]:
    with Gateway(tmp_path / "store", calibrated=CALIBRATED) as opened:
        opened.status = STATUS
        yield opened


def test_a_drive_from_the_empty_page_to_a_number_that_may_be_wrong(
    gateway: Gateway, watched: Watched, dashboard: Look
) -> None:
    page = dashboard()
    note = page.locator("#note")
    expect(page.locator("#payload")).to_have_text("unknown")
    expect(note).to_have_text("Ready: weighs after the next five minutes of driving.")
    expect(page.locator("#history")).to_contain_text("No batch yet.")
    expect(page.locator("#payload-chart")).to_be_hidden()
    expect(page.locator("#day-words")).to_have_text("No trip yet.")
    expect(page.locator("#day-figure")).to_be_hidden()
    expect(page.locator("#link")).to_have_text("live")

    gateway.publish(make_estimate(0, Why.TOO_SLOW))
    expect(note).to_contain_text("No estimate yet. The last batch could not be weighed: too slow.")
    expect(note).to_contain_text("What to do: nothing; an open road is enough.")

    gateway.publish(weighed(1, 270.0, 48.0, CALIBRATED))
    expect(page.locator("#payload")).to_have_text("270 kg")
    expect(page.locator("#announcement")).to_have_text("Payload 270 kg, 48.0 % on the front axle.")
    expect(note).to_be_hidden()
    expect(page.locator("#recent tr")).to_have_count(2)
    expect(page.locator("#van circle.load")).to_have_count(1)

    gateway.publish(weighed(2, -14.0, 50.0, CALIBRATED))  # no load is drawn, nor that of the batch before
    expect(page.locator("#payload")).to_have_text("−14 kg")
    expect(page.locator("#van circle.load")).to_have_count(0)
    assert [said for said in watched.complaints if "attribute" in said] == []

    gateway.publish(make_estimate(3, Why.TOO_SLOW))  # of the road: nothing against the number
    expect(page.locator("#recent tr")).to_have_count(4)
    expect(note).to_be_hidden()
    gateway.publish(make_estimate(4, Why.MODEL_MISFIT))
    expect(note).to_contain_text("could not be weighed: model misfit. This number may be wrong")
    gateway.board.publish(replace(weighed(6, 270.0, 48.0, CALIBRATED), is_provisional=True))
    expect(note).to_contain_text("Early value")
    expect(note).to_contain_text("model misfit")
    gateway.publish(weighed(6, 270.0, 48.0, CALIBRATED))
    expect(note).to_be_hidden()

    page.get_by_role("link", name="For engineers").click()
    expect(page.locator("#rejected")).to_contain_text("Model misfit: ")
    gateway.publish(make_estimate(7, Why.SPEED_FROZEN))
    expect(page.locator("#rejected")).to_contain_text("Speed frozen: the speed repeated the same number")


def test_a_number_that_nobody_confirms_is_grey_until_the_service_is_back(gateway: Gateway, watched: Watched) -> None:
    page = watched.page
    gateway.publish(weighed(0, 270.0, 48.0, CALIBRATED))
    with serving(gateway.app) as server:
        page.goto(server.url)
        expect(page.locator("#link")).to_have_text("live")
        expect(page.locator("#payload")).to_have_text("270 kg")
        fresh = page.evaluate(NUMBERS_COLOUR)
        port = server.socket.getsockname()[1]
        gateway.board.close()
    expect(page.locator("#link")).to_have_text("not connected: trying again")
    expect(page.locator("#state")).to_contain_text("Offline The gateway does not answer.")
    expect(page.locator("#payload")).to_have_text("270 kg")
    assert page.evaluate(NUMBERS_COLOUR) != fresh
    expect(page.locator("#van")).to_have_class(re.compile("stale"))

    gateway.restart_board()
    with serving(gateway.app, port=port):
        gateway.publish(weighed(1, 101.0, 50.0, CALIBRATED))
        expect(page.locator("#link")).to_have_text("live")
        expect(page.locator("#state-name")).to_have_text("Estimating")
        expect(page.locator("#payload")).to_have_text("101 kg")
        expect(page.locator("#recent tr")).to_have_count(2)
        gateway.clock_s += 7200.0
        page.reload()
        expect(page.locator("#note")).to_contain_text("This estimate is old")
        expect(page.locator("#age")).to_have_text("2.0 h ago")
        expect(page.locator("#latest")).to_have_class(re.compile("stale"))
        gateway.board.close()


NUMBERS_COLOUR = "getComputedStyle(document.getElementById('payload')).color"
NEVER_HEARD = STATUS.bus.model_copy(update={"n_frames": 0})
STATES = {
    State.STARTING: ("Starting", "busy"),
    State.WAITING_FOR_BUS: ("Bus silent", "warn"),
    State.SENSOR_FAULT: ("Sensor fault", "bad"),
    State.WAITING_FOR_SPEED: ("Waiting for speed", "busy"),
    State.COLLECTING: ("First batch under way", "busy"),
    State.ESTIMATING: ("Estimating", "good"),
    State.NOT_WEIGHED: ("Not weighed", "calm"),
    State.STALE: ("Stale", "warn"),
    State.READER_FAULT: ("Bus fault", "bad"),
}


def test_every_state_has_a_name_and_a_sentence(gateway: Gateway, dashboard: Look) -> None:
    assert set(STATES) == set(State)
    for state, (name, tone) in STATES.items():
        words = {"state": state, "state_in_words": f"This is {state}."}
        gateway.status = STATUS.model_copy(update=words | {"bus": NEVER_HEARD})
        page = dashboard()
        expect(page.locator("#state")).to_have_text(re.compile(rf"{name}\s+This is {state}\."))
        expect(page.locator("#state")).to_have_attribute("data-tone", tone)


def test_a_silent_bus_between_drives_raises_no_alarm(gateway: Gateway, dashboard: Look) -> None:
    gateway.publish(make_estimate(0))
    gateway.status = STATUS.model_copy(update={"state": State.WAITING_FOR_BUS})
    page = dashboard()
    expect(page.locator("#state")).to_have_text(re.compile("Bus silent\\s+The vehicle is asleep."))
    expect(page.locator("#state")).to_have_attribute("data-tone", "calm")
    page.get_by_role("link", name="For engineers").click()
    expect(page.locator("#signals tr").nth(1)).to_contain_text("paused for 75 s")
    expect(page.locator("#signals .silent")).to_have_count(0)


def test_a_vehicle_that_is_not_taught_is_sent_to_teach_and_not_to_a_command(gateway: Gateway, dashboard: Look) -> None:
    gateway.status = STATUS.model_copy(update={"calibration_id": None})
    gateway.publish(make_estimate(0, Why.NO_CALIBRATION))
    page = dashboard()
    expect(page.locator("#state-name")).to_have_text("No calibration")
    expect(page.locator("#note")).to_contain_text("the vehicle is not taught yet. “Teach” says what comes next.")
    expect(page.locator("#note")).not_to_contain_text("springscale")
    page.get_by_role("link", name="For engineers").click()
    expect(page.locator("#rejected")).to_contain_text("the vehicle is not taught yet", use_inner_text=False)
    expect(page.locator("#rejected")).not_to_contain_text("springscale", use_inner_text=False)


def test_an_alarm_comes_by_the_stream_and_goes_to_the_engineers_page_when_it_ends(
    tmp_path: Path, watched: Watched
) -> None:
    bench, page = AlarmBench(tmp_path / "store"), watched.page
    parts = of_no_vehicle(tmp_path / "store", bench.store) | {"alarms": bench.desk.standing}
    with serving(create_app(bench.board, bench.store.reader(), lambda: STATUS, **parts)) as server:
        page.goto(server.url)
        expect(page.locator("#link")).to_have_text("live")
        expect(page.locator("#alarms")).to_be_hidden()
        bench.weigh(of_load(1, LIMIT_KG + 60.0, n_batches=2))
        expect(page.locator("#alarms-open li")).to_contain_text("Whole vehicle: 2,560 ± 22 kg, limit 2,500 kg.")
        assert_readable(watched)
        bench.weigh(of_load(2, 100.0))
        expect(page.locator("#alarms")).to_be_hidden()
        page.get_by_role("link", name="For engineers").click()
        expect(page.locator("#alarms-entries li")).to_contain_text("Whole vehicle: 2,560 ± 22 kg")
        bench.board.close()
    bench.store.close()


POSTERIOR = Posterior(
    np.array([300.0, 50.0]),
    np.diag([7.0**2, 0.2**2]),
    {
        Source.CALIBRATION: np.array([[15.0, 0.10], [-4.0, 0.15]]),
        Source.GOODS: np.array([[22.0, 0.12]]),
        Source.LOAD_LENGTH: np.array([[22.0, 0.12]]),
        Source.DAY: np.array([[7.0, 0.05]]),
        Source.SENSOR: np.array([[6.0, 0.04]]),
        Source.EMPTY_SHARE: np.array([[0.0, 0.4]]),
        Source.MODEL: np.array([[5.0, 0.0], [0.0, 0.1]]),
    },
    leans=(1.0, 1.4),
)


def test_error_sources_are_listed_largest_first(gateway: Gateway, watched: Watched, dashboard: Look) -> None:
    budget = budget_of(POSTERIOR, is_shape_said=False)
    of_grams = replace(budget[-1], payload_kg=0.2)
    gateway.publish(replace(make_estimate(0).answered(POSTERIOR), error_budget=(*budget, of_grams)))
    page = dashboard()
    low_kg, high_kg = make_estimate(0).answered(POSTERIOR).payload.interval95
    half = round((high_kg - low_kg) / 2.0)
    assert half > round(1.96 * POSTERIOR.std(0)) + 5  # the interval leans, and so much wider is each of its parts
    expect(page.locator("#budget-why")).to_have_text(f"Why ± {half} kg?")
    expect(page.locator("#budget")).to_have_attribute("open", "")  # there is room for it
    first = page.locator("#budget-lines li").first
    goods_kg = round(22.0 * (high_kg - low_kg) / 2.0 / POSTERIOR.std(0))
    expect(first).to_have_text(re.compile(rf"vehicle's loads\s*±\s{goods_kg}\skg"))
    remedies = page.locator("#budget-remedies li")
    said = remedies.all_inner_texts()
    assert len({*said}) == len(said) == len({line.remedy for line in budget if helps(line, POSTERIOR.std(0))})
    expect(page.locator("#budget-remedies")).to_contain_text("State in the vehicle's data what it carries")
    expect(remedies.first).to_contain_text(f"± {half} kg becomes ± ")
    assert page.locator("#budget-lines li").count() == sum(line.payload_kg > 0.0 for line in budget)  # no ± 0 kg
    assert_readable(watched)


def helps(line: BudgetLine, std_kg: float) -> bool:
    """Whether a remedy narrows the interval by a tenth."""
    return line.remedy is not None and line.payload_with_remedy_kg < 0.9 * std_kg


def assert_readable(watched: Watched) -> None:
    """Every text has contrast, and the page complains of nothing but the charts' library, which is kept from it."""
    assert [text for contrast, text in watched.page.evaluate(CONTRASTS) if contrast < LEAST_CONTRAST] == []
    assert [said for said in watched.complaints if "ERR_FAILED" not in said] == []
