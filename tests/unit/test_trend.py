"""Parameters that drift: told in time, and not where they only scatter."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.stats import theilslopes
from support.calibrated import calibration_file
from support.epochs import drive_of, stored
from support.log import names
from support.patience import PATIENCE_S, wait_until

from gateway.calibration.trend import Sums, TrendHistory, Week, found_pct, monday_of, theil_sen, trends_of
from gateway.estimate import Estimate
from gateway.estimate_json import estimate_to_json
from gateway.history import HistoryPage
from gateway.log import Event
from gateway.records import Why
from gateway.service.verification import trend as trend_keeper
from gateway.service.verification.trend import TrendService
from gateway.setup import Subject
from gateway.units import NS_PER_S

MONDAY_NS = 1_790_035_200 * NS_PER_S  # 2026-09-22 is a Tuesday
WEEK_NS = 7 * 86_400 * NS_PER_S
CALIBRATED = calibration_file().for_core()


def batch(t_end_ns: int, front: float = 1.0, rear: float = 1.0, *rejected: Why, calibration_id: str = "a") -> Estimate:
    return Estimate(
        t_start_ns=t_end_ns - 300 * NS_PER_S,
        t_end_ns=t_end_ns,
        estimator="cross_spectrum",
        calibration_id=calibration_id,
        rejected=rejected,
        diagnostics={"damper_front_freed_ratio": front, "damper_rear_freed_ratio": rear, "delay_scale": 0.0},
    )


def weeks(rear_pct: "np.ndarray", calibration_id: str = "a") -> list[Week]:
    """One mean a week."""
    return [
        Week(
            monday=monday_of(MONDAY_NS + n * WEEK_NS),
            calibration_id=calibration_id,
            found={
                name: Sums(n=10, sum_pct=10.0 * each, square_pct2=10.0 * each**2)
                for name, each in (("damper_front", 0.0), ("damper_rear", float(pct)), ("delay", 0.0))
            },
        )
        for n, pct in enumerate(rear_pct)
    ]


def rear_of(pct: "np.ndarray") -> tuple[bool, str | None]:
    (trend,) = [one for one in trends_of(weeks(pct), [], "a", 1240.0) if one.name == "damper_rear"]
    return trend.is_drifting, trend.sentence()


@pytest.mark.parametrize("share", [-0.0015, 0.0, 0.0004])
def test_a_rear_axle_that_comes_early_is_heard_like_one_that_comes_late(share: float) -> None:
    """As batches tell it, the delay is off by a share of either sign: 0 where it is as calibrated."""
    found = found_pct(replace(batch(MONDAY_NS), diagnostics={**batch(MONDAY_NS).diagnostics, "delay_scale": share}))
    assert found == {"damper_front": 0.0, "damper_rear": 0.0, "delay": pytest.approx(100.0 * share)}


def test_a_damper_that_wears_is_told_with_how_much_and_since_when() -> None:
    wears = -0.5 * np.arange(26) + np.random.default_rng(1).normal(0.0, 1.0, 26)
    is_drifting, sentence = rear_of(wears)
    assert is_drifting
    assert sentence.startswith("damper rear has drifted by -1")
    assert "since 2026-09-2" in sentence


def test_a_few_odd_weeks_are_no_drift_and_hide_none() -> None:
    quiet = np.zeros(26)
    quiet[[20, 23, 25]] = -30.0
    assert rear_of(quiet) == (False, None)
    wears = -0.5 * np.arange(26)
    wears[[3, 11, 24]] = 30.0
    assert rear_of(wears)[0]


@pytest.mark.parametrize("n_weeks", [0, 1, 7])
def test_too_few_weeks_tell_no_drift(n_weeks: int) -> None:
    assert rear_of(-3.0 * np.arange(n_weeks)) == (False, None)


def level_of(pct: "np.ndarray", name: str = "damper_rear") -> tuple[bool, str | None]:
    """Of batches of one week; the gyro's gain comes with batches that were refused for it."""
    key = {"damper_rear": "damper_rear_freed_ratio", "gyro_gain": "gyro_gain_ratio"}[name]
    why = (Why.SENSOR_CHANGED,) if name == "gyro_gain" else ()
    batches = [
        replace(batch(MONDAY_NS, 1.0, 1.0, *why), diagnostics={"delay_scale": 0.0, key: math.exp(one / 100.0)})
        for one in pct
    ]
    trends = {one.name: one for one in trends_of(TrendHistory().with_batches(batches, "c").weeks, [], "a", 1240.0)}
    return trends[name].is_off, trends[name].sentence()


