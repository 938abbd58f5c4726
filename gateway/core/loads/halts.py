"""Where the load can have changed: stops between drives and within, and how likely that was before weighing.

Batches count in the order in which they came. Where the clock was put back, what comes after is by another ``clock``
(the first of them 0, then 1, ...): two moments are compared by their clocks first, by their stamps where those are one.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import Final

from gateway.core.change import ROLLING
from gateway.core.loads.load import Weighing
from gateway.estimate import NOWHERE, UNWATCHED, Estimate, Place, Watched
from gateway.units import NS_PER_S

LONG_S: Final = 60.0
PRIORS: Final[dict[tuple[bool, bool | None], float]] = {
    # (at least LONG_S, door opened): how likely a change of load is
    (True, True): 0.7,
    (True, None): 0.5,
    (True, False): 0.02,
    (False, True): 0.2,
    (False, None): 0.01,
    (False, False): 0.001,
}
"""Judgement, not measurement: a delivery vehicle stops to load or to rest about as often, and does it by its doors."""
SLACK_NS: Final = NS_PER_S // 10  # batches and stops that touch do so within this
_CANDIDATE_SHARE: Final = 0.3  # of the most likely stop's prior


@dataclass(frozen=True, slots=True)
class Halt:
    """The vehicle stood, or nobody heard of it, from and to."""

    t_start_ns: int
    t_end_ns: int
    watched: Watched = UNWATCHED
    place: Place = NOWHERE
    is_between_drives: bool = False
    clock: int = 0

    @property
    def prior(self) -> float:
        is_long = self.t_end_ns - self.t_start_ns >= LONG_S * NS_PER_S
        return PRIORS[is_long, self.watched.door_opened]

    def joined(self, later: "Halt") -> "Halt":
        """One halt with what follows at once."""
        return Halt(
            self.t_start_ns,
            later.t_end_ns,
            self.watched.joined(later.watched),
            self.place if self.place.is_known else later.place,
            self.is_between_drives or later.is_between_drives,
            self.clock,
        )

    @property
    def middle(self) -> tuple[int, int]:
        return self.clock, _middle(self.t_start_ns, self.t_end_ns)


@dataclass(frozen=True, slots=True)
class Link:
    """What lies between two weighings that follow one another: the halts in which the load can have changed."""

    halts: tuple[Halt, ...]
    t_start_ns: int  # of the time between them, where there is no halt
    t_end_ns: int
    clocks: tuple[int, int] = (0, 0)  # of the two weighings

    @property
    def prior(self) -> float:
        unchanged = 1.0 - ROLLING
        for halt in self.halts:
            unchanged *= 1.0 - halt.prior
        return 1.0 - unchanged

    @property
    def likely(self) -> tuple[Halt, ...]:
        """The halts where it can well have been."""
        most = max((halt.prior for halt in self.halts), default=0.0)
        return tuple(halt for halt in self.halts if halt.prior >= max(_CANDIDATE_SHARE * most, PRIORS[False, None]))

    @property
    def clock(self) -> int:
        """By which the span's end is stamped."""
        return self.likely[-1].clock if self.likely else self.clocks[1]

    @property
    def span_ns(self) -> tuple[int, int]:
        """From and to when it can well have changed; within what both clocks allow, where two stamped it."""
        halts = self.likely
        begin_ns = halts[0].t_start_ns if halts else self.t_start_ns
        end_ns = halts[-1].t_end_ns if halts else self.t_end_ns
        return begin_ns if self.clock == self.clocks[0] else min(max(begin_ns, self.t_start_ns), end_ns), end_ns


def follows(before: Estimate, after: Estimate) -> bool:
    """Whether two batches are of one drive, one right behind the other."""
    return abs(after.way_start_ns - before.t_end_ns) <= 1_000


def clocks_of(estimates: Sequence[Estimate]) -> list[int]:
    """By which clock each batch is stamped: how many times it was put back among those before."""
    put_back = (after.way_start_ns < before.t_end_ns - SLACK_NS for before, after in pairwise(estimates))
    return list(accumulate(put_back, initial=0))[: len(estimates)]


def halts_of(estimates: Sequence[Estimate]) -> list[Halt]:
    """All halts in the order in which they came; what touches is one halt."""
    halts: list[Halt] = []
    for halt in _halts(estimates):
        touches = halts and -SLACK_NS <= halt.t_start_ns - halts[-1].t_end_ns <= SLACK_NS
        if touches and halt.clock == halts[-1].clock:
            halts[-1] = halts[-1].joined(halt)
        else:
            halts.append(halt)
    return halts


def links_of(estimates: Sequence[Estimate], weighings: Sequence[Weighing], halts: Sequence[Halt]) -> list[Link]:
    """What lies between each weighing and the next, by the middles of their batches and of the halts."""
    links, after, clocks = [], 0, clocks_of(estimates)
    for one, other in pairwise(weighings):
        before, behind = estimates[one.at], estimates[other.at]
        begin = clocks[one.at], _middle(before.t_start_ns, before.t_end_ns)
        end = clocks[other.at], _middle(behind.t_start_ns, behind.t_end_ns)
        while after < len(halts) and halts[after].middle < begin:
            after += 1
        last = after
        while last < len(halts) and halts[last].middle < end:
            last += 1
        later_ns = behind.t_start_ns if end[0] > begin[0] else max(before.t_end_ns, behind.t_start_ns)
        links.append(Link(tuple(halts[after:last]), before.t_end_ns, later_ns, (begin[0], end[0])))
        after = last
    return links


def _halts(estimates: Sequence[Estimate]) -> Iterator[Halt]:
    clocks = clocks_of(estimates)
    for i, one in enumerate(estimates):
        for stop in one.way.stops if one.way else ():
            yield Halt(stop.t_start_ns, stop.t_end_ns, stop.watched, stop.place, clock=clocks[i])
        after = estimates[i + 1] if i + 1 < len(estimates) else None
        if after is not None and not follows(one, after):
            before = after.way.before if after.way else UNWATCHED
            place = one.way.end if one.way else NOWHERE
            begin_ns, end_ns = one.t_end_ns, max(one.t_end_ns, after.way_start_ns)
            if clocks[i + 1] > clocks[i]:  # nobody knows how long it stood
                begin_ns = end_ns = after.way_start_ns
            yield Halt(begin_ns, end_ns, before, place, is_between_drives=True, clock=clocks[i + 1])


def _middle(begin_ns: int, end_ns: int) -> int:
    return (begin_ns + end_ns) // 2
