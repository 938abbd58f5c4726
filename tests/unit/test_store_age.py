"""Age removes nothing on the word of a clock that may be wrong, nor what nobody has got yet."""

from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
from support.estimates import make_record
from support.log import fields_of, names
from support.patience import PATIENCE_S

from gateway.log import Event
from gateway.store import Retention, Store, retention
from gateway.units import NS_PER_S

DAY_NS = 86_400 * NS_PER_S
TODAY_NS = 1_790_000_000 * NS_PER_S
YEAR = Retention(max_age_s=400 * 86_400.0)


class Box:
    """A gateway whose wall clock the test sets; its boot clock goes only where the test says that time passes."""

    def __init__(self, directory: Path, kept: Retention, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now_ns, self.boot_ns, self.n = TODAY_NS, 0, 0
        self._directory, self._kept = directory, kept
        monkeypatch.setattr(retention, "boot_ns", lambda: self.boot_ns)

    def drive(self, n: int, days_between: int = 0) -> int:
        """One start of the service, n records; how many the store then holds."""
        with closing(Store.open(self._directory, self._kept, clock_ns=lambda: self.now_ns)) as store:
            for _ in range(n):
                self.n += 1
                store.write_estimate(make_record(self.n))
                store.write_event("drive", {})
                assert store.flush(PATIENCE_S)
                self.pass_days(days_between)
            return len(store.reader().estimates(limit=1000).items)

    def pass_days(self, days: float) -> None:
        self.now_ns += round(days * DAY_NS)
        self.boot_ns += round(days * DAY_NS)


@pytest.fixture
def box(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Box:
    return Box(tmp_path, YEAR, monkeypatch)


@pytest.mark.parametrize("ahead_days", [401, 800, 20_000])
def test_a_clock_in_the_future_erases_nothing(box: Box, ahead_days: int, caplog: pytest.LogCaptureFixture) -> None:
    assert box.drive(30) == 30
    box.now_ns += ahead_days * DAY_NS
    assert box.drive(5) == 35
    assert fields_of(caplog, Event.CLOCK_DOUBTED) == {"ahead_days": float(ahead_days)}
    assert box.drive(5) == 40  # nor at the next start
    box.now_ns -= ahead_days * DAY_NS
    assert box.drive(5) == 45
    box.now_ns += ahead_days * DAY_NS  # and once more
    assert box.drive(5) == 50
    assert names(caplog).count(Event.CLOCK_DOUBTED) == 2


def test_a_clock_that_leaps_while_the_service_runs_erases_nothing(box: Box, tmp_path: Path) -> None:
    box.drive(10)
    with closing(Store.open(tmp_path, YEAR, clock_ns=lambda: box.now_ns)) as store:
        store.write_estimate(make_record(900))
        assert store.flush(PATIENCE_S)
        box.now_ns += 800 * DAY_NS
        store.write_estimate(make_record(901))
        assert store.flush(PATIENCE_S)
        assert store.health().n_pruned == 0


def leaps(box: Box) -> None:
    for _ in range(4):
        box.now_ns += 500 * DAY_NS
        box.drive(1)


def year_by_year(box: Box) -> None:
    for _ in range(3):
        box.now_ns += 366 * DAY_NS
        box.drive(2)


@pytest.mark.parametrize("go_wrong", [leaps, year_by_year])
def test_a_clock_that_leaps_from_start_to_start_is_never_believed(box: Box, go_wrong: Callable[[Box], None]) -> None:
    box.drive(30)
    go_wrong(box)
    assert box.drive(0) >= 30


def test_time_that_was_lived_through_is_believed(box: Box) -> None:
    box.drive(3)
    for _ in range(14):
        box.pass_days(29.0)
        n = box.drive(1)
    assert n == 14  # the first three are 406 days old


def test_a_vehicle_that_stood_for_two_years_keeps_its_records_a_month_longer(
    box: Box, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO", "gateway")
    box.drive(10)
    box.now_ns += 730 * DAY_NS
    assert box.drive(1) == 11
    box.now_ns += 20 * DAY_NS
    assert box.drive(1) == 12
    box.now_ns += 11 * DAY_NS
    assert box.drive(1) == 3
    assert [event for event in names(caplog) if "clock" in event] == [Event.CLOCK_DOUBTED, Event.CLOCK_BELIEVED]


def test_old_records_are_removed_without_a_clock_battery(box: Box) -> None:
    n = box.drive(3)
    for _ in range(25):
        today_ns = box.now_ns + 20 * DAY_NS
        box.now_ns = 60 * NS_PER_S  # 1970 at every start
        box.drive(0)
        box.now_ns = today_ns
        n = box.drive(1)
    assert n < 25


def test_undelivered_records_are_not_removed_for_their_age(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    box = Box(tmp_path, Retention(max_age_s=60.0, undelivered_to=("fleet",)), monkeypatch)
    assert box.drive(10, days_between=1) == 10
    with closing(Store.open(tmp_path, clock_ns=lambda: box.now_ns)) as store:
        sixth = store.reader().estimates(limit=6).last_cursor
        assert store.write_delivery("fleet", sixth)
    assert box.drive(1) == 5
    with closing(Store.open(tmp_path, clock_ns=lambda: box.now_ns)) as store:
        found = store.reader().delivery("fleet")
        assert (found.n_pruned, found.n_waiting) == (0, 5)
