"""The clock behind late stamps: delays pass, lost frames stay lost, and what no clock explains is said."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.drives import T0_NS, drive

from gateway.core.batch import BatchWindow, build_batch
from gateway.core.batch_settings import BatchSettings
from gateway.core.sample_clock import retimed, sample_times
from gateway.records import F64, I64, Motion, Why

DURATION_S = 120.0
Stamping = Callable[[F64, np.random.Generator], F64]


def taken(period_s: float, error_ppm: float = 0.0) -> F64:
    return np.arange(round(DURATION_S / period_s)) * period_s * (1.0 + 1e-6 * error_ppm)


def jittered(mean_s: float) -> Stamping:
    return lambda t_s, rng: np.maximum.accumulate(t_s + rng.exponential(mean_s, len(t_s)))


def heaped(every_s: float) -> Stamping:
    return lambda t_s, rng: np.ceil(t_s / every_s) * every_s


def stalled(length_s: float, every_s: float) -> Stamping:
    return lambda t_s, rng: np.where(t_s % every_s < length_s, t_s - t_s % every_s + length_s, t_s)


def bunched(t_s: F64, rng: np.random.Generator) -> F64:
    """Three frames read at once, 20 us apart: what a receiver without stamps of its own gives."""
    k = np.arange(len(t_s))
    return t_s[np.minimum(k // 3 * 3 + 2, len(t_s) - 1)] + 20e-6 * (k % 3)


STAMPINGS: dict[str, Stamping] = {
    "as taken": lambda t_s, rng: t_s,
    "jitter 1 ms": jittered(0.001),
    "jitter 3 ms": jittered(0.003),
    "heaps 16 ms": heaped(0.016),
    "heaps 40 ms": heaped(0.040),
    "stalls": stalled(0.04, 2.0),
    "bunches": bunched,
}


def ns(t_s: F64) -> I64:
    return T0_NS + np.rint(t_s * 1e9).astype(np.int64)


def off_s(found_ns: I64, t_s: F64) -> F64:
    """The distance of times from the truth, apart from the least delay, which nobody can see."""
    off: F64 = (found_ns - ns(t_s)) * 1e-9
    return off - float(np.median(off))


@pytest.mark.parametrize("stamping", STAMPINGS)
@pytest.mark.parametrize("period_s", [0.005, 0.01])
@pytest.mark.parametrize("error_ppm", [0.0, 180.0])
def test_delays_are_removed_from_the_stamps(stamping: str, period_s: float, error_ppm: float) -> None:
    t_s = taken(period_s, error_ppm)
    timing = sample_times(ns(STAMPINGS[stamping](t_s, np.random.default_rng(3))))
    off = off_s(timing.t_ns, t_s)
    assert float(np.sqrt(np.mean(off**2))) < 0.4 * period_s
    # heaps of whole periods slip by one now and then; and who is late at the very end looks as if some were lost
    assert np.count_nonzero(np.abs(np.diff(off)) > 0.1 * period_s) <= 6
    assert timing.n_lost < 10
    if stamping != "heaps 40 ms":
        assert float(np.quantile(np.abs(off), 0.99)) < 1.5e-3


def test_a_clock_that_warms_up_is_followed() -> None:
    """It runs 300 ppm slow at first and as much too fast at last: one straight line misses its times by 4 ms."""
    t_s = taken(0.01)
    t_s = t_s + 300e-6 * DURATION_S / np.pi * np.sin(np.pi * t_s / DURATION_S)
    timing = sample_times(ns(jittered(0.001)(t_s, np.random.default_rng(7))))
    straight = np.polyval(np.polyfit(np.arange(len(t_s)), t_s, 1), np.arange(len(t_s)))
    assert float(np.max(np.abs(t_s - straight))) > 0.004
    assert float(np.sqrt(np.mean(off_s(timing.t_ns, t_s) ** 2))) < 0.0005


@pytest.mark.parametrize("lost", [0.02, 0.1, 0.3])
@pytest.mark.parametrize("mean_s", [0.0, 0.001])
def test_lost_frames_are_distinguished_from_late_ones(lost: float, mean_s: float) -> None:
    rng = np.random.default_rng(4)
    t_s = taken(0.01)
    t_s = t_s[np.r_[True, rng.random(len(t_s) - 2) > lost, True]]
    timing = sample_times(ns(jittered(mean_s)(t_s, rng) if mean_s else t_s))
    assert timing.n_lost == round(DURATION_S / 0.01) - len(t_s)
    assert float(np.mean(np.abs(off_s(timing.t_ns, t_s)) > 0.001)) < 0.01


def test_random_stamps_give_no_clock() -> None:
    rng = np.random.default_rng(6)
    assert sample_times(ns(np.sort(rng.uniform(0.0, DURATION_S, 12_000)))) is None
    assert sample_times(ns(np.zeros(12_000))) is None


@given(st.data())
@settings(max_examples=60, deadline=None)
def test_any_stamps_give_rising_times_or_none(data: st.DataObject) -> None:
    """No exception, and as many times as samples, whatever comes."""
    n = data.draw(st.integers(0, 1500))
    scale_ns = data.draw(st.sampled_from([1, 2_000, 10_000_000, 10**9]))
    rng = np.random.default_rng(data.draw(st.integers(0, 99)))
    t_ns = T0_NS + np.cumsum(rng.integers(0, 2 * scale_ns, n) * rng.integers(0, 2, n))
    times_ns, is_believed = retimed(t_ns, rng.standard_normal(n))
    assert len(times_ns) == len(is_believed) == n


def test_stamps_stay_where_they_show_the_samples_as_smooth() -> None:
    """A stamp was measured: a clock that explains nothing better does not take its place."""
    rng = np.random.default_rng(7)
    t_s = taken(0.01)
    moved_s = t_s + 0.002 * np.sin(2.0 * np.pi * 0.5 * t_s)  # the sensor itself is unsteady
    x = np.sin(2.0 * np.pi * 6.0 * moved_s) + 0.05 * rng.standard_normal(len(t_s))
    times_ns, is_believed = retimed(ns(moved_s), x)
    assert np.array_equal(times_ns, ns(moved_s))
    assert is_believed.all()


def test_late_stamps_are_replaced_by_the_clock() -> None:
    rng = np.random.default_rng(8)
    t_s = taken(0.01)
    x = np.sin(2.0 * np.pi * 6.0 * t_s) + 0.05 * rng.standard_normal(len(t_s))
    times_ns, _ = retimed(ns(jittered(0.003)(t_s, rng)), x)
    assert float(np.max(np.abs(off_s(times_ns, t_s)))) < 1e-3


def stamped(motion: Motion, stamping: Stamping) -> Motion:
    t_s = (motion.t_ns - T0_NS) / 1e9
    return Motion(motion.signals, ns(stamping(t_s, np.random.default_rng(9))), motion.columns)


def test_a_batch_without_a_clock_is_refused_as_time_stamps() -> None:
    def shuffled(t_s: F64, rng: np.random.Generator) -> F64:
        return np.sort(rng.uniform(0.0, 100.0, len(t_s)))

    window = BatchWindow(T0_NS, T0_NS + 100_000_000_000, T0_NS)
    batch = build_batch(stamped(drive(100.0), shuffled), window, BatchSettings(window_s=100.0), {})
    assert batch.rejected[0] is Why.TIME_STAMPS
