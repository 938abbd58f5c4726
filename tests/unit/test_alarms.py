"""Alarms: when they are told, confirmed and ended, at most one early and one final word each."""

import json
import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.alarms import LIMIT_KG, VAN, of_load
from support.days import T0_NS, at, batch
from support.estimates import posterior_of

from gateway.core.alarms.alarm import (
    CAUSE_NAMES,
    NO_ESTIMATE,
    REFUSED,
    SILENT,
    Alarm,
    AlarmCause,
    AlarmFigure,
    AlarmKind,
    AlarmState,
    alarm_from_json,
    alarm_to_json,
    sentence,
)
from gateway.core.alarms.rules import AlarmRules, AlarmVerdict, Says, beyond_probability
from gateway.core.alarms.watch import AlarmWatch
from gateway.core.fusion import epoch_of
from gateway.errors import RefusedError
from gateway.estimate import Estimate, Quantity
from gateway.records import Why, json_line

RULES = AlarmRules()
GROSS = AlarmCause(AlarmKind.OVERLOAD, "gross")


def told(watch: AlarmWatch, *estimates: Estimate) -> list[tuple[str, str]]:
    """What is told of, batch by batch: cause and state."""
    alarms = [alarm for one in estimates for alarm in watch.weigh(one, VAN)]
    return [(alarm.cause.name, alarm.state.value) for alarm in alarms]


def watching(**settings: object) -> AlarmWatch:
    return AlarmWatch(replace(RULES, **settings), "van")


def test_one_batch_warns_early_the_load_confirms_and_unloading_ends_it() -> None:
    watch = watching()
    over = LIMIT_KG + 60.0
    assert told(watch, of_load(0, over)) == [("overload.gross", "early")]
    assert told(watch, of_load(1, over, n_batches=2)) == [("overload.gross", "final")]
    assert told(watch, of_load(2, over, n_batches=3), of_load(3, over, n_batches=4)) == []
    assert told(watch, of_load(4, LIMIT_KG - 200.0)) == [("overload.gross", "cleared")]


def test_a_clock_that_is_put_back_silences_no_alarm() -> None:
    """What began by the clock that was ahead ends when it began, not before; what begins after it has its own time."""
    watch, over = watching(), LIMIT_KG + 60.0
    assert told(watch, of_load(600, over)) == [("overload.gross", "early")]
    assert told(watch, of_load(0, LIMIT_KG - 200.0)) == [("overload.gross", "cleared")]
    (begun,) = watch.weigh(of_load(1, over), VAN)
    assert (begun.state, begun.steps[0].t_ns) == (AlarmState.EARLY, of_load(1, over).t_end_ns)


def test_a_load_that_denies_what_one_batch_says_warns_nobody() -> None:
    assert told(watching(), of_load(0, LIMIT_KG + 60.0, LIMIT_KG - 40.0, n_batches=5)) == []


def test_a_load_that_becomes_sure_slowly_is_confirmed_at_once() -> None:
    """No batch alone is sure enough for the early warning, four together are for the final one."""
    near = LIMIT_KG + 15.0
    sure = of_load(3, near, n_batches=4)
    assert sure.epoch is not None
    sure = replace(sure, epoch=epoch_of(posterior_of(near, 50.0, 8.0, 0.5), 4))
    assert told(watching(), of_load(0, near), sure) == [("overload.gross", "final")]


def test_between_the_probabilities_an_alarm_stays_as_it_is() -> None:
    watch = watching()
    assert told(watch, of_load(0, LIMIT_KG + 60.0)) == [("overload.gross", "early")]
    assert told(watch, of_load(1, LIMIT_KG), of_load(2, LIMIT_KG + 3.0), of_load(3, LIMIT_KG - 3.0)) == []
    assert told(watching(), of_load(0, LIMIT_KG), of_load(1, LIMIT_KG + 3.0)) == []


def test_an_axle_has_its_own_alarm_and_its_own_limit() -> None:
    """1500 kg at the rear with 300 kg less than the gross limit: most of the load lies behind the axle."""
    behind = of_load(0, LIMIT_KG - 100.0, share_pct=35.0)
    assert behind.weights.rear_axle.kg > 1500.0
    assert told(watching(), behind) == [("overload.rear_axle", "early")]


def test_without_a_limit_nothing_is_too_much_and_what_stood_is_over() -> None:
    watch = watching()
    over = of_load(0, LIMIT_KG + 60.0)
    assert told(watch, over) == [("overload.gross", "early")]
    lighter = replace(VAN, gross_limit_kg=None)
    (ended,) = watch.weigh(of_load(1, LIMIT_KG + 60.0), lighter)
    assert (ended.state, ended.steps[-1].figure.detail) == (AlarmState.CLEARED, "no limit is given")
    assert ended.last_active_step.figure.found == over.weights.gross.kg


