"""Alarms: when they are raised and when they end, each once."""

import json
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.alarms import LIMIT_KG, VAN, of_load
from support.days import T0_NS, at, batch

from gateway.core.alarms.alarm import (
    CAUSE_NAMES,
    REFUSED,
    SILENT,
    Alarm,
    AlarmCause,
    AlarmFigure,
    AlarmKind,
    alarm_from_json,
    alarm_to_json,
    sentence,
)
from gateway.core.alarms.rules import AlarmRules, Says
from gateway.core.alarms.watch import AlarmWatch
from gateway.estimates.batch_estimate import Estimate, Quantity, Weight, Weights
from gateway.records import Why, json_line

RULES = AlarmRules()
GROSS = AlarmCause(AlarmKind.OVERLOAD, "gross")
OVER = LIMIT_KG + 60.0
RAISED, ENDED = ("overload.gross", True), ("overload.gross", False)


def told(watch: AlarmWatch, *estimates: Estimate) -> list[tuple[str, bool]]:
    """The changes of alarms, batch by batch: the cause, and whether it is active."""
    alarms = [alarm for one in estimates for alarm in watch.weigh(one, VAN)]
    return [(alarm.cause.name, alarm.is_active) for alarm in alarms]


def watching(**settings: object) -> AlarmWatch:
    return AlarmWatch(replace(RULES, **settings), "van")


def overloaded() -> AlarmWatch:
    watch = watching()
    assert told(watch, of_load(1, OVER, n_batches=2)) == [RAISED]
    return watch


def test_two_batches_of_a_load_raise_an_alarm_and_unloading_ends_it() -> None:
    watch = watching()
    assert told(watch, of_load(0, OVER)) == []
    assert told(watch, of_load(1, OVER, n_batches=2), of_load(2, OVER, n_batches=3)) == [RAISED]
    assert told(watch, of_load(4, LIMIT_KG - 200.0)) == [ENDED]
    assert told(watch, of_load(5, OVER, n_batches=2)) == [RAISED]


def test_a_clock_that_is_put_back_silences_no_alarm() -> None:
    """What began by the clock that was ahead ends when it began, not before; what begins after it has its own time."""
    watch, later = watching(), of_load(600, OVER, n_batches=2)
    assert told(watch, later) == [RAISED]
    (ended,) = watch.weigh(of_load(0, LIMIT_KG - 200.0), VAN)
    assert ended.t_end_ns == ended.t_start_ns == later.t_end_ns
    (begun,) = watch.weigh(of_load(1, OVER, n_batches=2), VAN)
    assert begun.t_start_ns == of_load(1, OVER).t_end_ns


def test_one_batch_against_its_load_raises_no_alarm() -> None:
    assert told(watching(), of_load(0, OVER, LIMIT_KG - 40.0, n_batches=5)) == []


def test_between_the_probabilities_an_alarm_stays_as_it_is() -> None:
    near = [of_load(n, LIMIT_KG + kg, n_batches=n) for n, kg in ((2, 0.0), (3, 3.0), (4, -3.0))]
    assert told(overloaded(), *near) == []
    assert told(watching(), *near) == []


def test_an_axle_has_its_own_alarm_and_its_own_limit() -> None:
    """1500 kg at the rear with 300 kg less than the gross limit: most of the load lies behind the axle."""
    behind = of_load(0, LIMIT_KG - 100.0, share_pct=35.0, n_batches=2)
    assert behind.weights.rear_axle.kg > 1500.0
    assert told(watching(), behind) == [("overload.rear_axle", True)]


def test_a_wheel_has_its_own_alarm() -> None:
    heavy = Weight(620.0, 5.0, 600.0, None, interval95_kg=(608.0, 634.0))
    weights = Weights(rear_left=heavy, rear_right=Weight(500.0, 5.0, 600.0, None))
    (raised,) = watching().weigh(replace(of_load(0, 300.0, n_batches=2), weights=weights), None)
    assert sentence(raised) == "The wheel at the rear left weighs 620 +- 13 kg, limit 600 kg"


