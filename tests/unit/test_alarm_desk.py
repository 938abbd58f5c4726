"""The alarms of the service: stored, shown, logged, and resumed after a restart."""

import logging
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from support.alarms import LIMIT_KG, AlarmBench, of_load
from support.days import batch
from support.patience import PATIENCE_S

from gateway.config import sections as settings
from gateway.core.alarms.alarm import CAUSE_NAMES
from gateway.core.alarms.rules import AlarmRules
from gateway.core.change import Rules
from gateway.records import Why
from gateway.service.alarm_reader import rules_of
from gateway.service.batch_log import ledger_of
from gateway.status import BusStatus, DecodeCount, SignalHealth, State, Status

OVER = LIMIT_KG + 60.0


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[AlarmBench]:
    made = AlarmBench(tmp_path)
    yield made
    made.store.close()


def status(state: State) -> Status:
    """A status in which the pitch rate is silent after the interface was down."""
    signals = (SignalHealth(signal="vertical_acceleration", last_age_s=0.1), SignalHealth(signal="pitch_rate"))
    bus = BusStatus(last_fault="can0 is down")
    return Status(version="1", state=state, uptime_s=1.0, signals=(*signals, SignalHealth(signal="door")), bus=bus)


def test_an_alarm_is_stored_shown_and_logged(bench: AlarmBench, caplog: pytest.LogCaptureFixture) -> None:
    follower = bench.store.follow(("alarm",), None, lambda: None)
    with caplog.at_level(logging.INFO):
        bench.weigh(of_load(1, OVER, n_batches=2))
        assert bench.standing() == bench.history()
        sent = [record.kind for record in follower.read(10)]
        summary = bench.desk.summary()
        assert (summary.active, summary.n_raised) == (("overload.gross",), 1)
        bench.weigh(of_load(2, 100.0))
    assert bench.standing() == []
    sent += [record.kind for record in follower.read(10)]
    (alarm,) = bench.history()
    assert (alarm["is_active"], alarm["revision"], alarm["found_kg"], sent) == (False, 2, 2560.0, ["alarm"] * 2)
    assert [record.getMessage() for record in caplog.records] == ["alarm raised", "alarm ended"]
    assert bench.desk.summary().n_raised == 1


def test_alarms_survive_a_restart(bench: AlarmBench) -> None:
    bench.weigh(of_load(1, OVER, n_batches=2))
    (before,) = bench.standing()
    bench.weigh(replace(batch(10.0, 15.0, None), rejected=(Why.PITCH_RATE_STUCK,)))
    bench.restart()
    assert bench.standing() == [before]
    bench.weigh(replace(batch(15.0, 20.0, None), rejected=(Why.PITCH_RATE_STUCK,)))
    assert [alarm["where"] for alarm in bench.standing()] == ["gross", "refused"]
    bench.weigh(of_load(4, 100.0))
    assert bench.standing() == []
    assert [one["is_active"] for one in bench.history()] == [False, False]


def test_a_disabled_alarm_ends_at_the_next_start(bench: AlarmBench) -> None:
    bench.weigh(of_load(0, OVER, n_batches=2))
    bench.rules = AlarmRules(off=("overload",))
    bench.restart()
    assert bench.standing() == []
    assert not bench.history()[0]["is_active"]
    assert "overload.gross" not in bench.desk.summary().watched


def test_alarms_among_the_entries_leave_the_day_book_as_it_is(bench: AlarmBench) -> None:
    """The day book took whatever lay among the entries for an event or a trip."""
    bench.weigh(of_load(0, OVER, n_batches=2))
    assert bench.store.flush(PATIENCE_S)
    ledger_of(bench.store.reader(), Rules())


def test_a_silent_sensor_raises_an_alarm_after_a_while(bench: AlarmBench) -> None:
    def look(at_s: float, state: State) -> list[str]:
        bench.clock_s = at_s
        bench.desk.watch(status(state))
        return [alarm["sentence"] for alarm in bench.standing()]

    assert look(0.0, State.SENSOR_FAULT) == []
    assert look(599.0, State.SENSOR_FAULT) == []
    assert look(600.0, State.WAITING_FOR_BUS) == []  # asleep: nobody knows
    assert look(700.0, State.SENSOR_FAULT) == []  # the time begins anew
    assert look(1300.0, State.SENSOR_FAULT) == ["No signal: pitch rate"]
    assert look(1400.0, State.WAITING_FOR_BUS) == ["No signal: pitch rate"]
    assert look(1500.0, State.ESTIMATING) == []
    assert look(1600.0, State.READER_FAULT) == []
    assert look(2200.0, State.READER_FAULT) == ["No signal: can0 is down"]


WRONG_LENGTH = "IMU_GYRO (121): 900 frames have 7 bytes, the database says 8"


@pytest.mark.parametrize(
    ("last_age_s", "counts", "causes", "sentence"),
    [
        (None, {"ok": 0}, (), "pitch rate (no frame of its message)"),
        (312.4, {"ok": 900}, (), "pitch rate (last heard 312 s ago)"),
        (
            None,
            {"ok": 0, "wrong_length": 900},
            (WRONG_LENGTH,),
            f"pitch rate (900 frames came, all wrong length); {WRONG_LENGTH}",
        ),
    ],
)
def test_an_alarm_of_a_silent_sensor_has_its_reason(
    last_age_s: float | None, counts: dict[str, int], causes: tuple[str, ...], sentence: str, bench: AlarmBench
) -> None:
    """It named the sensor alone, and whoever read it checked a sensor that was well."""
    now = status(State.SENSOR_FAULT).model_copy(
        update={
            "signals": (SignalHealth(signal="pitch_rate", last_age_s=last_age_s),),
            "decode": tuple(DecodeCount(signal="pitch_rate", reason=reason, n=n) for reason, n in counts.items()),
        }
    )
    for bench.clock_s in (0.0, 600.0):
        bench.desk.watch(now, causes)
    assert [alarm["sentence"] for alarm in bench.standing()] == [f"No signal: {sentence}"]


@pytest.mark.parametrize("text", ['{"id": "alarm-1-a", "revision": 1}', '{"kind": 5}'])
def test_an_alarm_that_cannot_be_read_keeps_no_other_from_being_remembered(bench: AlarmBench, text: str) -> None:
    bench.weigh(of_load(0, OVER, n_batches=2))
    bench.store.write_entry("alarm", "alarm-1-a", 1, text)
    bench.restart()
    assert [alarm["where"] for alarm in bench.standing()] == ["gross"]


def test_settings_are_the_cores() -> None:
    """Names and defaults stand in both: settings are read where the core would load too much."""
    assert set(settings.CAUSE_NAMES) == set(CAUSE_NAMES)
    assert rules_of(settings.AlarmsSection()) == AlarmRules()
