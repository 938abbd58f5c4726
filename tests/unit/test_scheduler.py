"""Where drives and windows begin and end."""

import numpy as np
import pytest
from support.drives import T0_NS, changed, drive, joined, later, without_rows

from gateway.core.batch_settings import BatchSettings
from gateway.core.scheduler import Scheduler
from gateway.records import Batch, Motion, Signal, Why

RATE_HZ = 50.0


def batches_of(motion: Motion, settings: BatchSettings | None = None) -> list[Batch]:
    scheduler = Scheduler(settings or BatchSettings(), {})
    return [*scheduler.feed(motion), *scheduler.flush()]


def spans_s(batches: list[Batch]) -> list[tuple[float, float]]:
    return [((b.t_start_ns - T0_NS) / 1e9, (b.t_end_ns - T0_NS) / 1e9) for b in batches]


@pytest.mark.parametrize(("last_s", "rejected"), [(286.0, ()), (284.0, (Why.TOO_SHORT,))])
def test_the_last_batch_counts_from_95_percent_of_the_window(last_s: float, rejected: tuple[Why, ...]) -> None:
    batches = batches_of(drive(300.0 + last_s, None, RATE_HZ))
    assert [batch.rejected for batch in batches] == [(), rejected]


def test_a_minute_of_standstill_ends_the_drive_and_moving_begins_the_next() -> None:
    standing = drive(500.0, lambda t_s: np.where((t_s > 100.0) & (t_s < 190.0), 0.0, 14.0), RATE_HZ)
    first, *others = batches_of(standing)
    assert spans_s([first])[0] == pytest.approx((0.0, 160.0), abs=0.2)
    assert first.rejected == (Why.TOO_SHORT,)  # ended like any drive: no fault is named beside it
    assert spans_s(others)[0] == pytest.approx((190.0, 490.0), abs=0.2)
    assert others[0].drive_start_ns == others[0].t_start_ns
    assert others[0].rejected == ()


def test_a_shorter_stop_is_masked_inside_the_batch() -> None:
    (batch,) = batches_of(drive(300.0, lambda t_s: np.where((t_s > 100.0) & (t_s < 150.0), 0.0, 14.0), RATE_HZ))
    assert batch.rejected == ()
    assert batch.longest_stop_s == pytest.approx(50.0, abs=0.3)
    assert batch.shares[Why.TOO_SLOW] == pytest.approx(50.0 / 300.0, abs=0.002)
    assert not batch.usable[round(101.0 * 50.0) : round(149.0 * 50.0)].any()


def test_silence_ends_a_drive_only_when_it_is_long() -> None:
    broken = batches_of(without_rows(drive(400.0, None, RATE_HZ), 40.0, 51.0))
    assert spans_s(broken)[0] == pytest.approx((0.0, 40.0), abs=0.1)
    assert broken[0].rejected == (Why.TOO_SHORT, Why.GAP)
    assert spans_s(broken)[1] == pytest.approx((51.0, 351.0), abs=0.1)
    whole = batches_of(without_rows(drive(300.0, None, RATE_HZ), 40.0, 49.0))
    assert len(whole) == 1
    assert whole[0].rejected == ()
    assert whole[0].gap_share == pytest.approx(0.03, abs=0.001)


def test_a_clock_step_back_ends_the_drive() -> None:
    stepped = joined(drive(60.0, None, RATE_HZ), later(drive(300.0, None, RATE_HZ), 30.0))
    first, second = batches_of(stepped)
    assert first.rejected == (Why.TOO_SHORT, Why.CLOCK_STEP)
    assert spans_s([first, second]) == [pytest.approx((0.0, 60.0), abs=0.1), pytest.approx((30.0, 330.0), abs=0.1)]
    assert second.rejected == ()


def test_a_small_step_back_is_disorder_not_a_new_drive() -> None:
    stepped = joined(drive(150.0, None, RATE_HZ), later(drive(149.5, None, RATE_HZ), 149.5))
    (batch,) = batches_of(stepped)
    assert batch.drive_start_ns == T0_NS


def test_rows_later_than_their_window_are_counted() -> None:
    straight = drive(40.0, None, RATE_HZ)
    early = int(np.searchsorted(straight.t_ns, T0_NS + 19_900_000_000))
    late = straight.part(early, early + 10)
    scheduler = Scheduler(BatchSettings(window_s=20.0), {})
    after = int(np.searchsorted(straight.t_ns, T0_NS + 20_200_000_000))
    assert len(list(scheduler.feed(joined(straight.part(0, after), late, straight.part(after, len(straight)))))) == 1
    assert scheduler.n_late_rows == len(late)


@pytest.mark.parametrize(
    "settings", [BatchSettings(window_s=5.0), BatchSettings(window_s=10.0, provisional_every_s=2.0)]
)
def test_a_silent_window_is_a_batch_of_nothing(settings: BatchSettings) -> None:
    batches = batches_of(without_rows(drive(40.0, None, RATE_HZ), 10.0, 19.5), settings)
    silent = [batch for batch in batches if batch.t_end_ns <= T0_NS + 19_000_000_000 and batch.gap_share > 0.45]
    assert silent
    assert all(Why.GAP in batch.rejected for batch in silent if not batch.is_provisional)


def test_provisional_looks_grow_with_the_window() -> None:
    looks = [
        b for b in batches_of(drive(300.5, None, RATE_HZ), BatchSettings(provisional_every_s=60.0)) if b.is_provisional
    ]
    assert spans_s(looks) == [(0.0, 60.0), (0.0, 120.0), (0.0, 180.0), (0.0, 240.0)]
    assert [look.rejected for look in looks] == [()] * 4


def test_wheel_speed_alone_shows_standstill() -> None:
    moving = drive(200.0, lambda t_s: np.where(t_s > 50.0, 0.0, 14.0), RATE_HZ)
    by_wheels = Motion((*moving.signals[:2], Signal.WHEEL_SPEED), moving.t_ns, moving.columns)
    assert spans_s(batches_of(by_wheels)) == [pytest.approx((0.0, 110.0), abs=0.2)]


def test_without_any_speed_no_standstill_is_seen() -> None:
    silent = changed(drive(200.0, None, RATE_HZ), Signal.SPEED, 0.0, 200.0, lambda x: np.full_like(x, np.nan))
    (batch,) = batches_of(silent)
    assert Why.SPEED_MISSING in batch.rejected