def test_without_a_limit_overload_alarms_end() -> None:
    watch = overloaded()
    (ended,) = watch.weigh(of_load(2, OVER, n_batches=3), replace(VAN, gross_limit_kg=None))
    assert not ended.is_active
    assert ended.figure.found_kg == pytest.approx(2560.0)


def test_unknown_weights_change_no_alarm() -> None:
    watch = overloaded()
    assert told(watch, replace(of_load(2, 0.0), payload=Quantity(), posterior=None, epoch=None)) == []
    assert told(watch, batch(15.0, 20.0, None), replace(of_load(3, 0.0), is_provisional=True)) == []
    assert [alarm.cause for alarm in watch.active()] == [GROSS]
    assert told(watching(), replace(of_load(0, OVER + 500.0, n_batches=2), is_provisional=True)) == []


def refused(n: int, *why: Why) -> Estimate:
    return replace(batch(5.0 * n, 5.0 * (n + 1), None), rejected=why)


def test_a_sensor_is_at_fault_with_two_refusals_in_a_row_for_its_sake() -> None:
    watch = watching()
    assert told(watch, refused(0, Why.ACCELERATION_STUCK), refused(1, Why.TOO_SLOW)) == []
    assert told(watch, refused(2, Why.PITCH_RATE_STUCK), refused(3, Why.NO_CALIBRATION)) == []
    assert told(watch, refused(4, Why.PITCH_RATE_STUCK)) == [("sensor_fault.refused", True)]
    (alarm,) = watch.active()
    assert sentence(alarm) == (
        "Batches are refused because of a sensor: the pitch rate repeated the same number for stuck_s"
    )
    assert told(watch, refused(5, Why.TOO_SLOW)) == []
    assert told(watch, of_load(6, 300.0)) == [("sensor_fault.refused", False)]


@pytest.mark.parametrize("off", ["overload", "overload.gross"])
def test_a_disabled_alarm_is_not_reported_and_ends(off: str) -> None:
    assert off in CAUSE_NAMES
    assert told(watching(off=(off,)), of_load(0, OVER, n_batches=2)) == []
    (active,) = overloaded().active()
    (ended,) = AlarmWatch(replace(RULES, off=(off,)), "van", [active]).end_switched_off(at(30))
    assert (ended.id, ended.is_active) == (active.id, False)


VERDICTS = st.lists(st.tuples(st.sampled_from([GROSS, SILENT, REFUSED]), st.sampled_from([True, False, None])))


def run(says: list[tuple[AlarmCause, bool | None]], cut: int | None = None) -> list[Alarm]:
    """Every revision told; at ``cut`` the service is started anew from what it stored."""
    watch, revisions = AlarmWatch(RULES, "van"), []
    for n, (cause, verdict) in enumerate(says):
        if n == cut:
            watch = AlarmWatch(RULES, "van", [stored(alarm) for alarm in revisions])
        revisions += watch.note([Says(cause, verdict, AlarmFigure(detail=str(n)))], T0_NS + n)
    return [stored(alarm) for alarm in revisions]


def stored(alarm: Alarm) -> Alarm:
    return alarm_from_json(json.loads(json_line(alarm_to_json(alarm))))


@given(VERDICTS, st.integers(0, 20))
def test_each_alarm_is_raised_and_ended_once_and_a_restart_changes_nothing(
    says: list[tuple[AlarmCause, bool | None]], cut: int
) -> None:
    active: dict[str, Alarm] = {}
    for alarm in run(says):
        before = active.pop(alarm.cause.name, None)
        if alarm.is_active:
            assert before is None
            active[alarm.cause.name] = alarm
        else:
            assert before is not None
            assert (before.id, before.figure.detail) == (alarm.id, alarm.figure.detail)
    assert run(says, cut) == run(says)


def test_the_sentence_names_what_is_too_heavy_and_whether_it_still_is() -> None:
    watch = overloaded()
    assert [sentence(alarm) for alarm in watch.active()] == ["The vehicle weighs 2560 +- 22 kg, limit 2500 kg"]
    (alarm,) = watch.weigh(of_load(2, 100.0), VAN)
    assert sentence(alarm) == "The vehicle weighs 2560 +- 22 kg, limit 2500 kg (ended)"
