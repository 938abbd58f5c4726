"""One window of decoded samples -> one Batch on a uniform grid, with its gates applied. A pure function of the rows."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gateway.core.batch_settings import BatchSettings
from gateway.core.bends import Bends, gyro_gain_of
from gateway.core.sample_clock import retimed
from gateway.core.spectrum import longest_run, runs_of
from gateway.core.timeline import in_order_of_time, onto_grid, sample_rate_hz, sort_by_time, speed_onto_grid
from gateway.records import F64, I64, Batch, Bool, Motion, SensorTraits, Signal, Why
from gateway.units import NS_PER_S, STANDARD_GRAVITY_MPS2

GRAVITY_TOLERANCE_MPS2 = 2.0  # chosen: allows a mount tilted by 37 degrees, not a missing or turned axis
RATE_MIN_SHARE = 0.8  # chosen: of the grid's rate; a slower sensor cannot fill the grid
REASON_SHARE_MIN = 0.1  # chosen: share of a refused window from which a cause is named
SATURATION_HALO_S = 0.1  # chosen: a sensor's filter settles within it

Traits = Mapping[Signal, SensorTraits]


@dataclass(frozen=True, slots=True)
class BatchWindow:
    """The stretch of a drive that a batch covers, and why it ended."""

    t_start_ns: int
    t_end_ns: int
    drive_start_ns: int
    ended_by: Why | None = None
    is_provisional: bool = False


def build_batch(rows: Motion, window: BatchWindow, settings: BatchSettings, traits: Traits) -> Batch:
    """Rows of one window -> Batch. Only rows within [t_start, t_end) count; their order does not matter."""
    n = round((window.t_end_ns - window.t_start_ns) * settings.rate_hz / NS_PER_S)
    inside = (rows.t_ns >= window.t_start_ns) & (rows.t_ns < window.t_end_ns)
    rows = rows.rows(inside)
    acceleration = _sensed(rows, Signal.VERTICAL_ACCELERATION, window, n, settings, traits)
    pitch_rate = _sensed(rows, Signal.PITCH_RATE, window, n, settings, traits)
    roll_rate = _sensed(rows, Signal.ROLL_RATE, window, n, settings, traits)
    speed, frozen = _speed(rows, window, n, settings, traits)
    causes = _sensor_causes(acceleration, pitch_rate) | {
        Why.SPEED_MISSING: np.isnan(speed),
        Why.TOO_SLOW: speed < settings.speed_min_mps,
        Why.TOO_FAST: speed > settings.speed_max_mps,
        Why.SPEED_FROZEN: frozen,
    }
    causes |= _trailer_cause(rows, window, n, settings)
    usable = np.ones(n, bool)
    for masked in causes.values():
        usable &= ~masked
    gravity = float(np.mean(acceleration.on_grid[usable])) if usable.any() else float("nan")
    slower_hz = min(acceleration.rate_hz, pitch_rate.rate_hz)
    roll_radps = _known(roll_rate, settings) if Signal.ROLL_RATE in rows.signals else None
    shares = {why: float(np.mean(masked)) for why, masked in causes.items() if masked.any()}
    return Batch(
        t_start_ns=window.t_start_ns,
        t_end_ns=window.t_end_ns,
        drive_start_ns=window.drive_start_ns,
        rate_hz=settings.rate_hz,
        vertical_acceleration_mps2=acceleration.on_grid - gravity,
        pitch_rate_radps=pitch_rate.on_grid,
        speed_mps=speed,
        usable=usable,
        gravity_mps2=gravity,
        gap_share=_gap_share(shares),
        shares=shares,
        longest_stop_s=longest_run(speed < settings.standstill_speed_mps) / settings.rate_hz,
        rejected=_reasons((acceleration, pitch_rate), window, n, usable, gravity, shares, settings),
        is_provisional=window.is_provisional,
        roll_rate_radps=roll_radps,
        sensor_rate_hz=slower_hz if slower_hz > 0.0 else float("nan"),
        gyro_gain=_gyro_gain(rows, window, roll_radps, speed, usable, settings, traits),
    )


_ACCELERATION_FAULTS = (
    Why.ACCELERATION_MISSING,
    Why.TIME_STAMPS,
    Why.ACCELERATION_STUCK,
    Why.ACCELERATION_SATURATED,
)
_PITCH_RATE_FAULTS = (Why.PITCH_RATE_MISSING, Why.TIME_STAMPS, Why.PITCH_RATE_STUCK, Why.PITCH_RATE_SATURATED)
_MISSING = (Why.GAP, Why.ACCELERATION_MISSING, Why.PITCH_RATE_MISSING)


@dataclass(frozen=True, slots=True)
class _Sensed:
    """One inertial sensor on the grid (n,), its faults, and its sampling rate.

    faults: missing, untimed, stuck, saturated, (n,) each; empty if the signal map lacks the sensor.
    """

    on_grid: F64
    faults: tuple[Bool, ...]
    rate_hz: float


def _sensed(
    rows: Motion, signal: Signal, window: BatchWindow, n: int, settings: BatchSettings, traits: Traits
) -> _Sensed:
    if signal not in rows.signals:
        return _Sensed(np.full(n, np.nan), (), 0.0)
    trait = traits.get(signal, SensorTraits())
    arrived_ns, arrived = rows.of(signal)
    counter = rows.counter_of(signal)
    order = in_order_of_time(arrived_ns)
    stamps_ns, x = arrived_ns[order] - round(trait.latency_s * NS_PER_S), arrived[order]
    counter = None if counter is None else counter[order]
    t_ns, is_believed = retimed(stamps_ns, x, counter, trait.counter_modulus)
    on_grid = onto_grid(t_ns[is_believed], x[is_believed], window.t_start_ns, n, settings.rate_hz, settings.gap_s)
    stuck_ns = settings.stuck_s * NS_PER_S
    untimed = _spans_onto_grid(_spans_of(t_ns, ~is_believed), window, n, settings.rate_hz)
    missing = np.isnan(on_grid) & ~untimed
    stuck = _spans_onto_grid(_constant_runs(t_ns, x, stuck_ns), window, n, settings.rate_hz)
    saturated = _spans_onto_grid(_saturated_spans(t_ns, x, trait), window, n, settings.rate_hz)
    return _Sensed(on_grid, (missing, untimed, stuck, saturated), sample_rate_hz(t_ns[is_believed]))


def _gyro_gain(
    rows: Motion,
    window: BatchWindow,
    roll_radps: F64 | None,
    speed: F64,
    usable: Bool,
    settings: BatchSettings,
    traits: Traits,
) -> tuple[float, float] | None:
    """The gyro's gain measured in bends; None if the signal map lacks a signal that this needs."""
    if roll_radps is None or not {Signal.LATERAL_ACCELERATION, Signal.YAW_RATE} <= set(rows.signals):
        return None
    pushed, turned = (
        _known(_sensed(rows, signal, window, len(speed), settings, traits), settings)
        for signal in (Signal.LATERAL_ACCELERATION, Signal.YAW_RATE)
    )
    return gyro_gain_of(Bends(pushed, turned, roll_radps, speed), usable, settings.rate_hz)


