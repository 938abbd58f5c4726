"""From weighings to loads: neighbours that are more likely one load than two are taken together, the likeliest first.

Agglomeration of neighbours by posterior odds, one join at a time, as in Ward's method with a Bayes factor for its
distance (Ward, J. Am. Stat. Assoc. 58 (1963) 236-244). What was joined is weighed anew with all its batches, so each
further batch sharpens both sides of a change, and what looked like one may turn out to be none.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from gateway.core.change import EVEN, Rules, probability
from gateway.core.loads.halts import Link
from gateway.core.loads.load import Load, Weighing, Weighings


@dataclass(frozen=True, slots=True)
class Loads:
    """The loads in order, the load of each weighing, and the links between weighings by which they were told apart."""

    loads: tuple[Load, ...]
    of_weighing: tuple[Load, ...]
    links: Sequence[Link]
    rules: Rules

    def sides(self, link: int) -> tuple[Load, Load]:
        """What lies before and after a link: the loads on its two sides, or the two parts of the load around it."""
        before, after = self.of_weighing[link], self.of_weighing[link + 1]
        if before is not after:
            return before, after
        return before.weighings.load(before.first, link), before.weighings.load(link + 1, before.last)

    def probability(self, link: int) -> float:
        """That the load changed there."""
        return _between(*self.sides(link), self.links, self.rules)


def loads_of(weighings: Sequence[Weighing], links: Sequence[Link], rules: Rules, parted_from: float = EVEN) -> Loads:
    """Loads of weighings with ``links`` between them; a change less likely than ``parted_from`` is none.

    Other calibrations cannot be compared: there a load ends.
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


def _between(before: Load, after: Load, links: Sequence[Link], rules: Rules) -> float:
    each = before.weighings.each
    if each[before.last].by != each[after.first].by:
        return 1.0
    return probability(before.measured, after.measured, links[before.last].prior, rules)
