"""The gates of a batch: each fault masks what it spoils, and a spoiled batch says why."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.drives import T0_NS, assert_same_batch, changed, drive, steady, with_roll

from gateway.core.batch import BatchWindow, build_batch
from gateway.core.batch_settings import BatchSettings
from gateway.records import F64, Batch, Motion, SensorTraits, Signal, Why

LENGTH_S = 100.0
SETTINGS = BatchSettings(window_s=LENGTH_S)
WINDOW = BatchWindow(T0_NS, T0_NS + 100_000_000_000, T0_NS)
TRAITS = {
    Signal.VERTICAL_ACCELERATION: SensorTraits(minimum=-20.0, maximum=39.0, resolution=0.01),
    Signal.PITCH_RATE: SensorTraits(minimum=-4.0, maximum=4.0, resolution=0.001),
    Signal.ROLL_RATE: SensorTraits(minimum=-4.0, maximum=4.0, resolution=0.001),
}
WHOLE = drive(LENGTH_S)
A, G, V = Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE, Signal.SPEED
R = Signal.ROLL_RATE


def batch_of(motion: Motion) -> Batch:
    return build_batch(motion, WINDOW, SETTINGS, TRAITS)


def silent(x: F64) -> F64:
    return np.full_like(x, np.nan)


def held_at(level: float) -> Callable[[F64], F64]:
    return lambda x: np.full_like(x, level)


def touching(level: float) -> Callable[[F64], F64]:
    """Every tenth sample lies at ``level``, as when a sensor clips at the peaks."""
    return lambda x: np.where(np.arange(len(x)) % 10 == 0, level, x)


FAULTS = [  # which signal is spoiled, for how long of 100 s, how, and what the batch must then say
    (V, 50.0, held_at(3.0), Why.TOO_SLOW),
    (V, 50.0, held_at(41.0), Why.TOO_FAST),
    (V, 50.0, silent, Why.SPEED_MISSING),
    (V, 70.0, held_at(15.0), Why.SPEED_FROZEN),
    (A, 50.0, silent, Why.ACCELERATION_MISSING),
    (A, 50.0, held_at(9.8), Why.ACCELERATION_STUCK),
    (A, 50.0, touching(39.0), Why.ACCELERATION_SATURATED),
    (A, 50.0, touching(-20.0), Why.ACCELERATION_SATURATED),
    (G, 50.0, silent, Why.PITCH_RATE_MISSING),
    (G, 50.0, held_at(0.01), Why.PITCH_RATE_STUCK),
    (G, 50.0, touching(4.0), Why.PITCH_RATE_SATURATED),
]


@pytest.mark.parametrize(("signal", "length_s", "fault", "why"), FAULTS)
def test_a_long_fault_rejects_the_batch_and_is_the_only_one_named(
    signal: Signal, length_s: float, fault: Callable[[F64], F64], why: Why
) -> None:
    batch = batch_of(changed(WHOLE, signal, 20.0, 20.0 + length_s, fault))
    assert batch.rejected == (why,)
    assert batch.shares[why] == pytest.approx(length_s / LENGTH_S, abs=0.01)


@pytest.mark.parametrize(("signal", "length_s", "fault", "why"), FAULTS)
def test_a_short_fault_is_masked_and_the_rest_counts(
    signal: Signal, length_s: float, fault: Callable[[F64], F64], why: Why
) -> None:
    short_s = 62.0 if why is Why.SPEED_FROZEN else 12.0
    lenient = replace(SETTINGS, usable_share_min=0.3)
    batch = build_batch(changed(WHOLE, signal, 20.0, 20.0 + short_s, fault), WINDOW, lenient, TRAITS)
    assert batch.rejected == ()
    masked = ~batch.usable
    assert masked[round(20.5 * 50) : round((19.5 + short_s) * 50)].all()
    assert not masked[: round(19.0 * 50)].any()
    assert not masked[round((21.0 + short_s) * 50) :].any()


def test_a_sound_drive_passes_whole() -> None:
    batch = batch_of(WHOLE)
    assert batch.rejected == ()
    assert batch.usable_share > 0.995
    assert batch.gravity_mps2 == pytest.approx(9.81, abs=0.02)
    assert np.mean(batch.vertical_acceleration_mps2[batch.usable]) == pytest.approx(0.0, abs=1e-9)
    assert batch.mean_speed_mps == pytest.approx(15.0, abs=0.02)


@pytest.mark.parametrize(
    ("rows", "rejected"),
    [
        (changed(changed(WHOLE, A, 20.0, 70.0, silent), G, 20.0, 70.0, silent), (Why.GAP,)),  # no sensor's fault
        (changed(changed(WHOLE, V, 0.0, 30.0, held_at(2.0)), A, 40.0, 60.0, silent),
         (Why.ACCELERATION_MISSING, Why.TOO_SLOW)),
        (changed(WHOLE, V, 0.0, 39.0, held_at(3.0)), ()),  # 60 % usable count
        (changed(WHOLE, V, 0.0, 41.0, held_at(3.0)), (Why.TOO_SLOW,)),
        (changed(WHOLE, A, 30.0, 49.0, silent), ()),  # 20 % may be missing
        (changed(WHOLE, A, 30.0, 51.0, silent), (Why.ACCELERATION_MISSING,)),
        (changed(WHOLE, A, 0.0, LENGTH_S, lambda x: x - 9.81), (Why.GRAVITY_MISSING,)),
        (changed(WHOLE, A, 0.0, LENGTH_S, lambda x: -x), (Why.GRAVITY_MISSING,)),
        (changed(WHOLE, A, 0.0, LENGTH_S, lambda x: x / 2.0), (Why.GRAVITY_MISSING,)),
        (drive(LENGTH_S, steady(15.0), rate_hz=25.0), (Why.SENSOR_RATE_LOW,)),
    ],
)  # fmt: skip
def test_every_gate_has_its_limit_and_reason(rows: Motion, rejected: tuple[Why, ...]) -> None:
    assert batch_of(rows).rejected == rejected


def with_trailer(*states: tuple[float, float]) -> Motion:
    """The whole drive with a frame aside for each (time in s, state)."""
    n, k = len(WHOLE), len(states)
    t_ns = np.r_[WHOLE.t_ns, np.array([T0_NS + round(s * 1e9) for s, _ in states], np.int64)]
    columns = np.full((n + k, len(WHOLE.signals) + 1), np.nan)
    columns[:n, :-1] = WHOLE.columns
    columns[n:, -1] = [state for _, state in states]
    order = np.argsort(np.r_[np.maximum.accumulate(WHOLE.t_ns), t_ns[n:]], kind="stable")
    aside = np.arange(n + k) >= n
    return Motion((*WHOLE.signals, Signal.TRAILER), t_ns[order], columns[order], aside=aside[order])


def test_nothing_is_weighed_while_a_trailer_is_drawn() -> None:
    assert batch_of(with_trailer((50.0, 1.0))).rejected == (Why.TRAILER,)
    assert batch_of(with_trailer((10.0, 1.0), (45.0, 0.0))).rejected == (Why.TRAILER,)
    uncoupled = batch_of(with_trailer((5.0, 1.0), (30.0, 0.0)))
    assert uncoupled.rejected == ()
    assert uncoupled.shares[Why.TRAILER] == pytest.approx(0.3, abs=0.001)
    assert not uncoupled.usable[: round(29.9 * uncoupled.rate_hz)].any()


@pytest.mark.parametrize("states", [(), ((50.0, 0.0),)])
def test_without_a_trailer_a_batch_is_what_it_was(states: tuple[tuple[float, float], ...]) -> None:
    alone, whole = batch_of(with_trailer(*states)), batch_of(WHOLE)
    assert alone.rejected == ()
    np.testing.assert_array_equal(alone.usable, whole.usable)
    np.testing.assert_array_equal(alone.vertical_acceleration_mps2, whole.vertical_acceleration_mps2)


def test_calibration_sees_the_trailer_and_no_journey() -> None:
    rows = with_trailer((50.0, 1.0)).weighing
    assert len(rows) == len(WHOLE) + 1
    assert batch_of(rows).rejected == (Why.TRAILER,)


@pytest.mark.parametrize("rate_hz", [50.0, 100.0, 200.0])
def test_a_batch_knows_how_often_its_sensors_send(rate_hz: float) -> None:
    sampled = drive(LENGTH_S, steady(15.0), rate_hz=rate_hz)
    assert batch_of(sampled).sensor_rate_hz == pytest.approx(rate_hz)
    assert batch_of(changed(sampled, G, 0.0, 60.0, silent)).sensor_rate_hz == pytest.approx(rate_hz)
    assert np.isnan(batch_of(changed(sampled, G, 0.0, LENGTH_S, silent)).sensor_rate_hz)


def test_a_short_window_is_refused_with_what_ended_it() -> None:
    short = replace(WINDOW, t_end_ns=T0_NS + 50_000_000_000, ended_by=Why.CLOCK_STEP)
    assert build_batch(WHOLE, short, SETTINGS, TRAITS).rejected == (Why.TOO_SHORT, Why.CLOCK_STEP)
    look = replace(short, ended_by=None, is_provisional=True)
    assert build_batch(WHOLE, look, SETTINGS, TRAITS).rejected == ()


def test_wheel_speed_stands_in_for_gnss() -> None:
    columns = np.column_stack([WHOLE.columns, WHOLE.columns[:, 2] + 0.5])
    both = Motion((*WHOLE.signals, Signal.WHEEL_SPEED), WHOLE.t_ns, columns)
    batch = batch_of(changed(both, V, 30.0, 100.0, silent))
    assert batch.rejected == ()
    assert np.mean(batch.speed_mps[:1400]) == pytest.approx(15.0, abs=0.05)
    assert np.mean(batch.speed_mps[1600:]) == pytest.approx(15.5, abs=0.05)


@pytest.mark.parametrize("signal", [V, R])
def test_latency_moves_the_samples_back(signal: Signal) -> None:
    step = changed(with_roll(WHOLE), signal, 50.0, LENGTH_S + 1.0, lambda x: x + 5.0)
    batch = build_batch(step, WINDOW, SETTINGS, {signal: SensorTraits(latency_s=2.0)})
    found, before = (batch.speed_mps, 15.0) if signal is V else (roll_of(batch), 0.0)
    assert found[round(47.5 * 50)] == pytest.approx(before, abs=0.3)
    assert found[round(48.5 * 50)] == pytest.approx(before + 5.0, abs=0.3)


@settings(max_examples=5, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1))
def test_neither_order_nor_rows_outside_matter(seed: int) -> None:
    more = drive(LENGTH_S + 30.0)
    outside = Motion(more.signals, more.t_ns - 200_000_000_000, more.columns)
    rows = Motion(WHOLE.signals, np.r_[WHOLE.t_ns, outside.t_ns], np.concatenate([WHOLE.columns, outside.columns]))
    mixed = np.random.default_rng(seed).permutation(len(rows))
    shuffled = Motion(rows.signals, rows.t_ns[mixed], rows.columns[mixed])
    assert_same_batch(batch_of(shuffled), batch_of(WHOLE))


def test_a_batch_without_rows_is_empty() -> None:
    batch = batch_of(WHOLE.part(0, 0))
    assert not batch.usable.any()
    assert batch.gap_share == 1.0
    assert Why.GAP in batch.rejected
    assert np.isnan(batch.mean_speed_mps)


def roll_of(batch: Batch) -> F64:
    assert batch.roll_rate_radps is not None
    return batch.roll_rate_radps


def test_a_roll_rate_comes_onto_the_same_grid() -> None:
    """What two sensors measure alike, sent at the same instants, is alike on the grid."""
    columns = np.column_stack([WHOLE.columns, WHOLE.columns[:, 1]])
    batch = batch_of(Motion((*WHOLE.signals, R), WHOLE.t_ns, columns))
    np.testing.assert_array_equal(roll_of(batch)[batch.usable], batch.pitch_rate_radps[batch.usable])
    assert batch.roll_usable_share == 1.0


@pytest.mark.parametrize("fault", [silent, held_at(0.01), touching(4.0), touching(-4.0)])
@pytest.mark.parametrize("length_s", [10.0, 50.0, LENGTH_S])
def test_a_faulty_roll_rate_is_unknown_and_costs_nothing_else(length_s: float, fault: Callable[[F64], F64]) -> None:
    faulty = changed(with_roll(WHOLE), R, 0.0, length_s, fault)
    if length_s == LENGTH_S:
        faulty = changed(faulty, R, -1.0, LENGTH_S + 1.0, fault)
    batch = batch_of(faulty)
    assert np.isnan(roll_of(batch)[: round((length_s - 0.5) * 50)]).all()
    assert np.isfinite(roll_of(batch)[round((length_s + 0.5) * 50) :]).all()
    assert batch.roll_usable_share == pytest.approx(1.0 - length_s / LENGTH_S, abs=0.01)
    assert_same_batch(replace(batch, roll_rate_radps=None), batch_of(WHOLE))


def test_a_roll_rate_too_slow_for_the_grid_is_unknown() -> None:
    batch = batch_of(with_roll(WHOLE, rate_hz=25.0))
    assert np.isnan(roll_of(batch)).all()
    assert batch.roll_usable_share == 0.0
    assert batch.rejected == ()