def _sensor_causes(acceleration: _Sensed, pitch_rate: _Sensed) -> dict[Why, Bool]:
    """The faults of both sensors. A cause that both can have is set where either has it; where both are silent the
    cause is a gap, where one is silent it is that sensor's fault.
    """
    causes: dict[Why, Bool] = {}
    for names, sensed in ((_ACCELERATION_FAULTS, acceleration), (_PITCH_RATE_FAULTS, pitch_rate)):
        for why, masked in zip(names, sensed.faults, strict=False):  # none without the sensor
            causes[why] = masked | causes[why] if why in causes else masked
    a, g = causes.get(Why.ACCELERATION_MISSING), causes.get(Why.PITCH_RATE_MISSING)
    if a is None or g is None:
        return causes
    both = a & g
    return causes | {Why.GAP: both, Why.ACCELERATION_MISSING: a & ~both, Why.PITCH_RATE_MISSING: g & ~both}


def _constant_runs(t_ns: I64, x: F64, at_least_ns: float) -> I64:
    """(k, 2) first and last time of every run of bit-identical samples that lasts ``at_least_ns``."""
    if not len(x):
        return np.empty((0, 2), np.int64)
    starts = np.flatnonzero(np.r_[True, x[1:] != x[:-1]])
    ends = np.r_[starts[1:], len(x)] - 1
    long = t_ns[ends] - t_ns[starts] >= at_least_ns
    return np.column_stack([t_ns[starts[long]], t_ns[ends[long]]])


def _saturated_spans(t_ns: I64, x: F64, trait: SensorTraits) -> I64:
    """(k, 2) spans of 0.1 s on either side of each sample at the end of the sensor's range."""
    step = trait.resolution if np.isfinite(trait.resolution) else 0.0
    at_end = (x >= trait.maximum - 0.5 * step) | (x <= trait.minimum + 0.5 * step)  # False where NaN
    halo_ns = round(SATURATION_HALO_S * NS_PER_S)
    return np.column_stack([t_ns[at_end] - halo_ns, t_ns[at_end] + halo_ns])