def test_a_weight_that_nobody_knows_changes_nothing() -> None:
    watch = watching()
    assert told(watch, of_load(0, LIMIT_KG + 60.0))
    assert told(watch, replace(of_load(1, 0.0), payload=Quantity(), posterior=None, epoch=None)) == []
    assert told(watch, batch(10.0, 15.0, None)) == []
    assert [alarm.cause for alarm in watch.active()] == [GROSS]


def test_an_early_look_raises_no_alarm() -> None:
    assert told(watching(), replace(of_load(0, LIMIT_KG + 500.0), is_provisional=True)) == []


def test_a_side_that_bears_too_much() -> None:
    found = of_load(0, 300.0, cg_left_m=0.15)  # 60 % of a track of 1.5 m
    watch = watching()
    (alarm,) = watch.weigh(found, VAN)
    assert (alarm.cause.name, alarm.state) == ("imbalance.left_right", AlarmState.EARLY)
    assert alarm.steps[-1].figure.found == pytest.approx(60.0)
    assert sentence(alarm) == "One side bears 60 +- 1 %, limit 55 %"


def test_an_axle_that_bears_too_much_of_the_whole() -> None:
    assert told(watching(off=("overload",)), of_load(0, 300.0, share_pct=20.0)) == [("imbalance.front_rear", "early")]


def test_the_probability_of_either_side_is_even_and_that_of_one_far_off_is_the_normal_tail() -> None:
    assert beyond_probability(Quantity(60.0, 2.0), 55.0) == pytest.approx(beyond_probability(Quantity(40.0, 2.0), 55.0))
    assert beyond_probability(Quantity(55.0, 1.0), 55.0) == pytest.approx(0.5, abs=1e-6)
    assert beyond_probability(Quantity(50.0, 5.0), 55.0) == pytest.approx(2 * 0.158655, abs=1e-5)
    assert math.isnan(beyond_probability(Quantity(), 55.0))


def refused(n: int, *why: Why) -> Estimate:
    return replace(batch(5.0 * n, 5.0 * (n + 1), None), rejected=why)


def test_a_sensor_is_at_fault_with_one_refusal_for_its_sake_for_sure_with_two() -> None:
    watch = watching()
    assert told(watch, refused(0, Why.ACCELERATION_STUCK)) == [("sensor_fault.refused", "early")]
    assert told(watch, refused(1, Why.TOO_SLOW)) == []
    assert told(watch, refused(2, Why.PITCH_RATE_STUCK), refused(3, Why.PITCH_RATE_STUCK)) == [
        ("sensor_fault.refused", "final")
    ]
    assert told(watch, of_load(4, 300.0)) == [("sensor_fault.refused", "cleared")]


def test_driving_for_long_without_an_estimate_is_told_after_the_time_and_for_sure_after_twice() -> None:
    watch = watching(no_estimate_s=1800.0)
    slow = [refused(n, Why.TOO_SLOW) for n in range(20)]
    assert told(watch, *slow[:5]) == []
    (alarm,) = watch.weigh(slow[5], VAN)
    figure = alarm.steps[-1].figure
    assert (alarm.cause.name, alarm.state) == ("no_estimate", AlarmState.EARLY)
    assert (figure.found, figure.limit, figure.unit) == (30.0, 30.0, "min")
    assert told(watch, *slow[6:12]) == [("no_estimate", "final")]
    assert told(watch, *slow[12:], of_load(20, 300.0)) == [("no_estimate", "cleared")]


def test_without_a_calibration_there_is_no_alarm_for_want_of_estimates() -> None:
    assert told(watching(no_estimate_s=600.0), *[refused(n, Why.NO_CALIBRATION) for n in range(20)]) == []


@pytest.mark.parametrize("off", ["overload", "overload.gross"])
def test_what_is_switched_off_is_not_told_and_ends(off: str) -> None:
    assert off in CAUSE_NAMES
    over = of_load(0, LIMIT_KG + 60.0)
    assert told(watching(off=(off,)), over) == []
    watch = watching()
    (standing,) = watch.weigh(over, VAN)
    (ended,) = AlarmWatch(replace(RULES, off=(off,)), "van", [standing]).end_switched_off(at(30))
    assert (ended.id, ended.state, ended.steps[-1].figure.detail) == (standing.id, AlarmState.CLEARED, "switched off")


