"""The desk of alarms: stored, shown, logged; through restarts and a disk that refuses."""

import logging
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from support.alarms import LIMIT_KG, AlarmBench, of_load
from support.days import batch
from support.patience import PATIENCE_S

from gateway.calibration.trend import Trend, TrendPoint
from gateway.config import sections as settings
from gateway.core.alarms.alarm import CAUSE_NAMES
from gateway.core.alarms.rules import AlarmRules
from gateway.core.change import Rules
from gateway.errors import RefusedError
from gateway.records import Why
from gateway.service.alarms import rules_of
from gateway.service.batch_log import ledger_of
from gateway.status import BusStatus, SignalHealth, State, Status

OVER = LIMIT_KG + 60.0


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[AlarmBench]:
    made = AlarmBench(tmp_path)
    yield made
    made.store.close()


def status(state: State) -> Status:
    """Nothing is heard of the pitch rate; the interface was down."""
    signals = (SignalHealth(signal="vertical_acceleration", last_age_s=0.1), SignalHealth(signal="pitch_rate"))
    bus = BusStatus(last_fault="can0 is down")
    return Status(version="1", state=state, uptime_s=1.0, signals=(*signals, SignalHealth(signal="door")), bus=bus)


def test_an_alarm_is_stored_shown_and_logged(bench: AlarmBench, caplog: pytest.LogCaptureFixture) -> None:
    follower = bench.store.follow(("alarm",), None, lambda: None)
    sent: list[str] = []
    with caplog.at_level(logging.INFO):
        for weighed in (of_load(0, OVER), of_load(1, OVER, n_batches=2)):
            bench.weigh(weighed)
            sent += [record.kind for record in follower.read(10)]
    (alarm,) = bench.history()
    assert bench.standing() == [alarm]
    assert (alarm["state"], alarm["revision"], [step["state"] for step in alarm["steps"]]) == (
        "final", 2, ["early", "final"],
    )  # fmt: skip
    assert sent == ["alarm"] * 2
    told = [record.getMessage() for record in caplog.records]
    assert told == ["alarm raised, provisional", "alarm confirmed"]
    summary = bench.desk.summary()
    assert (summary.standing, summary.n_unacknowledged, summary.n_told) == ({"overload.gross": "final"}, 1, 2)


def test_a_restart_goes_on_where_it_was(bench: AlarmBench) -> None:
    bench.weigh(of_load(0, OVER))
    (before,) = bench.standing()
    bench.desk.acknowledge(before["id"], "yard", "two pallets too many")
    bench.restart()
    (after,) = bench.standing()
    assert (after["id"], after["acknowledged"]["by"], after["acknowledged"]["note"]) == (
        before["id"], "yard", "two pallets too many",
    )  # fmt: skip
    bench.weigh(of_load(1, 100.0))
    assert bench.standing() == []
    assert [one["state"] for one in bench.history()] == ["cleared"]


def test_a_restart_remembers_how_long_was_driven_without_an_estimate(tmp_path: Path) -> None:
    bench = AlarmBench(tmp_path, AlarmRules(no_estimate_s=1800.0))
    for n in range(5):
        bench.weigh(replace(batch(5.0 * n, 5.0 * (n + 1), None), rejected=(Why.TOO_SLOW,)))
    bench.restart()
    assert bench.standing() == []
    bench.weigh(replace(batch(25.0, 30.0, None), rejected=(Why.TOO_SLOW,)))
    (alarm,) = bench.standing()
    assert alarm["sentence"] == "30 minutes were driven without an estimate: too slow"
    bench.store.close()


def test_what_is_switched_off_ends_with_the_next_start(bench: AlarmBench) -> None:
    bench.weigh(of_load(0, OVER))
    bench.rules = AlarmRules(off=("overload",))
    bench.restart()
    assert bench.standing() == []
    assert bench.history()[0]["steps"][-1]["detail"] == "switched off"
    assert "overload.gross" not in bench.desk.summary().watched


def test_alarms_among_the_entries_leave_the_day_book_as_it_is(bench: AlarmBench) -> None:
    """The day book took whatever lay among the entries for an event or a trip."""
    bench.weigh(of_load(0, OVER))
    assert bench.store.flush(PATIENCE_S)
    ledger_of(bench.store.reader(), Rules())


def test_a_silent_sensor_is_told_after_a_while_and_for_sure_later(bench: AlarmBench) -> None:
    def look(at_s: float, state: State) -> list[tuple[str, str]]:
        bench.clock_s = at_s
        bench.desk.watch(status(state), ())
        return [(alarm["where"], alarm["state"]) for alarm in bench.standing()]

    assert look(0.0, State.SENSOR_FAULT) == []
    assert look(59.0, State.SENSOR_FAULT) == []
    assert look(60.0, State.SENSOR_FAULT) == [("silent", "early")]
    assert look(500.0, State.WAITING_FOR_BUS) == [("silent", "early")]  # asleep: nobody knows
    assert look(600.0, State.SENSOR_FAULT) == [("silent", "early")]  # the time begins anew
    assert look(1200.0, State.READER_FAULT) == [("silent", "final")]
    assert [step["detail"] for step in bench.history()[0]["steps"]] == ["pitch_rate", "can0 is down"]
    assert look(1201.0, State.ESTIMATING) == []
    assert bench.history()[0]["sentence"] == "No signal: can0 is down (ended)"


def test_drift_is_final_at_once_and_judged_only_when_it_was_judged_anew(bench: AlarmBench) -> None:
    points = tuple(TrendPoint(f"2026-0{n}-01T00:00:00.000000Z", 3.0 * n, 5) for n in range(1, 9))
    drifting = (Trend("damper_front", "%", points, 21.0, (15.0, 27.0), is_drifting=True),)
    for _ in range(3):
        bench.desk.watch(status(State.ESTIMATING), drifting)
    (alarm,) = bench.standing()
    assert (alarm["kind"], alarm["where"], alarm["state"], alarm["revision"]) == ("drift", "damper_front", "final", 1)
    assert "damper front has drifted by +21.0 %" in alarm["sentence"]
    bench.desk.watch(status(State.ESTIMATING), ())
    assert bench.standing() == []


def test_an_acknowledgement_that_the_disk_refuses_is_told_as_such(
    bench: AlarmBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench.weigh(of_load(0, OVER))
    (alarm,) = bench.standing()
    monkeypatch.setattr(bench.store, "flush", lambda timeout_s: False)
    with pytest.raises(RefusedError) as refusal:
        bench.desk.acknowledge(alarm["id"], "yard", None)
    assert refusal.value.reason == "not_stored"
    assert bench.standing()[0]["acknowledged"]["by"] == "yard"  # shown all the same, and stored when it can be


@pytest.mark.parametrize("text", ['{"id": "alarm-1-a", "revision": 1}', '{"acknowledged": 5, "steps": [7]}'])
def test_an_alarm_that_cannot_be_read_keeps_no_other_from_being_remembered(bench: AlarmBench, text: str) -> None:
    bench.weigh(of_load(0, OVER))
    bench.store.write_entry("alarm", "alarm-1-a", 1, text)
    bench.restart()
    assert [alarm["where"] for alarm in bench.standing()] == ["gross"]


def test_settings_are_the_cores() -> None:
    """Names and defaults stand in both: settings are read where the core would load too much."""
    assert set(settings.CAUSE_NAMES) == set(CAUSE_NAMES)
    assert rules_of(settings.AlarmsSection()) == AlarmRules()
