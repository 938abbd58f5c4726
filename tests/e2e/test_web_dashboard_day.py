"""The day on the dashboard: a timeline of load over stops, the same in words, kept up to date by the stream."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.browser import expect
from support.dashboard import CONTRASTS, LEAST_CONTRAST, STATUS, Watched
from support.days import RULES, day
from support.web import Gateway, serving

from gateway.core.events.ledger import Ledger
from gateway.estimates.batch_estimate import Estimate
from gateway.records import json_line

DAY = day(0.0, 500.0, 500.0, 320.0, 200.0)


class Told:
    """A gateway that is told of batches as the pipeline tells the service."""

    def __init__(self, gateway: Gateway) -> None:
        self.gateway = gateway
        self.ledger = Ledger(RULES)

    def of(self, *estimates: Estimate) -> None:
        for one in estimates:
            self.gateway.publish(one)
            for entry in self.ledger.add(one):
                text = json_line(entry.record)
                self.gateway.store.write_entry(entry.kind, entry.id, entry.t_end_ns, text)


@pytest.fixture
def told(tmp_path: Path) -> Iterator[Told]:
    with Gateway(tmp_path) as gateway:
        gateway.status = STATUS
        yield Told(gateway)


def test_a_day_is_drawn_and_described(told: Told, browser: Any) -> None:
    told.of(*DAY[:-1])
    watched = Watched(browser)
    page = watched.page
    with serving(told.gateway.app) as server:
        page.goto(server.url)
        expect(page.locator("#day-words")).to_contain_text("4 trips, 12.0 km")
        expect(page.locator("#day-words")).to_contain_text("2 changes of load: 500 kg loaded, 180 kg unloaded")
        expect(page.locator("#day-entries li")).to_have_count(6)
        expect(page.locator("#day-entries")).to_contain_text("kg loaded.")
        expect(page.locator("#day-chart[data-drawn]")).to_be_visible()
        trips, changes = page.evaluate("document.getElementById('day-chart').data")
        assert [round(kg) for kg in trips["y"]] == [0, 500, 500, 320]
        assert changes["marker"]["symbol"] == ["triangle-up", "triangle-down"]
        assert "loaded" in changes["text"][0]
        told.of(DAY[-1])  # comes by the stream
        expect(page.locator("#day-entries li")).to_have_count(8)
        expect(page.locator("#day-words")).to_contain_text("3 changes of load")
        assert [text for contrast, text in page.evaluate(CONTRASTS) if contrast < LEAST_CONTRAST] == []
        assert watched.complaints == []
        page.close()


def test_a_busy_day_shows_the_ten_newest(told: Told, browser: Any) -> None:
    loads = [500.0 if n % 2 else 0.0 for n in range(12)]
    told.of(*day(*loads))
    for width in (390, 1240):
        watched = Watched(browser, viewport={"width": width, "height": 900})
        page = watched.page
        page.route("**/plotly-*", lambda route: route.abort())
        with serving(told.gateway.app) as server:
            page.goto(server.url)
            if width < 640:
                page.get_by_role("button", name="The day").click()
            expect(page.locator("#day-entries > li")).to_have_count(10)
            expect(page.locator("#day-more-title")).to_have_text(re.compile(r"^\d+ earlier entries$"))
            expect(page.locator("#day-earlier > li").first).to_be_hidden()
            expect(page.locator("#day-entries > li").last).to_be_visible()
            lefts = page.evaluate(
                "[...document.querySelectorAll('#day-entries > li')].map((one) => one.getBoundingClientRect().x)"
            )
            assert len(set(lefts)) == (1 if width < 640 else 3)  # columns
            page.locator("#day-more-title").click()
            expect(page.locator("#day-earlier > li").first).to_be_visible()
            times = page.evaluate("[...document.querySelectorAll('.timeline time')].map((one) => one.dateTime)")
            assert times == sorted(times, reverse=True)
            page.close()
