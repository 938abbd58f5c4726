"""The day on the dashboard: a timeline of load over stops, the same in words, kept up to date by the stream."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from support.dashboard import CONTRASTS, LEAST_CONTRAST, STATUS, Watched
from support.days import RULES, day
from support.web import Gateway, serving

from gateway.core.events import Ledger
from gateway.estimate import Estimate
from gateway.records import json_line

playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright (dependency group browser)")
expect = playwright.expect

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


def test_a_day_is_drawn_and_told_in_words(told: Told, watched: Watched) -> None:
    told.of(*DAY[:-1])
    page = watched.page
    with serving(told.gateway.app) as server:
        page.goto(server.url)
        expect(page.locator("#day-words")).to_contain_text("4 trips, 12.0 km")
        expect(page.locator("#day-words")).to_contain_text("2 changes of load: 500 kg loaded, 180 kg unloaded")
        expect(page.locator("#day-entries li")).to_have_count(6)
        expect(page.locator("#day-entries")).to_contain_text("kg loaded.")
        expect(page.locator("#day-chart rect")).to_have_count(4)
        expect(page.locator("#day-chart .day-change")).to_have_text(["+500", "−180"])
        told.of(DAY[-1])  # comes by the stream
        expect(page.locator("#day-entries li")).to_have_count(8)
        expect(page.locator("#day-words")).to_contain_text("3 changes of load")
        assert [text for contrast, text in page.evaluate(CONTRASTS) if contrast < LEAST_CONTRAST] == []
        assert [said for said in watched.complaints if "ERR_FAILED" not in said] == []  # the charts' library
        page.close()


def test_before_the_first_trip_it_says_so(told: Told, watched: Watched) -> None:
    with serving(told.gateway.app) as server:
        watched.page.goto(server.url)
        expect(watched.page.locator("#day-words")).to_have_text("No trip yet.")
        expect(watched.page.locator("#day-figure")).to_be_hidden()
        watched.page.close()