def test_somebody_acknowledges_once_by_name() -> None:
    watch = watching()
    (alarm,) = watch.weigh(of_load(0, LIMIT_KG + 60.0), VAN)
    seen = watch.acknowledge(alarm.id, "yard", "two pallets off", at(7))
    assert (seen.revision, seen.is_active, seen.acknowledged and seen.acknowledged.by) == (2, True, "yard")
    with pytest.raises(RefusedError, match="was acknowledged by yard"):
        watch.acknowledge(alarm.id, "yard", None, at(8))
    with pytest.raises(RefusedError) as refusal:
        watch.acknowledge("alarm-1-2", "yard", None, at(8))
    assert refusal.value.reason == "no_such_alarm"


def test_an_acknowledged_alarm_goes_on_and_the_next_one_is_unseen() -> None:
    watch = watching()
    (alarm,) = watch.weigh(of_load(0, LIMIT_KG + 60.0), VAN)
    watch.acknowledge(alarm.id, "yard", None, at(7))
    (confirmed,) = watch.weigh(of_load(1, LIMIT_KG + 60.0, n_batches=2), VAN)
    assert confirmed.acknowledged is not None
    assert told(watch, of_load(2, 100.0)) == [("overload.gross", "cleared")]
    assert watch.unseen() == []
    (again,) = watch.weigh(of_load(3, LIMIT_KG + 60.0), VAN)
    assert (again.acknowledged, again.revision) == (None, 1)
    assert again.id != alarm.id


def test_an_alarm_that_ended_can_still_be_acknowledged() -> None:
    watch = watching()
    (alarm,) = watch.weigh(of_load(0, LIMIT_KG + 60.0), VAN)
    assert told(watch, of_load(1, 100.0)) == [("overload.gross", "cleared")]
    assert [one.id for one in watch.unseen()] == [alarm.id]
    watch.acknowledge(alarm.id, "yard", None, at(20))
    assert watch.unseen() == []


VERDICTS = st.lists(st.tuples(st.sampled_from([GROSS, SILENT, REFUSED, NO_ESTIMATE]), st.sampled_from(AlarmVerdict)))


def run(says: list[tuple[AlarmCause, AlarmVerdict]], cut: int | None = None) -> list[Alarm]:
    """Every revision told; at ``cut`` the service is started anew from what it stored."""
    watch, revisions = AlarmWatch(RULES, "van"), []
    for n, (cause, verdict) in enumerate(says):
        if n == cut:
            watch = AlarmWatch(RULES, "van", [stored(alarm) for alarm in revisions])
        revisions += watch.note([Says(cause, verdict, AlarmFigure(detail=str(n)))], T0_NS + n)
    return [stored(alarm) for alarm in revisions]


def stored(alarm: Alarm) -> Alarm:
    return alarm_from_json(json.loads(json_line(alarm_to_json(alarm, sentence(alarm)))))


@given(VERDICTS)
def test_each_alarm_goes_forward_and_says_each_word_once(says: list[tuple[AlarmCause, AlarmVerdict]]) -> None:
    order = list(AlarmState)
    last: dict[str, Alarm] = {}
    for alarm in run([(cause, verdict) for cause, verdict in says]):
        states = [order.index(step.state) for step in alarm.steps]
        assert states == sorted(set(states))
        before = last.get(alarm.cause.name)
        if before is not None and before.is_active:
            assert (alarm.revision, alarm.steps[:-1]) == (before.revision + 1, before.steps)
        else:
            assert alarm.revision == 1
        last[alarm.cause.name] = alarm


@given(VERDICTS, st.integers(0, 20))
def test_a_restart_changes_nothing_of_what_is_told(says: list[tuple[AlarmCause, AlarmVerdict]], cut: int) -> None:
    assert run(says, cut) == run(says)


def test_an_alarm_that_never_stood_is_none() -> None:
    (alarm,) = watching().weigh(of_load(0, LIMIT_KG + 60.0), VAN)
    told_json = alarm_to_json(alarm, "")
    told_json["steps"][0]["state"] = "cleared"
    with pytest.raises(ValueError, match="without an early or final step"):
        alarm_from_json(told_json)


def test_words_say_what_is_the_matter_how_sure_and_what_became_of_it() -> None:
    watch = watching()
    (alarm,) = watch.weigh(of_load(0, LIMIT_KG + 60.0), VAN)
    assert sentence(alarm) == "The vehicle weighs 2560 +- 27 kg, limit 2500 kg"
    (alarm,) = watch.weigh(of_load(1, LIMIT_KG + 60.0, n_batches=2), VAN)
    assert sentence(alarm).endswith(" (confirmed)")
    (alarm,) = watch.weigh(of_load(2, 100.0), VAN)
    assert sentence(alarm) == "The vehicle weighs 2560 +- 22 kg, limit 2500 kg (ended)"
