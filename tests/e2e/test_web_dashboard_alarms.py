"""Alarms: active ones at the top of the dashboard, ended ones on the page for engineers."""

from pathlib import Path

from support.absent import of_no_vehicle
from support.alarms import LIMIT_KG, AlarmBench, of_load
from support.browser import expect
from support.dashboard import CONTRASTS, LEAST_CONTRAST, STATUS, Watched
from support.web import serving

from gateway.web.app import create_app


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
        assert [text for contrast, text in page.evaluate(CONTRASTS) if contrast < LEAST_CONTRAST] == []
        bench.weigh(of_load(2, 100.0))
        expect(page.locator("#alarms")).to_be_hidden()
        page.get_by_role("link", name="For engineers").click()
        expect(page.locator("#alarms-entries li")).to_contain_text("Whole vehicle: 2,560 ± 22 kg")
        assert [said for said in watched.complaints if "ERR_FAILED" not in said] == []
        bench.board.close()
    bench.store.close()
