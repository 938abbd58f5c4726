"""A vehicle week by week, its batches counted and averaged; its sensors day by day."""

import math
from datetime import date, timedelta
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import polars as pl
import pytest
from support.fleet import DAY_S, MONDAY_S, row, week, write_table

from gateway.archive import place_of
from gateway.archive.fleet.batches import read_batches
from gateway.archive.fleet.faulty_sensors import Health, Share, troubles_of
from gateway.archive.fleet.weeks import monday_of, weeks_of
from gateway.estimates.batch_estimate import Z95
from gateway.estimates.reasons import Cause


def batches_of(rows: list[dict[str, Any]]) -> pl.DataFrame:
    """Through Parquet and back."""
    with TemporaryDirectory() as folder:
        slot = write_table(Path(folder), "van", rows)
        return read_batches(place_of(folder), [slot])


def test_a_week_counts_its_batches_by_answer_limit_and_cause() -> None:
    """Refused batches are in no mean load and over no limit, but their parameters are in the medians."""
    answered = {"payload_kg": 200.0, "payload_std_kg": 5.0, "over_limit": ["gross"], "damper_front_ratio": 1.0}
    rows = [
        row(MONDAY_S + 300, **answered),
        row(MONDAY_S + 600, payload_kg=100.0, payload_std_kg=5.0, damper_front_ratio=None),
        row(MONDAY_S + 900, "time_stamps", "acceleration_stuck", over_limit=["gross"], damper_front_ratio=1.2),
        row(MONDAY_S + 1200, "too_slow", "a_reason_of_tomorrow", damper_front_ratio=1.4),
    ]
    [week] = weeks_of(batches_of(rows)).to_dicts()
    assert (week["n"], week["n_answered"], week["n_over_limit"]) == (4, 2, 1)
    assert {cause: week[cause] for cause in Cause if week[cause]} == {Cause.SENSORS: 1, Cause.DRIVE: 1}
    assert (week["payload_mean_kg"], week["payload_lower_quartile_kg"]) == (150.0, 125.0)
    assert week["damper_front_ratio"] == 1.2


def test_a_batch_without_a_payload_leaves_the_weekly_mean() -> None:
    told = row(MONDAY_S + 3600.0, payload_kg=200.0, payload_std_kg=10.0, payload_own_std_kg=None)
    share_alone = row(MONDAY_S + 7200.0, payload_kg=None, payload_std_kg=None, payload_own_std_kg=None)
    weeks = weeks_of(batches_of([told, share_alone]))
    assert weeks.select("n_answered", "payload_mean_kg").rows() == [(2, 200.0)]
    assert weeks["payload_high_kg"][0] == pytest.approx(200.0 + Z95 * 10.0)


def test_a_mean_is_no_surer_than_its_common_error() -> None:
    [one], [many] = (weeks_of(batches_of(week(0, n)))["payload_high_kg"] - 100.0 for n in (1, 200))
    assert one == pytest.approx(Z95 * 5.0)
    assert many == pytest.approx(Z95 * math.hypot(4.0, 3.0 / math.sqrt(200)))


def test_a_week_begins_on_monday() -> None:
    sunday, monday = row(MONDAY_S - 1), row(MONDAY_S)
    weeks = weeks_of(batches_of([sunday, monday]))
    assert weeks["monday"].to_list() == [date(2025, 12, 29), date(2026, 1, 5)]
    assert [monday_of(number) for number in weeks["week"]] == weeks["monday"].to_list()
    assert monday_of(0) == date(1969, 12, 29)


def days(*bad: bool, reason: str = "acceleration_stuck", n: int = 4) -> pl.DataFrame:
    """A day of four batches each; all of a bad one's refused."""
    rows = [
        row(MONDAY_S + day * DAY_S + 300 * (k + 1), *([reason] if is_bad else []))
        for day, is_bad in enumerate(bad)
        for k in range(n)
    ]
    return batches_of(rows)


def test_a_sensor_that_fails_for_good_is_bad_since_that_day() -> None:
    [trouble] = troubles_of(days(*[False] * 60, *[True] * 20))
    assert (trouble.health, trouble.since) == (Health.BAD, date(2026, 1, 5) + timedelta(days=60))
    assert (trouble.recent, trouble.days, trouble.n_batches) == (Share.of(14, 14), Share.of(20, 80), 80)


def test_a_sensor_that_fails_again_is_bad_since_it_did_so_and_not_since_it_was_mended() -> None:
    [again] = troubles_of(days(*[True] * 40, *[False] * 60, *[True] * 10))
    assert (again.health, again.since) == (Health.BAD, date(2026, 1, 5) + timedelta(days=100))


@pytest.mark.parametrize(("n_bad", "health"), [(5, Health.SOME), (6, Health.BAD)])
def test_more_than_a_fifth_of_the_recent_days_for_sure_are_bad(n_bad: int, health: Health) -> None:
    """Wilson's interval of 5 of 14 begins at 16 %, that of 6 at 21 %."""
    [found] = troubles_of(days(*[False] * (14 - n_bad), *[True] * n_bad))
    assert found.health is health


def test_a_mended_sensor_is_distinguished_from_an_intermittent_one() -> None:
    [mended] = troubles_of(days(*[False] * 20, *[True] * 20, *[False] * 30))
    assert (mended.health, mended.since) == (Health.WAS_BAD, None)
    [seldom] = troubles_of(days(*([False] * 9 + [True]) * 5))
    assert seldom.health is Health.SOME


def test_a_few_days_are_no_proof_and_one_batch_makes_no_bad_day() -> None:
    [few] = troubles_of(days(True, True, True, True))
    assert few.health is Health.SOME
    grazed_once = [["time_stamps"], [], [], []] * 30
    stamps = [MONDAY_S + day * DAY_S + 300 * k for day in range(30) for k in range(1, 5)]
    [grazed] = troubles_of(batches_of([row(at, *why) for at, why in zip(stamps, grazed_once, strict=True)]))
    assert (grazed.n_batches, grazed.days.n_bad, grazed.health) == (30, 0, Health.SOME)


def test_only_reasons_of_the_sensors_are_troubles() -> None:
    assert troubles_of(days(True, True, True, reason="too_slow")) == ()
