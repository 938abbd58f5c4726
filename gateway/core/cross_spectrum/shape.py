"""Hypotheses on the shape of a load: a batch is weighed under several shapes, weighted by their evidence.

A long or high load is harder to pitch than a compact one (core.cargo). The spectra distinguish them, though less well
than their statistics suggest, because the half-car has errors too: the evidence is tempered. The result is a skewed
distribution of the payload, because a load can be much longer than a compact one but hardly shorter.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.core.cargo import ShapePrior
from gateway.core.spline import between, monotone_slopes
from gateway.posterior import NORMAL_TAILS
from gateway.records import F64

NODES_PER_WHEELBASE2: Final = (0.004, 0.013, 0.032, 0.06, 0.095, 0.14, 0.2, 0.3)
"""Chosen: squared radii of gyration over the squared wheelbase at which a load is weighed: 0.03 to 2.4 m2 in a van with
a wheelbase of 2.8 m.
"""
EVIDENCE: Final = 0.5
"""Weight of a batch's evidence against calibration and nature, 1 being its statistical weight.
Chosen on simulated vans that serve no other purpose.
"""
EVIDENCE_WITHOUT_ROLL: Final = 0.2  # chosen: the same for a sensor that reads roll as heave; as in calibration
SHAPE_EVIDENCE: Final = 2.0  # chosen likewise: its factor for shapes, with Student's tail
EVIDENCE_DOF: Final = 4.0
"""Chosen: degrees of freedom of that tail. A batch is one sample of the half-car's error, so a shape that it
contradicts stays possible (K. L. Lange, R. J. A. Little and J. M. G. Taylor, J. Am. Stat. Assoc. 84 (1989) 881-896).
"""
LEAST_PROBABILITY: Final = 1e-3  # chosen: of a shape worth weighing, in prior and posterior
LEAST_ERFC: Final = -37.0  # chosen: erfc of a number further below is 0 in a double
POINTS: Final = (0.025, 0.5, 0.975)  # a 95 % interval and the median


@dataclass(frozen=True, slots=True, eq=False)
class Waypoint:
    """The end of a search under one log s: x (k,), and its derivative by log s (moves (k,))."""

    log_s: float
    x: F64
    moves: F64


@dataclass(frozen=True, slots=True, eq=False)
class Node:
    """A load weighed under one shape: the end of its search (at), minus its log evidence (cost), the answer x (k,) with
    payload in kg and front share (0..1) last, and the payload's own error.
    """

    at: Waypoint
    cost: float
    x: F64
    own_std_kg: float
    is_converged: bool = True

    @property
    def improbable(self) -> float:
        """Minus the logarithm of how probable a load of this mass is: one that is less than nothing has no shape."""
        return -log_normal_probability(self.x[-2] / self.own_std_kg + 2.0)


@dataclass(frozen=True, slots=True, eq=False)
class Shaped:
    """The posterior over shapes: x (k,) at its mean log_s; the median load (2,), payload in kg and front share 0..1.

    column (2,) is one standard deviation from the shape's uncertainty, tails its 2.5 and 97.5 % points in these units;
    goods_part (0 to 1) is the part of its variance common to all loads of the vehicle. likeliest is the log s and the
    peak of the shape with the highest evidence; is_converged says whether the search converged there.
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
    """The posterior over shapes; ``start`` is the end of an earlier search; ``weighed_as`` weighs under another log s,
    starting from x (k,).
    """
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


def log_normal_probability(z: float) -> float:
    """Logarithm of the standard normal distribution function; far below 0 by its asymptotic series (DLMF 7.12.1)."""
    if z > LEAST_ERFC:
        return math.log(0.5 * math.erfc(-z / math.sqrt(2.0)))
    return -0.5 * z**2 - math.log(-z * math.sqrt(2.0 * math.pi)) + math.log1p(-(z**-2.0) + 3.0 * z**-4.0)


def _profile(
    prior: ShapePrior,
    wheelbase_m: float,
    start: Waypoint,
    weighed_as: Callable[[float, F64], Node],
    evidence: float,
) -> tuple[F64, list[Node]]:
    """The nodes in order and their results, from the start outwards until a shape is improbable."""
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
    """The predicted end of the next search: on a parabola through the last waypoint, along its slope, and through an
    earlier one at a sufficient distance.
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
    """Minus the log probability of a shape whose cost exceeds the best one's by ``excess``."""
    return 0.5 * (EVIDENCE_DOF + 1.0) * float(np.log1p(2.0 * SHAPE_EVIDENCE * evidence * excess / EVIDENCE_DOF))


def _points(x: F64, weight: F64) -> tuple[float, float, float]:
    """The 2.5, 50 and 97.5 % points of a weighted sample."""
    order = np.argsort(x)
    cumulated = np.cumsum(weight[order]) - 0.5 * weight[order]
    low, middle, high = np.interp(POINTS, cumulated, x[order])
    return float(low), float(middle), float(high)