def _spans_of(t_ns: I64, chosen: Bool) -> I64:
    """(k, 2) first and last time of every run of chosen samples."""
    first, end = runs_of(chosen).T
    return np.column_stack([t_ns[first], t_ns[end - 1]])


def _spans_onto_grid(spans_ns: I64, window: BatchWindow, n: int, rate_hz: float) -> Bool:
    """True on the grid points that any span (k, 2) covers."""
    edges = np.zeros(n + 1, np.int64)
    bounds = np.clip(np.rint((spans_ns - window.t_start_ns) * rate_hz / NS_PER_S), 0, n).astype(np.int64)
    np.add.at(edges, bounds[:, 0], 1)
    np.add.at(edges, bounds[:, 1], -1)
    covered: Bool = np.cumsum(edges[:n]) > 0
    return covered


def _known(sensed: _Sensed, settings: BatchSettings) -> F64:
    """A sensor on the grid (n,), NaN at every fault; all NaN if its sampling rate is too low."""
    is_slow = sensed.rate_hz < RATE_MIN_SHARE * settings.rate_hz
    unknown = np.logical_or.reduce([np.full(len(sensed.on_grid), is_slow), *sensed.faults])
    return np.where(unknown, np.nan, sensed.on_grid)


def _speed(rows: Motion, window: BatchWindow, n: int, settings: BatchSettings, traits: Traits) -> tuple[F64, Bool]:
    """Speed on the grid (n,), wheel speed where GNSS has none; and (n,) where the GNSS speed is frozen."""
    speed, frozen = np.full(n, np.nan), np.zeros(n, bool)
    for signal in (Signal.SPEED, Signal.WHEEL_SPEED):
        trait = traits.get(signal, SensorTraits())
        t_ns, x = rows.of(signal)
        t_ns = t_ns - round(trait.latency_s * NS_PER_S)
        on_grid = speed_onto_grid(t_ns, x, window.t_start_ns, n, settings.rate_hz, settings.speed_hold_s)
        speed = np.where(np.isnan(speed), on_grid, speed)
        if signal is Signal.SPEED and not trait.resolution > settings.speed_min_mps / 50.0:
            moving = x >= settings.speed_min_mps
            runs = _constant_runs(*sort_by_time(t_ns, x), settings.speed_frozen_s * NS_PER_S)
            frozen = _spans_onto_grid(runs, window, n, settings.rate_hz) if moving.any() else frozen
    return speed, frozen & (speed >= settings.speed_min_mps)


def _trailer_cause(rows: Motion, window: BatchWindow, n: int, settings: BatchSettings) -> dict[Why, Bool]:
    """Where a trailer is attached: each reading holds until the next, the first one from the start. Empty without
    readings.
    """
    t_ns, x = sort_by_time(*rows.of(Signal.TRAILER))
    if not len(t_ns):
        return {}
    at_ns = window.t_start_ns + np.rint(np.arange(n) * (NS_PER_S / settings.rate_hz)).astype(np.int64)
    latest = np.maximum(np.searchsorted(t_ns, at_ns, side="right") - 1, 0)
    return {Why.TRAILER: x[latest] > 0.0}


def _gap_share(shares: Mapping[Why, float]) -> float:
    return sum(shares.get(why, 0.0) for why in _MISSING)


def _reasons(
    sensors: tuple[_Sensed, ...],
    window: BatchWindow,
    n: int,
    usable: Bool,
    gravity: float,
    shares: Mapping[Why, float],
    settings: BatchSettings,
) -> tuple[Why, ...]:
    """Every reason for which no estimator may use the window, in a fixed order."""
    found: list[Why] = []
    whole_n = settings.window_s * settings.rate_hz
    if not window.is_provisional and n < settings.last_batch_share_min * whole_n:
        found.append(Why.TOO_SHORT)
        found.extend([window.ended_by] if window.ended_by else [])
    if n and float(np.mean(usable)) < settings.usable_share_min:
        largest = max(shares.values(), default=0.0)
        found.extend(why for why, share in shares.items() if share >= min(REASON_SHARE_MIN, largest))
    elif _gap_share(shares) > settings.gap_share_max:
        found.extend(why for why in _MISSING if shares.get(why, 0.0) > settings.gap_share_max / len(_MISSING))
    if any(0.0 < sensor.rate_hz < RATE_MIN_SHARE * settings.rate_hz for sensor in sensors):
        found.append(Why.SENSOR_RATE_LOW)
    if usable.any() and not abs(gravity - STANDARD_GRAVITY_MPS2) <= GRAVITY_TOLERANCE_MPS2:
        found.append(Why.GRAVITY_MISSING)
    return tuple(dict.fromkeys(found))
