"""Stretches of one load, pooled until they make a batch.

    parts = (*parts, Part(window, way))      # windows in order, each as the scheduler cut it
    spanned(parts, begin_ns, end_ns)         # all driving in that time, as one batch
    changes_of(parts, weigh, rules)          # the stops at which the load changed

A window with too little driving is no batch, but its data are not lost: it waits for later windows, across the stops
between them. Every stop of 10 s or more may separate two loads. The stretches between such stops are weighed one by
one, and neighbours that agree are merged (core.loads).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from gateway.core.batch_settings import BatchSettings
from gateway.core.bends import joined_gains
from gateway.core.change import Rules
from gateway.core.journey import LEAST_STOP_S
from gateway.core.loads import LONG_S, Halt, LoadLink, Weighing, halts_of, loads_of
from gateway.core.spectrum import longest_run
from gateway.estimates.batch_estimate import Estimate, Way
from gateway.estimates.posterior import Posterior
from gateway.records import Batch, Why
from gateway.units import NS_PER_S

LEAST_RUN_S: Final = 6.0  # chosen: unbroken usable driving that holds one segment of a spectrum
LEAST_SIDE_S: Final = 30.0  # chosen: usable driving on each side of a border between loads
LEAST_LOAD_S: Final = 60.0  # chosen: usable driving for an estimate after a change, as for a provisional estimate
PARTED_FROM: Final = 0.9  # chosen: least probability of a change; short stretches scatter
MOST_DRIVEN_S: Final = 1800.0  # chosen: driving without a batch, after which it is refused and the pool is emptied
MOST_BREAK_S: Final = 3600.0  # chosen: after a longer break springs and sensors have another temperature

_FAULTS: Final = frozenset({Why.GRAVITY_MISSING, Why.SENSOR_RATE_LOW, Why.TIME_STAMPS})


@dataclass(frozen=True, slots=True)
class Part:
    """A window, or a piece of one, and its way."""

    batch: Batch
    way: Way

    @property
    def driven_s(self) -> float:
        """Duration of the whole window, stops included."""
        return self.batch.duration_s


Parts = tuple[Part, ...]
Weigh = Callable[[Batch], Posterior | None]


def can_be_pooled(window: Batch, settings: BatchSettings) -> bool:
    """True if only a lack of driving keeps a window from being a batch, and no fault of a sensor."""
    if not _FAULTS.isdisjoint(window.rejected) or window.gap_share > settings.gap_share_max:
        return False
    n_at_speed = np.count_nonzero(~(window.speed_mps < settings.speed_min_mps))
    return bool(np.count_nonzero(window.usable) >= settings.usable_share_min * n_at_speed)


def has_stretch(window: Batch) -> bool:
    """Whether its usable driving holds a segment of a spectrum."""
    return longest_run(window.usable) >= LEAST_RUN_S * window.rate_hz


def continued(parts: Parts, window: Batch) -> Parts:
    """The parts that a window may be pooled with: none after a long break or a clock set back; if the window is a batch
    by itself, none of another drive; and no rest of an earlier load.

    Such a rest is too short for the change test; if the vehicle then stood long enough to load, and the window is long
    enough to do without it, it would weigh as a part of the old load.
    """
    if not parts:
        return ()
    last = parts[-1].batch
    break_ns = window.t_start_ns - last.t_end_ns
    is_next = 0 <= break_ns <= MOST_BREAK_S * NS_PER_S
    is_of_drive = bool(window.rejected) or window.drive_start_ns == last.drive_start_ns
    is_short = sum(part.batch.usable_s for part in parts) < LEAST_SIDE_S
    is_rest = is_short and break_ns >= LONG_S * NS_PER_S and window.usable_s >= LEAST_LOAD_S
    return parts if is_next and is_of_drive and not is_rest else ()


def is_batch(parts: Parts, settings: BatchSettings) -> bool:
    """Whether the parts have the duration and the usable driving of a batch."""
    return missing_s(parts, settings) <= 0.0 and driven_s(parts) >= settings.last_batch_share_min * settings.window_s


def driven_s(parts: Parts) -> float:
    """Duration of all windows, stops included."""
    return sum(part.driven_s for part in parts)


def missing_s(parts: Parts, settings: BatchSettings) -> float:
    """Usable driving (s) that a batch still lacks."""
    return settings.usable_share_min * settings.window_s - sum(part.batch.usable_s for part in parts)


def changes_of(parts: Parts, weigh: Weigh, rules: Rules) -> list[int]:
    """The middles (ns) of the stops at which the load changed, in order. Weighs nothing if there is no such stop."""
    blanks = [Estimate(one.batch.t_start_ns, one.batch.t_end_ns, "", way=one.way) for one in parts]
    begin_ns, end_ns = blanks[0].t_start_ns, blanks[-1].t_end_ns
    borders = [
        halt
        for halt in halts_of(blanks)
        if halt.t_end_ns - halt.t_start_ns >= LEAST_STOP_S * NS_PER_S and begin_ns < halt.middle[1] < end_ns
    ]
    halts = _with_sides(parts, borders)
    if not halts:
        return []
    bounds = [begin_ns, *(halt.middle[1] for halt in halts), end_ns]
    found = [weigh(spanned(parts, *span)) for span in pairwise(bounds)]
    weighings = [Weighing(i, (None, ""), one) for i, one in enumerate(found) if one is not None]
    links = [
        LoadLink(tuple(halts[one.at : other.at]), bounds[one.at + 1], bounds[other.at])
        for one, other in pairwise(weighings)
    ]
    loads = loads_of(weighings, links, rules, PARTED_FROM).loads if weighings else ()
    return [max(links[load.last].halts, key=lambda halt: halt.prior).middle[1] for load in loads[:-1]]


def _with_sides(parts: Parts, halts: list[Halt]) -> list[Halt]:
    """The borders with enough driving on either side; drops the least likely ones first."""
    begin_ns, end_ns = parts[0].batch.t_start_ns, parts[-1].batch.t_end_ns
    while halts:
        bounds = [begin_ns, *(halt.middle[1] for halt in halts), end_ns]
        short = [i for i, span in enumerate(pairwise(bounds)) if usable_s(parts, *span) < LEAST_SIDE_S]
        if not short:
            break
        beside = sorted({i for at in short for i in (at - 1, at) if 0 <= i < len(halts)})
        del halts[min(beside, key=lambda i: halts[i].prior)]
    return halts


def usable_s(parts: Parts, begin_ns: int, end_ns: int) -> float:
    """Usable driving from begin to end."""
    return sum(
        float(np.count_nonzero(part.batch.usable[_samples(part.batch, begin_ns, end_ns)])) / part.batch.rate_hz
        for part in parts
    )


def spanned(parts: Sequence[Part], begin_ns: int, end_ns: int) -> Batch:
    """The driving from begin to end (at least a part of one window) as one batch without rejections.

    Breaks between windows are left out: the arrays are those of the windows joined, with the last sample of each
    masked, so that no segment crosses into the next. Shares are weighted by the windows' lengths.
    """
    cuts = [cut for part in parts if len((cut := _cut(part.batch, begin_ns, end_ns)).usable)]
    if len(cuts) == 1:
        return cuts[0]
    first, last = cuts[0], cuts[-1]
    usable = np.concatenate([cut.usable for cut in cuts])
    usable[np.cumsum([len(cut.usable) for cut in cuts]) - 1] = False
    known = [cut for cut in cuts if cut.usable.any()]
    gravity_mps2 = np.average([cut.gravity_mps2 for cut in known], weights=[np.count_nonzero(c.usable) for c in known])
    weights = np.array([len(cut.usable) for cut in cuts]) / len(usable)
    rolls = [cut.roll_rate_radps for cut in cuts if cut.roll_rate_radps is not None]
    return Batch(
        t_start_ns=first.t_start_ns,
        t_end_ns=last.t_end_ns,
        drive_start_ns=last.drive_start_ns,
        rate_hz=first.rate_hz,
        vertical_acceleration_mps2=np.concatenate([cut.vertical_acceleration_mps2 for cut in cuts]),
        pitch_rate_radps=np.concatenate([cut.pitch_rate_radps for cut in cuts]),
        speed_mps=np.concatenate([cut.speed_mps for cut in cuts]),
        usable=usable,
        gravity_mps2=float(gravity_mps2),
        gap_share=float(weights @ [cut.gap_share for cut in cuts]),
        shares={
            why: float(weights @ [cut.shares.get(why, 0.0) for cut in cuts])
            for why in dict.fromkeys(why for cut in cuts for why in cut.shares)
        },
        longest_stop_s=max(cut.longest_stop_s for cut in cuts),
        is_provisional=last.is_provisional,
        roll_rate_radps=np.concatenate(rolls) if len(rolls) == len(cuts) else None,
        sensor_rate_hz=min(cut.sensor_rate_hz for cut in cuts),
        gyro_gain=joined_gains([cut.gyro_gain for cut in cuts]),
    )


def _cut(window: Batch, begin_ns: int, end_ns: int) -> Batch:
    """The samples of a window from begin to end."""
    at = _samples(window, begin_ns, end_ns)
    if at == slice(0, len(window.usable)):
        return replace(window, rejected=())
    usable, acceleration_mps2 = window.usable[at], window.vertical_acceleration_mps2[at]
    shift_mps2 = float(np.mean(acceleration_mps2[usable])) if usable.any() else 0.0
    return replace(
        window,
        t_start_ns=max(begin_ns, window.t_start_ns),
        t_end_ns=min(end_ns, window.t_end_ns),
        vertical_acceleration_mps2=acceleration_mps2 - shift_mps2,
        pitch_rate_radps=window.pitch_rate_radps[at],
        speed_mps=window.speed_mps[at],
        usable=usable,
        gravity_mps2=window.gravity_mps2 + shift_mps2,
        rejected=(),
        roll_rate_radps=None if window.roll_rate_radps is None else window.roll_rate_radps[at],
    )


def _samples(window: Batch, begin_ns: int, end_ns: int) -> slice:
    """The slice of a window's samples from begin to end; empty if the window is elsewhere."""
    n, since_ns = len(window.usable), window.t_start_ns
    begin, end = (round((t_ns - since_ns) * window.rate_hz / NS_PER_S) for t_ns in (begin_ns, end_ns))
    begin = min(max(begin, 0), n)
    return slice(begin, n if end_ns >= window.t_end_ns else min(max(end, begin), n))
