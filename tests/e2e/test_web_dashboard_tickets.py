"""Tickets on the dashboard: provisional accuracy, what would help, one handed in and taken back."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from support.dashboard import STATUS, Watched
from support.tickets import TicketBench
from support.web import Gateway, serving

playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright (dependency group browser)")
expect = playwright.expect


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[TicketBench]:
    made = TicketBench(tmp_path / "vehicle")
    made.finish(1.0)
    yield made
    made.store.close()


def test_a_ticket_is_handed_in_and_taken_back(tmp_path: Path, bench: TicketBench, watched: Watched) -> None:
    page = watched.page
    with Gateway(tmp_path / "store", tickets=bench.desk) as gateway, serving(gateway.app) as server:
        gateway.status = STATUS
        page.goto(server.url)
        expect(page.locator("#accuracy")).to_contain_text("Provisional: payloads to ± 59")
        expect(page.locator("#accuracy")).to_contain_text("2.1 m behind the front axle would make it ± 24")
        page.get_by_role("button", name="Teach with a ticket").click()
        dialog = page.locator("#known-dialog")
        expect(dialog).to_contain_text("made anew with it in the background")
        expect(dialog.get_by_role("button", name="Add another load")).to_be_hidden()
        dialog.get_by_label("Known is").select_option("payload")
        dialog.get_by_label("Payload [kg]").fill("270")
        dialog.get_by_label("Its place behind the front axle").fill("1.4")
        dialog.get_by_label("When it was so").fill(bench.stated(1).at[:16])
        page.keyboard.press("Enter")
        expect(dialog).to_be_hidden()
        expect(page.locator("#known-said")).to_contain_text("The ticket is kept")
        expect(page.locator("#accuracy")).to_contain_text("the calibration is being made anew")
        bench.finish(2.0)
        expect(page.locator("#accuracy")).not_to_contain_text("made anew")  # it asks again by itself
        page.get_by_text("Tickets", exact=True).click()
        expect(page.locator("#ticket-entries li")).to_contain_text("270 kg, 49.2 % in front, by local")
        page.get_by_role("button", name="Withdraw the ticket").click()
        expect(page.locator("#ticket-entries li")).to_contain_text("withdrawn")
        assert watched.complaints == []
        gateway.board.close()