def test_dampers_that_are_worn_are_told_after_two_hours() -> None:
    worn = -43.0 + np.random.default_rng(1).normal(0.0, 7.0, 24)
    is_off, sentence = level_of(worn)
    assert is_off
    assert sentence.startswith("the rear dampers are 3")
    assert "% weaker than at calibration (" in sentence
    assert level_of(worn[:23]) == (False, None)
    assert level_of(-worn)[1] is not None
    assert "stiffer" in str(level_of(-worn)[1])


def test_a_level_below_a_fifth_and_one_that_scatters_as_much_are_none() -> None:
    assert level_of(np.full(40, -20.0)) == (False, None)  # 18 %
    assert level_of(np.tile([-140.0, 90.0], 20)) == (False, None)


def test_a_gyro_s_gain_is_told_of_batches_that_were_refused_for_it() -> None:
    is_off, sentence = level_of(3.0 + np.random.default_rng(2).normal(0.0, 0.8, 24), "gyro_gain")
    assert is_off
    assert str(sentence).startswith("the gyro's gain is 3.")
    assert level_of(np.full(24, 1.5), "gyro_gain") == (False, None)


def test_a_sure_but_small_change_is_no_warning() -> None:
    assert not rear_of(-0.05 * np.arange(52))[0]


@pytest.mark.parametrize(("pct", "is_told"), [(4.5, False), (5.5, True)])
def test_a_damper_is_told_from_five_per_cent(pct: float, is_told: bool) -> None:
    assert rear_of(-pct * np.arange(53) / 52.0)[0] is is_told


@pytest.mark.parametrize(("scatter_pct", "n_years", "n_most", "seed"), [(2.0, 100, 0, 2), (12.0, 200, 6, 3)])
def test_scatter_alone_seldom_warns(scatter_pct: float, n_years: int, n_most: int, seed: int) -> None:
    """Years of weeks of one vehicle that stays as it is; of 12 % only the interval keeps a chance change back."""
    rng = np.random.default_rng(seed)
    assert sum(rear_of(rng.normal(0.0, scatter_pct, 52))[0] for _ in range(n_years)) <= n_most


def test_a_zero_that_creeps_is_told_in_kg() -> None:
    zeros = [(f"2026-{month:02d}-01T00:00:00.000000Z", 4.0 * month) for month in range(1, 8)]
    trend = trends_of([], zeros, "a", 1240.0)[-1]
    assert (trend.name, trend.unit, trend.is_drifting) == ("zero", "kg", True)
    assert trend.change == pytest.approx(24.0, abs=0.5)


def test_another_calibration_begins_anew() -> None:
    assert all(not one.points for one in trends_of(weeks(-np.arange(20.0)), [], "b", 1240.0))


