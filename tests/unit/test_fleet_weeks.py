"""A vehicle week by week, against the plain way of counting; its sensors day by day."""

import math
import statistics
from datetime import UTC, date, datetime, timedelta
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.fleet import DAY_S, MONDAY_S, row, week, write_table

from gateway.archive import place_of
from gateway.archive.fleet.batches import read_batches
from gateway.archive.fleet.faulty_sensors import Health, Share, troubles_of
from gateway.archive.fleet.weeks import monday_of, weeks_of
from gateway.estimates.batch_estimate import Z95
from gateway.estimates.reasons import EXPLANATIONS, Cause

REASONS = ["acceleration_stuck", "time_stamps", "too_slow", "model_misfit", "a_reason_of_tomorrow"]
CAUSE_OF = {str(why): told.cause for why, told in EXPLANATIONS.items()}
KNOWN = st.none() | st.floats(-50.0, 500.0)
ROWS = st.lists(
    st.builds(
        lambda hour, rejected, payload, std, own, damper, is_over: row(
            MONDAY_S + 3600.0 * hour,
            *rejected,
            **({} if rejected else {"payload_kg": payload, "payload_std_kg": std, "payload_own_std_kg": own}),
            damper_front_ratio=damper,
            over_limit=["gross"] if is_over else [],
        ),
        st.integers(0, 24 * 30),
        st.lists(st.sampled_from(REASONS), max_size=2, unique=True),
        st.floats(-50.0, 500.0),
        st.floats(1.0, 20.0),
        st.none() | st.floats(0.0, 30.0),
        KNOWN,
        st.booleans(),
    ),
    min_size=1,
    max_size=25,
    unique_by=lambda one: one["t_end_ns"],
)


def batches_of(rows: list[dict[str, Any]]) -> pl.DataFrame:
    """Through Parquet and back."""
    with TemporaryDirectory() as folder:
        slot = write_table(Path(folder), "van", rows)
        return read_batches(place_of(folder), [slot])


COUNTED = ("n", "n_answered", "n_over_limit", "payload_mean_kg", "payload_high_kg", "damper_front_ratio")


def by_hand(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The naive reference: a dictionary of lists, one pass."""
    found: dict[date, list[dict[str, Any]]] = {}
    for one in rows:
        day = datetime.fromtimestamp(one["t_end_ns"] / 1e9, UTC).date()
        found.setdefault(day - timedelta(days=day.weekday()), []).append(one)
    return [{"monday": monday, **_week_by_hand(inside)} for monday, inside in sorted(found.items())]


def _week_by_hand(rows: list[dict[str, Any]]) -> dict[str, Any]:
    answered = [one for one in rows if not one["rejected"]]
    common, own = [], []
    for one in answered:
        mine = min(one["payload_own_std_kg"] or 0.0, one["payload_std_kg"])
        own.append(mine)
        common.append(math.sqrt(one["payload_std_kg"] ** 2 - mine**2))
    dampers = [one["damper_front_ratio"] for one in rows if one["damper_front_ratio"] is not None]
    mean = statistics.fmean(one["payload_kg"] for one in answered) if answered else None
    reach = Z95 * math.hypot(statistics.fmean(common), math.hypot(*own) / len(own)) if answered else None
    return {
        "n": len(rows),
        "n_answered": len(answered),
        "n_over_limit": sum(bool(one["over_limit"]) for one in answered),
        "payload_mean_kg": mean,
        "payload_high_kg": mean + reach if answered else None,
        "damper_front_ratio": statistics.median(dampers) if dampers else None,
        **{str(c): sum(any(CAUSE_OF.get(why) is c for why in one["rejected"]) for one in rows) for c in Cause},
    }


@settings(max_examples=25, deadline=None)
@given(ROWS)
def test_weeks_are_counted_as_by_hand(rows: list[dict[str, Any]]) -> None:
    found = weeks_of(batches_of(rows)).select("monday", *COUNTED, *map(str, Cause)).to_dicts()
    assert [pytest.approx(week, nan_ok=True) for week in by_hand(rows)] == found


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
