"""When samples were taken, inferred from when their frames came: the sensor's steady clock behind late stamps.

    sample_times(t_ns)  -> Timing, or None if no steady clock explains the stamps
    retimed(t_ns, x)    -> times of samples x, by the clock where that makes them smoother, and which are believed

Both also take a message counter, if there is one: it distinguishes lost frames from late ones whatever the delays.

A sensor samples at a steady rate. A stamp is later than its sample by the delay of bus, driver and computer, which has
a lower bound. Delays come and go, but a lost frame shifts all later frames by one period for good. So the number of a
sample is its index plus the growth, in periods, of the least delay of the samples after it (the lower envelope: V.
Paxson, "On calibrating measurements of packet transit times", SIGMETRICS 1998). Apart from whole periods, that least
delay is the drift between the two clocks, which is slow. A piecewise line through stamps over numbers is then the
sensor's clock.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from gateway.records import F64, I64, Bool
from gateway.units import NS_PER_S

LEAST_SAMPLES: Final = 200  # chosen: fewer do not fill a segment of a spectrum
SILENCE_S: Final = 1.0  # chosen: longer than a computer stalls
AHEAD: Final = 101  # chosen: at least one sample in this many has no delay; a second at 100 Hz
SLOWLY: Final = 400  # chosen: samples over which the drift between the clocks is constant
LAG: Final = 512  # chosen: over this many samples bursts hardly affect the mean interval
ROUNDS: Final = 3  # chosen: each round improves the period by about a factor SLOWLY
FEW_LOST_SHARE: Final = 0.01  # chosen: the mean interval is the period only if fewer frames are lost
STEADY_SHARE: Final = 0.2  # chosen: of a period; with less scatter every lost frame shows
MOST_LOST_SHARE: Final = 0.5  # chosen: with more lost frames the numbering is a guess
UNSURE_SHARE: Final = 0.3  # chosen: of a period; a least delay further from whole periods gives no number
MOST_UNSURE_SHARE: Final = 0.15  # chosen: of the samples; random delays would give 0.4
FEW_SHORT_SHARE: Final = 0.01  # chosen: of the intervals of even stamps
CLEARLY: Final = 1.05  # chosen: a smaller ratio of mean distances does not change an estimate
OUTLYING: Final = 10.0  # chosen: of the median distance, where distances are clipped
SHORT_PIECE: Final = 200  # chosen: samples per piece of the periodogram
MOST_SHORT_PIECES: Final = 16  # chosen: enough for a peak, and fast
USUAL_WITHIN: Final = 0.1  # chosen: of the median interval; jitter shifts it less
PIECE: Final = 1000  # chosen: samples per piece of the line
OFTEN_ROUND: Final = 20  # chosen: after this many turns a counter has shown its highest number
MOSTLY: Final = 0.5  # chosen: of the intervals; without losses a message counter advances by a constant step
OFF_S: Final = 0.25  # chosen: a larger delay means that stamps and counter contradict each other
FEW_OFF_SHARE: Final = 0.01  # chosen: of the samples; more contradictions disqualify the counter


@dataclass(frozen=True, slots=True)
class Timing:
    """Times of samples (n,) in ns, rising; period_s is the clock's period, delay_s (n,) the delay of each stamp.

    delay_s is relative to its own median: the absolute least delay cannot be observed.
    """

    t_ns: I64
    period_s: float
    delay_s: F64
    n_lost: int


def retimed(t_ns: I64, x: F64, counter: I64 | None = None, modulus: int = 0) -> tuple[I64, Bool]:
    """Stamps and samples (n,), in order of arrival -> times (n,), and whether each is believed (n,).

    Stretches separated by silence have a clock each. A stamp is measured and a clock is inferred, so stamps are kept
    unless the samples are clearly smoother over the clock's times. If there is no clock, even stamps are believed; a
    stretch too short to judge is left as it is.
    """
    edges = np.r_[0, np.flatnonzero(np.diff(t_ns) > SILENCE_S * NS_PER_S) + 1, len(t_ns)]
    times_ns, is_believed = t_ns.copy(), np.ones(len(t_ns), np.bool_)
    for begin, end in pairwise(edges.tolist()):
        if end - begin < LEAST_SAMPLES:
            continue
        here = slice(begin, end)
        timing = sample_times(t_ns[here], None if counter is None else counter[here], modulus)
        if timing is None:
            is_believed[here] = _is_even(t_ns[here])
        elif _is_smoother(timing.t_ns, t_ns[here], x[here]):
            times_ns[here] = timing.t_ns
    return times_ns, is_believed


def _is_even(t_ns: I64) -> bool:
    """Whether few intervals are so short that a curve through their two samples would overshoot."""
    intervals_ns = np.diff(t_ns)
    return float(np.mean(intervals_ns < 0.5 * np.median(intervals_ns))) < FEW_SHORT_SHARE


def _is_smoother(clock_ns: I64, stamps_ns: I64, x: F64) -> bool:
    """Whether samples agree clearly better with their neighbours over the clock's times than over the stamps."""
    by_clock, by_stamps = _off_neighbours(clock_ns, x), _off_neighbours(stamps_ns, x)
    most = OUTLYING * float(np.median(by_clock)) + np.finfo(float).tiny
    return float(np.mean(np.minimum(by_stamps, most))) > CLEARLY * float(np.mean(np.minimum(by_clock, most)))