def test_batches_are_gathered_by_week_in_whatever_pieces_they_come() -> None:
    batches = [batch(MONDAY_NS + n * WEEK_NS // 4, rear=math.exp(0.01 * n)) for n in range(12)]
    whole = TrendHistory().with_batches(batches, "c")
    pieces = TrendHistory()
    for one in batches[::-1]:
        pieces = pieces.with_batches([one], "c")
    rear = [week.found["damper_rear"] for week in whole.weeks]
    assert [(week.monday, week.found["damper_rear"].n) for week in pieces.weeks] == [
        (week.monday, one.n) for week, one in zip(whole.weeks, rear, strict=True)
    ]
    assert sum(one.n for one in rear) == 12
    assert sum(one.sum_pct for one in rear) == pytest.approx(66.0)
    assert sum(one.square_pct2 for one in rear) == pytest.approx(sum(n**2 for n in range(12)))
    assert whole.cursor == "c"


def test_what_found_nothing_is_passed_over() -> None:
    assert found_pct(batch(0, 1.1, 1.0, Why.GAP)) is None
    assert found_pct(replace(batch(0), diagnostics={})) is None
    assert found_pct(batch(0, float("nan"))) == {"damper_rear": 0.0, "delay": 0.0}
    misfit = found_pct(batch(0, 1.1, 1.0, Why.MODEL_MISFIT))  # a vehicle that drifted far is refused so
    assert misfit["damper_front"] == pytest.approx(100.0 * math.log(1.1))


def test_the_keeper_goes_on_where_it_was_and_counts_nothing_twice(tmp_path: Path) -> None:
    store = stored(tmp_path / "store", drive_of(2, 100.0))
    subject = Subject(CALIBRATED, "cross_spectrum", "van-17")
    for n in range(3):
        for i in range(4):
            one = batch(
                MONDAY_NS + (4 * n + i) * WEEK_NS, rear=math.exp(-0.02 * (4 * n + i)), calibration_id=CALIBRATED.id
            )
            store.write_estimate(estimate_to_json(one))
        assert store.flush(PATIENCE_S)
        keeper = TrendService(tmp_path, subject, store.reader().estimates, lambda: [])  # a restart
        keeper.catch_up()
        keeper.catch_up()
    told = json.loads(keeper.state())
    (rear,) = [one for one in told["parameters"] if one["name"] == "damper_rear"]
    assert [point["n"] for point in rear["points"]] == [1] * 12
    assert rear["is_drifting"] is True
    assert "damper rear has drifted by -22.0 %" in str(keeper.fault)
    store.close()


def test_a_file_that_cannot_be_believed_is_set_aside_and_made_anew(tmp_path: Path) -> None:
    (tmp_path / "trend.json").write_text("{")
    store = stored(tmp_path / "store", [batch(MONDAY_NS, calibration_id=CALIBRATED.id)])
    subject = Subject(CALIBRATED, "cross_spectrum", "van-17")
    keeper = TrendService(tmp_path, subject, store.reader().estimates, lambda: [])
    assert "set aside" in str(keeper.fault)
    keeper.catch_up()
    assert keeper.fault is None
    assert json.loads(keeper.state())["parameters"][0]["points"][0]["n"] == 1
    store.close()


def test_what_no_version_wrote_ends_no_following(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """The thread died of it in silence, and no drift was ever told."""
    monkeypatch.setattr(trend_keeper, "FIRST_S", 0.0)
    monkeypatch.setattr(trend_keeper, "EVERY_S", 0.01)
    asked: list[object] = []

    def ask(**question: object) -> HistoryPage:
        asked.append(question)
        return HistoryPage(("[]",), None, "a-1")

    keeper = TrendService(tmp_path, Subject(CALIBRATED, "cross_spectrum", "van-17"), ask, lambda: [])
    keeper.start()
    assert wait_until(lambda: len(asked) >= 2)
    keeper.stop()
    assert Event.TREND_NOT_KEPT in names(caplog)


@given(points=st.lists(st.tuples(st.integers(0, 40), st.integers(-5, 5)), min_size=3, max_size=40))
def test_slope_and_interval_are_scipys(points: list[tuple[int, int]]) -> None:
    days, numbers = [float(day) for day, _ in points], [float(number) for _, number in points]
    assume(len(set(days)) > 1)
    with np.errstate(invalid="ignore"):  # of a negative variance, which both tell as unknown
        known = theilslopes(numbers, days, alpha=0.99)
    expected = (known.slope, known.low_slope, known.high_slope)
    assert theil_sen(days, numbers, 0.99) == pytest.approx(expected, nan_ok=True)
