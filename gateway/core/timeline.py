"""Time-stamped samples onto one uniform time line. Gaps remain gaps (NaN)."""

from functools import lru_cache

import numpy as np

from gateway.core.spline import between, smooth_slopes
from gateway.records import F64, I64, Bool
from gateway.units import NS_PER_S

PASSBAND_HZ = 16.0  # the estimators read up to 14 Hz
STOPBAND_DB = 70.0  # chosen: aliases fall below the sensors' noise
FINEST_HZ = 1000.0  # chosen: no vehicle's inertial sensor is faster; bounds the memory for bad stamps


def in_order_of_time(t_ns: I64) -> I64:
    """Indexes (n,) that sort samples by time; equal stamps stay in order of arrival."""
    return np.argsort(t_ns, kind="stable")


def sort_by_time(t_ns: I64, x: F64) -> tuple[I64, F64]:
    """Samples sorted by time; equal stamps stay in order of arrival."""
    order = in_order_of_time(t_ns)
    return t_ns[order], x[order]


def sample_rate_hz(t_ns: I64) -> float:
    """Median rate of a sensor's samples in Hz; 0 with fewer than two."""
    if len(t_ns) < 2:
        return 0.0
    interval_ns = float(np.median(np.diff(t_ns)))
    return NS_PER_S / interval_ns if interval_ns > 0.0 else 0.0


def onto_grid(t_ns: I64, x: F64, t_start_ns: int, n: int, rate_hz: float, gap_s: float) -> F64:
    """Samples (m,) at their own times -> (n,) at ``rate_hz`` from ``t_start_ns``, NaN where unknown.

    A cubic spline resamples to a multiple of the grid's rate near the sensor's own. A linear-phase low-pass (flat to 16
    Hz, 70 dB at the frequencies that alias below that) precedes the decimation: engine firing at 40-60 Hz would
    otherwise alias into the bands of the estimators. Where neighbouring samples are further apart than ``gap_s`` (and
    than two and a half of their usual intervals), the time between them is unknown.
    """
    t_ns, first = np.unique(t_ns, return_index=True)
    x = x[first]
    if len(t_ns) < 4:
        return np.full(n, np.nan)
    raw_rate_hz = sample_rate_hz(t_ns)
    step = max(1, int(np.ceil(0.95 * min(raw_rate_hz, FINEST_HZ) / rate_hz)))
    t_s = (t_ns - t_start_ns) / NS_PER_S
    fine_s = np.arange((n - 1) * step + 1) / (rate_hz * step)
    fine = np.where(
        _covered(fine_s, t_s, max(gap_s, 2.5 / raw_rate_hz)),
        between(np.clip(fine_s, t_s[0], t_s[-1]), t_s, x, smooth_slopes(t_s, x)),
        np.nan,
    )
    return fine if step == 1 else _low_pass(fine, step, rate_hz)[::step]


def _covered(at_s: F64, t_s: F64, gap_s: float) -> Bool:
    """True where ``at_s`` lies between two samples no further apart than ``gap_s``."""
    right = np.clip(np.searchsorted(t_s, at_s, side="left"), 1, len(t_s) - 1)
    edge_s = gap_s / 4.0  # the grid's ends may lie a fraction of an interval outside the samples
    inside = (at_s >= t_s[0] - edge_s) & (at_s <= t_s[-1] + edge_s)
    covered: Bool = inside & (t_s[right] - t_s[right - 1] <= gap_s)
    return covered


@lru_cache(maxsize=8)
def _low_pass_taps(step: int, rate_hz: float) -> F64:
    """Kaiser-windowed sinc for decimation by ``step`` to ``rate_hz`` (Oppenheim & Schafer, 7.5)."""
    fine_rate_hz = step * rate_hz
    stop_hz = rate_hz - PASSBAND_HZ
    width_rad = 2.0 * np.pi * (stop_hz - PASSBAND_HZ) / fine_rate_hz
    half = int(np.ceil((STOPBAND_DB - 8.0) / (2.285 * width_rad) / 2.0))
    k = np.arange(-half, half + 1)
    cutoff = (stop_hz + PASSBAND_HZ) / fine_rate_hz  # twice the mid frequency over the rate
    taps = cutoff * np.sinc(cutoff * k) * np.kaiser(2 * half + 1, 0.1102 * (STOPBAND_DB - 8.7))
    taps /= taps.sum()
    taps.setflags(write=False)
    designed: F64 = taps
    return designed


def _low_pass(fine: F64, step: int, rate_hz: float) -> F64:
    """Zero-phase low-pass; NaN wherever its support touches an unknown sample, except at the ends.

    At the ends of the window the signal is continued by odd reflection, so that a batch needs no samples from before or
    after it.
    """
    taps = _low_pass_taps(step, rate_hz)
    half = len(taps) // 2
    if len(fine) <= half + 1:
        return np.full_like(fine, np.nan)
    unknown = np.isnan(fine)
    known = np.where(unknown, 0.0, fine)
    padded = np.concatenate([2 * known[0] - known[half:0:-1], known, 2 * known[-1] - known[-2 : -half - 2 : -1]])
    smooth = np.convolve(padded, taps, mode="valid")
    n_before = np.cumsum(np.pad(unknown, (half + 1, half)))
    touched = n_before[2 * half + 1 :] > n_before[: -2 * half - 1]
    return np.where(touched, np.nan, smooth)


def speed_onto_grid(t_ns: I64, speed_mps: F64, t_start_ns: int, n: int, rate_hz: float, hold_s: float) -> F64:
    """GNSS speed (m,) at its own (latency-corrected) times -> (n,), linear between samples.

    Between samples further apart than ``hold_s`` the speed is unknown (NaN); before the first and after the last sample
    it is held for at most ``hold_s``.
    """
    t_ns, speed_mps = sort_by_time(t_ns, speed_mps)
    if not len(t_ns):
        return np.full(n, np.nan)
    t_s = (t_ns - t_start_ns) / NS_PER_S
    at_s = np.arange(n) / rate_hz
    speed = np.interp(at_s, t_s, speed_mps)
    right = np.searchsorted(t_s, at_s, side="left")
    before_s = np.where(right > 0, at_s - t_s[np.maximum(right - 1, 0)], np.inf)
    after_s = np.where(right < len(t_s), t_s[np.minimum(right, len(t_s) - 1)] - at_s, np.inf)
    between = np.where(np.isfinite(before_s) & np.isfinite(after_s), before_s + after_s, np.minimum(before_s, after_s))
    return np.where(between <= hold_s, speed, np.nan)