def _off_neighbours(t_ns: I64, x: F64) -> F64:
    """(n - 4,) distance of each sample from the cubic through the two before and the two after it (Lagrange)."""
    t_s = (t_ns - t_ns[0]) / NS_PER_S
    at = t_s[2:-2]
    nodes = [t_s[k : len(t_s) - 4 + k] for k in (0, 1, 3, 4)]
    drawn = np.zeros(len(at))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for k, node in zip((0, 1, 3, 4), nodes, strict=True):
            others = [other for other in nodes if other is not node]
            drawn += x[k : len(x) - 4 + k] * np.prod([(at - other) / (node - other) for other in others], axis=0)
    off = np.abs(x[2:-2] - drawn)
    return np.where(np.isfinite(off), off, np.inf)  # two samples with one time stamp have no interpolating cubic


def sample_times(t_ns: I64, counter: I64 | None = None, modulus: int = 0) -> Timing | None:
    """The sampling times of frames with stamps t_ns (n,), in order of arrival and never falling.

    ``counter`` (n,) counts messages modulo ``modulus``; a counter that the stamps contradict is ignored. None if no
    steady clock explains the stamps, or if lost and late frames cannot be distinguished.
    """
    if len(t_ns) < LEAST_SAMPLES:
        return None
    t_s = (t_ns - t_ns[0]) / NS_PER_S
    lag = min(LAG, len(t_s) // 2)
    mean_s = float(np.median(t_s[lag:] - t_s[:-lag])) / lag
    counted = _timing_by(counter, modulus, t_ns, mean_s) if counter is not None and mean_s > 0.0 else None
    if counted is not None:
        return counted
    heaped = _numbered(t_s, mean_s) if mean_s > 0.0 else None
    if heaped is not None and _lost_share(heaped) < FEW_LOST_SHARE:
        return _timing(t_ns, heaped)
    usual_s = _usual_period_s(t_s)
    steady = _numbered(t_s, usual_s) if usual_s > 0.0 else None
    if steady is None or _lost_share(steady) > MOST_LOST_SHARE:
        return None
    timing = _timing(t_ns, steady)
    return timing if float(np.median(np.abs(timing.delay_s))) < STEADY_SHARE * timing.period_s else None


def _lost_share(numbers: I64) -> float:
    return 1.0 - len(numbers) / float(numbers[-1] + 1)


def _timing(t_ns: I64, numbers: I64) -> Timing:
    t_s = (t_ns - t_ns[0]) / NS_PER_S
    clock_s, period_s = _clock(t_s, numbers)
    taken_ns = t_ns[0] + np.rint(clock_s * NS_PER_S).astype(np.int64)
    return Timing(taken_ns, period_s, t_s - clock_s, int(numbers[-1]) + 1 - len(numbers))


def _usual_period_s(t_s: F64) -> float:
    """The period near the median interval that most stamps keep, whatever was lost; 0 if there is none.

    The period of largest |sum exp(j 2 pi t / T)| over short pieces (the periodogram of a point process: M. S. Bartlett,
    "The spectral analysis of point processes", J. R. Stat. Soc. B 25, 1963).
    """
    usual_s = float(np.median(np.diff(t_s)))
    if not usual_s > 0.0:
        return 0.0
    n_pieces = min(MOST_SHORT_PIECES, len(t_s) // SHORT_PIECE)
    begins = np.linspace(0, len(t_s) - SHORT_PIECE, n_pieces).astype(int)
    pieces_s = np.stack([t_s[begin : begin + SHORT_PIECE] for begin in begins])
    tried_s = usual_s * (1.0 + np.arange(-USUAL_WITHIN, USUAL_WITHIN, 0.25 / SHORT_PIECE))
    score = [np.sum(np.abs(np.exp(2j * np.pi / period_s * pieces_s).sum(axis=1)) ** 2) for period_s in tried_s]
    return float(tried_s[int(np.argmax(score))])


def _numbered(t_s: F64, period_s: float) -> I64 | None:
    """Numbers (n,) of the samples, rising from 0, from the growth of the least delay; None if too few are certain."""
    place = np.arange(len(t_s))
    for _ in range(ROUNDS):
        least_s = _least_ahead(t_s - place * period_s)
        turn = np.exp(2j * np.pi / period_s * least_s)  # whole periods do not turn it
        sums = np.cumsum(np.pad(turn, (SLOWLY // 2 + 1, SLOWLY // 2 - 1), mode="symmetric"))
        drift_s = np.unwrap(np.angle(sums[SLOWLY:] - sums[:-SLOWLY])) * (period_s / (2.0 * np.pi))
        lost = (least_s - drift_s) / period_s
        whole = np.rint(lost)
        period_s += float(np.polyfit(place, drift_s, 1)[0])
    if float(np.mean(np.abs(lost - whole) > UNSURE_SHARE)) > MOST_UNSURE_SHARE:
        return None
    numbers = place + np.maximum.accumulate(whole - whole[0]).astype(np.int64)
    return np.asarray(numbers, np.int64)


def _least_ahead(late_s: F64) -> F64:
    """(n,) the minimum over each sample and those after it, AHEAD in all."""
    least_s, reach = np.concatenate([late_s, np.full(AHEAD - 1, np.inf)]), 1
    while reach < AHEAD:
        step = min(reach, AHEAD - reach)
        least_s = np.minimum(least_s[:-step], least_s[step:])
        reach += step
    return least_s


def _timing_by(counter: I64, modulus: int, t_ns: I64, mean_s: float) -> Timing | None:
    """The clock by the message counter; None if it does not count, or wraps too fast for such late stamps."""
    if len(counter) >= OFTEN_ROUND * modulus:
        modulus = int(np.max(counter)) + 1  # four bits often count from 0 to 14 only
    ahead = np.diff(counter) % modulus if modulus > 1 else np.zeros(len(counter) - 1, np.int64)
    steps, n_times = np.unique(ahead, return_counts=True)
    if steps[np.argmax(n_times)] == 0 or np.max(n_times) < MOSTLY * len(ahead):
        return None
    usual = int(steps[np.argmax(n_times)])
    wait_s = np.diff(t_ns) / NS_PER_S
    is_sure = wait_s / mean_s * usual < 0.5 * modulus
    waits = wait_s * (np.sum(ahead[is_sure]) / max(np.sum(wait_s[is_sure]), mean_s))
    if float(np.mean(waits - ahead > 0.5 * modulus)) > FEW_OFF_SHARE:
        return None
    timing = _timing(t_ns, _unrolled(ahead, modulus, waits))
    is_off = np.abs(timing.delay_s) > OFF_S
    return timing if float(np.mean(is_off)) < FEW_OFF_SHARE else None


def _unrolled(ahead: I64, modulus: int, waits: F64) -> I64:
    """Numbers (n + 1,) from steps of the counter; ``waits`` (n,) in steps give how often it wrapped in between.

    A frame sent twice gives no step, and an overtaken one a step back.
    """
    rounds = np.rint((waits - ahead) / modulus)
    numbers: I64 = np.r_[0, np.cumsum(ahead + modulus * rounds)].astype(np.int64)
    return numbers


def _clock(t_s: F64, numbers: I64) -> tuple[F64, float]:
    """Times (n,) by a piecewise line through stamps over numbers, and its mean period in s."""
    slope_s, begin_s = np.polyfit(numbers, t_s, 1)
    line_s = begin_s + slope_s * numbers
    off_s = t_s - line_s
    edges = np.linspace(0, len(t_s), max(1, round(len(t_s) / PIECE)) + 1).astype(int)
    pieces = [slice(a, b) for a, b in pairwise(edges.tolist())]
    middles = [float(np.mean(numbers[piece])) for piece in pieces]
    bends_s = np.interp(numbers, middles, [_midmean(off_s[piece]) for piece in pieces])
    return line_s + bends_s, float(slope_s)


def _midmean(x: F64) -> float:
    """Mean of the middle half: as robust as a median, and steady where bursts leave only a few distinct delays."""
    quarter = len(x) // 4
    return float(np.mean(np.sort(x)[quarter : len(x) - quarter]))
