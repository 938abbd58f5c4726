"""From weighings to loads: neighbours that are more likely one load than two are merged, the likeliest first.

This is agglomerative clustering of neighbours by posterior odds, one merge at a time, like Ward's method with a Bayes
factor as its distance (Ward, J. Am. Stat. Assoc. 58 (1963) 236-244). Each merged load is weighed again with all its
batches, so further batches sharpen both sides of a change, and an apparent change may disappear.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from gateway.core.change import EVEN, Rules, probability
from gateway.core.loads.halts import LoadLink
from gateway.core.loads.load import FusedLoad, Weighing, Weighings


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
    return probability(before.measured, after.measured, links[before.last].prior, rules)
