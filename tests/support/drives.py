"""Made-up drives as decoded rows: two inertial sensors and GNSS speed, a frame each."""

from collections.abc import Callable
from dataclasses import fields, replace

import numpy as np

from gateway.records import F64, Batch, Motion, Signal

T0_NS = 1_790_000_000_000_000_000
SIGNALS = (Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE, Signal.SPEED)
Speed = Callable[[F64], F64]


def steady(speed_mps: float) -> Speed:
    """Rows at one constant speed."""
    return lambda t_s: np.full(len(t_s), speed_mps)


def drive(duration_s: float, speed: Speed | None = None, rate_hz: float = 100.0, seed: int = 1) -> Motion:
    """Rows from T0_NS: white acceleration about gravity, white pitch rate, speed at 10 Hz, 0 where it stands."""
    rng = np.random.default_rng(seed)
    speed = speed or steady(15.0)
    t_imu_s = np.arange(0.0, duration_s, 1.0 / rate_hz)
    t_gnss_s = np.arange(0.0, duration_s, 0.1) + 0.002
    asked_mps = speed(t_gnss_s)
    seen_mps = np.where(asked_mps > 0.0, asked_mps + 0.05 * rng.standard_normal(len(t_gnss_s)), 0.0)
    parts = [
        (t_imu_s, 9.81 + 0.5 * rng.standard_normal(len(t_imu_s))),
        (t_imu_s + 0.001, 0.02 * rng.standard_normal(len(t_imu_s))),
        (t_gnss_s, seen_mps),
    ]
    t_ns = np.concatenate([np.rint(t_s * 1e9).astype(np.int64) for t_s, _ in parts]) + T0_NS
    columns = np.full((len(t_ns), len(parts)), np.nan)
    begin = 0
    for i, (_, samples) in enumerate(parts):
        columns[begin : begin + len(samples), i] = samples
        begin += len(samples)
    order = np.argsort(t_ns, kind="stable")
    return Motion(SIGNALS, t_ns[order], columns[order])


def with_roll(motion: Motion, rate_hz: float = 100.0, seed: int = 5) -> Motion:
    """The rows with frames of a white roll rate between them, from 0.4 s before the first on."""
    t_ns = np.arange(motion.t_ns.min() - 400_000_000, motion.t_ns.max() + 400_000_000, round(1e9 / rate_hz))
    columns = np.full((len(motion) + len(t_ns), len(motion.signals) + 1), np.nan)
    columns[: len(motion), :-1] = motion.columns
    columns[len(motion) :, -1] = 0.03 * np.random.default_rng(seed).standard_normal(len(t_ns))
    # the rows that were there keep their order of arrival, whatever their stamps
    arrival = np.r_[np.maximum.accumulate(motion.t_ns), t_ns]
    order = np.argsort(arrival, kind="stable")
    return Motion((*motion.signals, Signal.ROLL_RATE), np.r_[motion.t_ns, t_ns][order], columns[order])


def with_journey(motion: Motion, seed: int = 6) -> Motion:
    """The rows with frames of an odometer and a door between them, some of which hold no value."""
    rng = np.random.default_rng(seed)
    t_ns = np.arange(motion.t_ns.min() - 2_000_000_000, motion.t_ns.max() + 30_000_000_000, 70_000_000)
    columns = np.full((len(motion) + len(t_ns), len(motion.signals) + 2), np.nan)
    columns[: len(motion), :-2] = motion.columns
    columns[len(motion) :, -2] = (t_ns - t_ns[0]) / 1e8
    columns[len(motion) :, -1] = np.where(rng.random(len(t_ns)) < 0.3, np.nan, rng.integers(0, 2, len(t_ns)))
    arrival = np.r_[np.maximum.accumulate(motion.t_ns), t_ns]
    order = np.argsort(arrival, kind="stable")
    aside = np.arange(len(arrival)) >= len(motion)
    signals = (*motion.signals, Signal.ODOMETER, Signal.DOOR)
    return Motion(signals, np.r_[motion.t_ns, t_ns][order], columns[order], aside=aside[order])


def changed(motion: Motion, signal: Signal, from_s: float, to_s: float, to: Callable[[F64], F64]) -> Motion:
    """The samples of one signal between two times, replaced by ``to`` of them."""
    columns = motion.columns.copy()
    column = columns[:, motion.signals.index(signal)]
    t_s = (motion.t_ns - T0_NS) / 1e9
    touched = np.isfinite(column) & (t_s >= from_s) & (t_s < to_s)
    column[touched] = to(column[touched])
    return replace(motion, columns=columns)


def without_rows(motion: Motion, from_s: float, to_s: float) -> Motion:
    """No frame at all between two times."""
    t_s = (motion.t_ns - T0_NS) / 1e9
    kept = (t_s < from_s) | (t_s >= to_s)
    return Motion(motion.signals, motion.t_ns[kept], motion.columns[kept])


def joined(*parts: Motion) -> Motion:
    """Rows one after the other, in order of arrival."""
    return Motion(
        parts[0].signals,
        np.concatenate([part.t_ns for part in parts]),
        np.concatenate([part.columns for part in parts]),
    )


def later(motion: Motion, by_s: float) -> Motion:
    """The rows with other stamps."""
    return replace(motion, t_ns=motion.t_ns + round(by_s * 1e9))


def assert_same_batch(one: Batch, other: Batch) -> None:
    """Every field equal, bit for bit, NaN equal to NaN."""
    for each in fields(Batch):
        np.testing.assert_equal(getattr(one, each.name), getattr(other, each.name), err_msg=each.name)
