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
from gateway.core.loads.load import Load, Weighing, load_of


@dataclass(frozen=True, slots=True)
class Loads:
    """The loads in order, and how likely the load changed in each link between two weighings."""

    loads: tuple[Load, ...]
    of_weighing: tuple[Load, ...]
    probabilities: tuple[float, ...]


def loads_of(weighings: Sequence[Weighing], links: Sequence[Link], rules: Rules, parted_from: float = EVEN) -> Loads:
    """Loads of weighings with ``links`` between them; a change less likely than ``parted_from`` is none.

    Other calibrations cannot be compared: there a load ends.
    """
    loads = [load_of(weighings, i, i) for i in range(len(weighings))]
    odds = [_between(one, other, weighings, links, rules) for one, other in pairwise(loads)]
    while odds and min(odds) < parted_from:
        at = odds.index(min(odds))
        loads[at : at + 2] = [load_of(weighings, loads[at].first, loads[at + 1].last)]
        del odds[at]
        for near in (at - 1, at):
            if 0 <= near < len(odds):
                odds[near] = _between(loads[near], loads[near + 1], weighings, links, rules)
    of_weighing = tuple(load for load in loads for _ in range(load.n_batches))
    return Loads(
        tuple(loads), of_weighing, tuple(_within(weighings, links, of_weighing, i, rules) for i in range(len(links)))
    )


def sides_of(weighings: Sequence[Weighing], of_weighing: Sequence[Load], link: int) -> tuple[Load, Load]:
    """What lies before and after a link: the loads on its two sides, or the two parts of the load around it."""
    before, after = of_weighing[link], of_weighing[link + 1]
    if before is not after:
        return before, after
    return load_of(weighings, before.first, link), load_of(weighings, link + 1, before.last)


def _within(
    weighings: Sequence[Weighing], links: Sequence[Link], of_weighing: Sequence[Load], link: int, rules: Rules
) -> float:
    before, after = sides_of(weighings, of_weighing, link)
    return _between(before, after, weighings, links, rules)


def _between(before: Load, after: Load, weighings: Sequence[Weighing], links: Sequence[Link], rules: Rules) -> float:
    if weighings[before.last].by != weighings[after.first].by:
        return 1.0
    return probability(before.measured, after.measured, links[before.last].prior, rules)
