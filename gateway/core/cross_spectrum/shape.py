"""The shape of a load as a hypothesis: a batch is weighed under several, and each counts by how well it explains it.

A long or high load is harder to pitch than a compact one (core.cargo). The spectra tell the two apart, though less well
than their own statistics say, for the half-car errs too: the evidence is tempered. What is left is a distribution of
the payload that is skewed, because a load can be much longer than a compact one and hardly shorter.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import log_ndtr

from gateway.core.cargo import ShapePrior
from gateway.core.spline import between, monotone_slopes
from gateway.posterior import NORMAL_TAILS
from gateway.records import F64

NODES_PER_WHEELBASE2: Final = (0.004, 0.013, 0.032, 0.06, 0.095, 0.14, 0.2, 0.3)
"""Squared radii of gyration at which a load is weighed, over the squared wheelbase: 0.03 to 2.4 m2 in a van of 2.8
m.
"""
EVIDENCE: Final = 0.5
"""How much a batch's evidence counts against calibration and nature, 1 being what its own statistics say.
Chosen on simulated vans that serve no other purpose (`benchmarks.accuracy budget`).
"""
EVIDENCE_WITHOUT_ROLL: Final = 0.2  # of a sensor that takes roll for heave and nobody can tell; as in calibration
SHAPE_EVIDENCE: Final = 2.0  # against shapes it counts so many times as much, with Student's tail; chosen likewise
EVIDENCE_DOF: Final = 4.0
"""Degrees of freedom of that tail: a batch is one witness of how much the half-car errs, so a shape that it speaks
against stays possible (K. L. Lange, R. J. A. Little and J. M. G. Taylor, J. Am. Stat. Assoc. 84 (1989) 881-896).
"""
LEAST_PROBABILITY: Final = 1e-3  # of a shape that is worth weighing, before and after
POINTS: Final = (0.025, 0.5, 0.975)


@dataclass(frozen=True, slots=True, eq=False)
class Waypoint:
    """Where a search ended under one log s: x (k,), and by how much x moves with log s (moves (k,))."""

    log_s: float
    x: F64
    moves: F64


@dataclass(frozen=True, slots=True, eq=False)
class Node:
    """A load weighed under one shape: where its search ended (at), minus the logarithm of its evidence (cost), the
    answer x (k,), payload in kg and front share (0..1) being its last, and the payload's own error.
    """

    at: Waypoint
    cost: float
    x: F64
    own_std_kg: float
    is_converged: bool = True

    @property
    def improbable(self) -> float:
        """Minus the logarithm of how probable a load of this mass is: one that is less than nothing has no shape."""
        return -float(log_ndtr(self.x[-2] / self.own_std_kg + 2.0))


@dataclass(frozen=True, slots=True, eq=False)
class Shaped:
    """The posterior over shapes: x (k,) at its mean log_s; the median load (2,), payload in kg and front share 0..1.

    column (2,) is one standard deviation of what the shape leaves open, tails its 2.5 and 97.5 % points in these;
    goods_part (0 to 1) is the part of its variance that is the same for all loads of the vehicle. likeliest is the log
    s and the peak of the shape that explains the batch best; is_converged says whether the search settled there.
    """

    log_s: float
    x: F64
    load: F64
    column: F64
    tails: tuple[float, float]
    goods_part: float
    likeliest: tuple[float, F64]
    is_converged: bool


def shaped(
    prior: ShapePrior,
    wheelbase_m: float,
    start: Waypoint,
    weighed_as: Callable[[float, F64], Node],
    evidence: float,
) -> Shaped:
    """``start`` is where a search ended already; ``weighed_as`` weighs under another log s, beginning at an x (k,)."""
    nodes, founds = _profile(prior, wheelbase_m, start, weighed_as, evidence)
    if len(nodes) == 1:
        x = founds[0].x
        likeliest = float(nodes[0]), founds[0].at.x
        return Shaped(likeliest[0], x, x[-2:], np.zeros(2), NORMAL_TAILS, 0.0, likeliest, founds[0].is_converged)
    within = (prior.log_s >= nodes[0]) & (prior.log_s <= nodes[-1])
    log_s = prior.log_s[within]
    least = min(found.cost for found in founds)
    against = np.array([_against(found.cost - least, evidence) + found.improbable for found in founds])
    cost = between(log_s, nodes, against, monotone_slopes(nodes, against))
    answers = np.stack([found.x for found in founds])
    slopes = monotone_slopes(nodes, answers)
    weight = prior.probability[within] * np.exp(-(cost - cost.min()))
    weight /= weight.sum()
    mean_log_s = float(weight @ log_s)
    loads = between(log_s, nodes, answers, slopes)[:, -2:]
    away = loads - weight @ loads
    payload_std = float(np.sqrt(weight @ away[:, 0] ** 2))
    load, column, tails = weight @ loads, np.zeros(2), NORMAL_TAILS
    if payload_std > 0.0:
        column = np.array([payload_std, float(weight @ (away[:, 0] * away[:, 1])) / payload_std])
        low, middle, high = _points(away[:, 0] / payload_std, weight)
        load, tails = load + middle * column, (middle - low, high - middle)
    best = min(range(len(nodes)), key=lambda i: founds[i].cost)
    likeliest = float(nodes[best]), founds[best].at.x
    narrowed = float(weight @ (log_s - mean_log_s) ** 2) / prior.variance
    goods_part = prior.habit * min(narrowed, 1.0)
    is_converged = founds[best].is_converged
    [x] = between(np.array([mean_log_s]), nodes, answers, slopes)
    return Shaped(mean_log_s, x, load, column, tails, goods_part, likeliest, is_converged)


def _profile(
    prior: ShapePrior,
    wheelbase_m: float,
    start: Waypoint,
    weighed_as: Callable[[float, F64], Node],
    evidence: float,
) -> tuple[F64, list[Node]]:
    """Nodes in order and what was found at each, from the start outwards until a shape is out of the question."""
    cumulated = np.cumsum(prior.probability)
    lowest, highest = np.interp([LEAST_PROBABILITY, 1.0 - LEAST_PROBABILITY], cumulated, prior.log_s)
    nodes = np.log(np.array(NODES_PER_WHEELBASE2) * wheelbase_m**2)
    wanted = [float(node) for node in nodes if lowest < node < highest]
    wanted = sorted({float(lowest), *wanted, float(highest)})
    found: dict[float, Node] = {}
    least = np.inf
    above = [node for node in wanted if node >= start.log_s]
    below = [node for node in reversed(wanted) if node < start.log_s]
    for outwards in (above, below):
        passed = [start]
        for node in outwards:
            found[node] = weighed_as(node, _ahead(node, passed))
            passed.append(found[node].at)
            least = min(least, found[node].cost)
            if _against(found[node].cost - least, evidence) > -np.log(LEAST_PROBABILITY):
                break
    inside = sorted(found)
    return np.array(inside), [found[node] for node in inside]


def _ahead(log_s: float, passed: Sequence[Waypoint]) -> F64:
    """Where the next search will end: on a parabola through the last waypoint, along its slope, and through an earlier
    one far enough off to tell how the path bends.
    """
    last = passed[-1]
    further = log_s - last.log_s
    x: F64 = last.x + further * last.moves
    for earlier in reversed(passed[:-1]):
        back = earlier.log_s - last.log_s
        if abs(back) >= 0.5 * abs(further):
            return x + (earlier.x - last.x - back * last.moves) * (further / back) ** 2
    return x


def _against(excess: float, evidence: float) -> float:
    """Minus the logarithm of how probable the batch makes a shape whose cost is so much above the best one's."""
    return 0.5 * (EVIDENCE_DOF + 1.0) * float(np.log1p(2.0 * SHAPE_EVIDENCE * evidence * excess / EVIDENCE_DOF))


def _points(x: F64, weight: F64) -> tuple[float, float, float]:
    """The 2.5, 50 and 97.5 % points of a weighted sample."""
    order = np.argsort(x)
    cumulated = np.cumsum(weight[order]) - 0.5 * weight[order]
    low, middle, high = np.interp(POINTS, cumulated, x[order])
    return float(low), float(middle), float(high)
