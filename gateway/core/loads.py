"""Which weighings are of one load: the stops at which it can have changed, and neighbours that agree.

Batches count in order of arrival. If the clock was set back, the batches after it have the next ``clock`` number (0, 1,
...). Two times are compared by clock first, then by time stamp.

Neighbours that are more likely one load than two are merged, the likeliest first. This is agglomerative clustering of
neighbours by posterior odds, one merge at a time, like Ward's method with a Bayes factor as its distance (Ward, J. Am.
Stat. Assoc. 58 (1963) 236-244). Each merged load is weighed again with all its batches, so further batches sharpen both
sides of a change, and an apparent change may disappear.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import accumulate, pairwise
from typing import Final

from gateway.core.change import EVEN, ROLLING, Rules, probability
from gateway.core.fusion import teaches
from gateway.estimates.batch_estimate import NOWHERE, UNWATCHED, Estimate, Place, Watched
from gateway.estimates.posterior import Fusible, Posterior
from gateway.units import NS_PER_S


@dataclass(frozen=True, slots=True)
class Weighing:
    """One counted batch. ``at`` is its index among all batches, ``by`` its calibration and estimator."""

    at: int
    by: tuple[str | None, str]
    posterior: Posterior


class Weighings:
    """Weighings in order; any consecutive ones can be fused as one load."""

    def __init__(self, each: Sequence[Weighing]) -> None:
        self.each = each

    @cached_property
    def fusible(self) -> Fusible:
        return Fusible([one.posterior for one in self.each])

    def __len__(self) -> int:
        return len(self.each)

    def load(self, first: int, last: int) -> "FusedLoad":
        """Weighings first to last (inclusive indexes) as one load."""
        return FusedLoad(first, last, self)


@dataclass(frozen=True)
class FusedLoad:
    """Weighings first to last (inclusive indexes), fused as one load."""

    first: int
    last: int
    weighings: Weighings = field(repr=False)

    @property
    def n_batches(self) -> int:
        return self.last - self.first + 1

    @cached_property
    def posterior(self) -> Posterior:
        """The posterior of all of them together."""
        return self.weighings.fusible.fused(self.first, self.last + 1)


def weighings_of(estimates: Sequence[Estimate]) -> list[Weighing]:
    """The weighings of the batches that give a payload."""
    return [
        Weighing(at, (one.calibration_id, one.estimator), one.posterior)
        for at, one in enumerate(estimates)
        if teaches(one) and one.posterior is not None
    ]


LONG_S: Final = 60.0  # chosen: time enough to load or unload, as in core.fusion
PRIORS: Final[dict[tuple[bool, bool | None], float]] = {
    # (at least LONG_S, door opened): how likely a change of load is
    (True, True): 0.7,
    (True, None): 0.5,
    (True, False): 0.02,
    (False, True): 0.2,
    (False, None): 0.01,
    (False, False): 0.001,
}
"""Chosen, not measured: a delivery vehicle stops about as often to load as to rest, and loads through its doors."""
SLACK_NS: Final = NS_PER_S // 10  # chosen: batches and stops closer than this touch
_CANDIDATE_SHARE: Final = 0.3  # chosen: of the most likely stop's prior; less likely stops are not named


@dataclass(frozen=True, slots=True)
class Halt:
    """A stretch of time in which the vehicle stood or was silent."""

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
        """One halt of this and the next, which touches it."""
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
class LoadLink:
    """The halts between two consecutive weighings, in which the load can have changed."""

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
        """The halts with a relevant probability of the change."""
        most = max((halt.prior for halt in self.halts), default=0.0)
        return tuple(halt for halt in self.halts if halt.prior >= max(_CANDIDATE_SHARE * most, PRIORS[False, None]))

    @property
    def clock(self) -> int:
        """The clock of the span's end."""
        return self.likely[-1].clock if self.likely else self.clocks[1]

    @property
    def span_ns(self) -> tuple[int, int]:
        """Begin and end (ns) of the time in which the change is likely, limited by both clocks if they differ."""
        halts = self.likely
        begin_ns = halts[0].t_start_ns if halts else self.t_start_ns
        end_ns = halts[-1].t_end_ns if halts else self.t_end_ns
        return begin_ns if self.clock == self.clocks[0] else min(max(begin_ns, self.t_start_ns), end_ns), end_ns


def follows(before: Estimate, after: Estimate) -> bool:
    """Whether two batches are consecutive and of one drive."""
    return abs(after.way_start_ns - before.t_end_ns) <= 1_000


def clocks_of(estimates: Sequence[Estimate]) -> list[int]:
    """The clock number of each batch: how often the clock was set back before it."""
    put_back = (after.way_start_ns < before.t_end_ns - SLACK_NS for before, after in pairwise(estimates))
    return list(accumulate(put_back, initial=0))[: len(estimates)]


def halts_of(estimates: Sequence[Estimate]) -> list[Halt]:
    """All halts in order of arrival; touching halts are merged."""
    halts: list[Halt] = []
    for halt in _halts(estimates):
        touches = halts and -SLACK_NS <= halt.t_start_ns - halts[-1].t_end_ns <= SLACK_NS
        if touches and halt.clock == halts[-1].clock:
            halts[-1] = halts[-1].joined(halt)
        else:
            halts.append(halt)
    return halts


def links_of(estimates: Sequence[Estimate], weighings: Sequence[Weighing], halts: Sequence[Halt]) -> list[LoadLink]:
    """The link between each weighing and the next, by the middles of batches and halts."""
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
        links.append(LoadLink(tuple(halts[after:last]), before.t_end_ns, later_ns, (begin[0], end[0])))
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


@dataclass(frozen=True, slots=True)
class Loads:
    """The loads in order, the load of each weighing, and the links between weighings."""

    loads: tuple[FusedLoad, ...]
    of_weighing: tuple[FusedLoad, ...]
    links: Sequence[LoadLink]
    rules: Rules

    def sides(self, link: int) -> tuple[FusedLoad, FusedLoad]:
        """The loads before and after a link, or the two parts of the load that spans it."""
        before, after = self.of_weighing[link], self.of_weighing[link + 1]
        if before is not after:
            return before, after
        return before.weighings.load(before.first, link), before.weighings.load(link + 1, before.last)

    def probability(self, link: int) -> float:
        """The probability that the load changed at this link."""
        return _between(*self.sides(link), self.links, self.rules)


def loads_of(
    weighings: Sequence[Weighing], links: Sequence[LoadLink], rules: Rules, parted_from: float = EVEN
) -> Loads:
    """The loads of weighings with ``links`` between them; changes less likely than ``parted_from`` are ignored.

    Weighings of different calibrations cannot be compared: a load always ends there.
    """
    whole = Weighings(weighings)
    loads = [whole.load(i, i) for i in range(len(whole))]
    odds = [_between(one, other, links, rules) for one, other in pairwise(loads)]
    while odds and min(odds) < parted_from:
        at = odds.index(min(odds))
        loads[at : at + 2] = [whole.load(loads[at].first, loads[at + 1].last)]
        del odds[at]
        for near in (at - 1, at):
            if 0 <= near < len(odds):
                odds[near] = _between(loads[near], loads[near + 1], links, rules)
    return Loads(tuple(loads), tuple(load for load in loads for _ in range(load.n_batches)), links, rules)


def _between(before: FusedLoad, after: FusedLoad, links: Sequence[LoadLink], rules: Rules) -> float:
    each = before.weighings.each
    if each[before.last].by != each[after.first].by:
        return 1.0
    return probability(before.posterior, after.posterior, links[before.last].prior, rules)
