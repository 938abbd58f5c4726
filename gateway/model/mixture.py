"""The posterior of the load behind a batch's spectra: its distinct peaks, with their weights.

    mixture_of(spectra, model, shapes) -> Mixture

Payload and front share have no prior; every parameter is free within its hypothesis (gateway.model.hypotheses). The
search is coarse from a few starting loads, then fine from the likeliest of the peaks.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway.core.cargo import ShapeHypothesis
from gateway.core.vehicle import Load
from gateway.model import fit
from gateway.model.checks import VEHICLE_ROWS
from gateway.model.expected import with_strokes
from gateway.model.hypotheses import DAMPERS, Hypothesis, hypotheses_of
from gateway.model.place import ROLL_BAND_HZ, Place, place_of, search_of_place
from gateway.model.sensors import GAIN_STD
from gateway.model.spectra import CrossSpectra, level
from gateway.model.table import INDEX, N
from gateway.model.vehicle_model import VehicleModel
from gateway.model.whittle import Point, Whittle
from gateway.records import F64

EVIDENCE: Final = 0.3
"""Weight of a batch's evidence against the vehicle's prior, 1 being its statistical weight: a batch repeats one error
of the model. Chosen on simulated vans that serve no other purpose.
"""
EVIDENCE_WITHOUT_ROLL: Final = 0.2  # chosen: the same for a sensor that reads roll as heave; as in calibration
EVIDENCE_DOF: Final = 4.0
"""Chosen: degrees of freedom of the tail of a batch's evidence between hypotheses. A batch is one sample of the
half-car's error, so that what it contradicts stays possible (K. L. Lange, R. J. A. Little and J. M. G. Taylor, J. Am.
Stat. Assoc. 84 (1989) 881-896).
"""
LEAST_WEAR: Final = 2.0  # chosen: standard deviations of a damper from which worn ones are tried
START_PAYLOADS_N: Final = 6  # chosen: from 0 to the largest load seen, or a third of the empty mass
LEAST_START_SHARE: Final = 0.33  # chosen: of the empty mass
START_PLACES: Final = (0.25, 0.5, 0.9)  # chosen: of the wheelbase
DOUBTFUL: Final = (
    20.0  # chosen: tension of a peak, which one healthy batch in twenty exceeds, from which every start is tried
)
HEAVIER: Final = 1.3
"""Chosen: times the payload of the first shape, from where the others are searched a second time: spread-out loads
often have two peaks, and one alone was stated far too narrowly.
"""
APART_SHARE: Final = 0.15  # chosen: of the largest starting load; starts nearer to a peak lead to it
COARSE: Final = 0.2  # chosen: tolerance in log posterior, enough to compare peaks
FINE: Final = 1e-2  # chosen: tolerance of the final search
HOPELESS: Final = 12.0  # chosen: a peak that is less probable by so many logarithms is not climbed to its end
SAME_PEAK: Final = 0.3  # chosen: of a standard deviation; peaks of one hypothesis nearer than that are one
MOST_LOAD_SHARE: Final = 4.0  # chosen: of the empty mass; bound of the search

_GYRATION: Final = INDEX["payload_gyration_m2"]


@dataclass(frozen=True, slots=True, eq=False)
class Peak:
    """A maximum: parameters, payload (kg) and front share (0..1) x (N + 2,), their covariance, and how probable it
    is.
    """

    hypothesis: Hypothesis
    x: F64
    covariance: F64
    log_evidence: float
    is_converged: bool

    @property
    def load(self) -> Load:
        """The load there."""
        return Load(float(self.x[N]), 100.0 * float(self.x[N + 1]))

    @property
    def tension(self) -> float:
        """Chi-squared of the vehicle's parameters about their prior."""
        off = (self.x[:N] - self.hypothesis.mean)[VEHICLE_ROWS]
        return float(off @ np.linalg.solve(self.hypothesis.covariance[np.ix_(VEHICLE_ROWS, VEHICLE_ROWS)], off))

    def moved_as(self, other: "Peak", moved: "Peak") -> "Peak":
        """This peak, as far from ``moved``, in place and evidence, as it is from ``other``."""
        log_evidence = self.log_evidence + moved.log_evidence - other.log_evidence
        return replace(self, x=self.x + moved.x - other.x, log_evidence=log_evidence)

    @property
    def deviations(self) -> F64:
        """(N,) of the parameters from the hypothesis, in the standard deviations that they have if it is true."""
        variance = np.diag(self.hypothesis.covariance) - np.diag(self.covariance)[:N]
        found: F64 = (self.x[:N] - self.hypothesis.mean) / np.sqrt(np.maximum(variance, 1e-12))
        return found


@dataclass(frozen=True, slots=True, eq=False)
class Mixture:
    """The distinct peaks with their weights, the likeliest first, and where roll places the likeliest load."""

    peaks: tuple[Peak, ...]
    weights: F64
    whittle: Whittle
    point: Point
    place: Place | None

    @property
    def best(self) -> Peak:
        """The likeliest peak."""
        return self.peaks[0]

    @property
    def is_converged(self) -> bool:
        """Whether the searches behind the answer converged."""
        return self.best.is_converged and (self.place is None or self.place.is_converged)


@dataclass(frozen=True, slots=True, eq=False)
class BatchLikelihood:
    """The likelihood of a batch, as a function of parameters, payload and front share."""

    whittle: Whittle
    roll: F64
    cg_left_m: float
    most_kg: float

    def point(self, own: F64) -> Point:
        return Point(np.r_[own[:N], self.roll], float(own[N]), float(own[N + 1]), self.cg_left_m)

    def cost(self, common: F64, own: F64) -> float:
        return self.whittle.cost(self.point(own)) if abs(own[N]) <= self.most_kg else np.inf

    def curvature(self, common: F64, own: F64) -> tuple[F64, F64]:
        point = self.point(own)
        n = len(point.theta)
        found = self.whittle.curvature(point, [*range(N), n, n + 1])
        return found.gradient, found.information


def mixture_of(
    spectra: CrossSpectra,
    model: VehicleModel,
    shapes: Sequence[ShapeHypothesis],
    gain: tuple[float, float] = (0.0, GAIN_STD),
) -> Mixture:
    """The posterior of the load behind ``spectra``, as its distinct peaks.

    Each axle's movement depends on the load, and so does its place sideways: both are computed at the best of the
    coarse peaks, from which the search continues; the others keep their distance from it. A sensor whose roll rate is
    lost still reads roll: it is where calibration found it, and the load on the centre line.
    """
    with_roll = spectra.has_roll and model.has_roll
    weight = EVIDENCE if with_roll else EVIDENCE_WITHOUT_ROLL
    first, *others = hypotheses_of(model, shapes, gain, with_roll=with_roll)
    most_kg = MOST_LOAD_SHARE * model.empty_mass_kg
    roll = np.empty(0) if with_roll else model.parameters[N:]
    own = BatchLikelihood(Whittle(spectra.without_roll, model.ground, weight), roll, 0.0, most_kg)
    likeliest, *rivals = _coarse(own, first, model)
    rolling = sideways = None
    if with_roll:
        roll = level(model.parameters)[N:]
        moving = with_strokes(spectra, np.r_[model.parameters[:N], roll], likeliest.load, model.ground)
        rolling = Whittle(moving.within(ROLL_BAND_HZ), model.ground)
        sideways = search_of_place(rolling, Point.of(np.r_[likeliest.x[:N], roll], likeliest.load)).own[0]
        own = BatchLikelihood(Whittle(moving.without_roll, model.ground, weight), roll, float(sideways[-1]), most_kg)
    best = climb(own, likeliest.hypothesis, likeliest.x, FINE)
    peaks = [best, *(one.moved_as(likeliest, best) for one in rivals)]
    for other in others:
        hypothesis = other.soft() if best.hypothesis.is_soft else other
        start = best.x.copy()
        start[_GYRATION] = 0.5 * (start[_GYRATION] + other.mean[_GYRATION])
        peaks.append(climb(own, hypothesis, start, FINE, peaks))
        heavier = np.r_[hypothesis.mean, _of_payload(HEAVIER * best.x[N], best.load, model)]
        away = climb(own, hypothesis, heavier, COARSE, peaks)
        is_best = away.log_evidence > max(one.log_evidence for one in peaks)
        peaks.append(climb(own, hypothesis, away.x, FINE) if is_best else away)
    suspects = (best, *(one for one in rivals if one.tension > DOUBTFUL))
    worn = [one for one in suspects if np.max(np.abs(one.deviations[DAMPERS])) > LEAST_WEAR]
    peaks += [climb(own, one.hypothesis.worn(), one.x, FINE) for one in worn]
    distinct = _distinct(peaks)
    costs = np.array([one.hypothesis.cost for one in distinct])
    evidence = np.array([one.log_evidence for one in distinct]) + costs
    weights = np.exp(-costs - _against(evidence.max() - evidence))
    order = np.argsort(-weights, kind="stable").tolist()
    distinct, weights = [distinct[i] for i in order], weights[order] / weights.sum()
    point = own.point(distinct[0].x)
    placed = None if rolling is None else place_of(rolling, point, search_of_place(rolling, point, sideways))
    return Mixture(tuple(distinct), weights, own.whittle, point, placed)


def _coarse(own: BatchLikelihood, first: Hypothesis, model: VehicleModel) -> list[Peak]:
    """Distinct peaks, the likeliest first: on a soft and on a firm mount from the best of a few starting loads, and on
    the likelier of them from a load far from both; from every other load, on either mount, where only an unlikely
    vehicle fits.

    The soft mount is first: a search on a firm one follows a long valley if the load stands on a soft one.
    """
    loads = np.array(starting_loads(model))
    apart_kg = APART_SHARE * float(loads[:, 0].max())
    found: list[Peak] = []
    order: dict[str, list[int]] = {}
    for hypothesis in (first.soft(), first):
        costs = own.whittle.costs([own.point(np.r_[hypothesis.mean, load]) for load in loads])
        order[hypothesis.name] = np.argsort(costs, kind="stable").tolist()
        start = np.r_[hypothesis.mean, loads[order[hypothesis.name][0]]]
        found.append(climb(own, hypothesis, start, COARSE, found))
    best = max(found, key=lambda one: one.log_evidence)
    for hypothesis in sorted((first.soft(), first), key=lambda one: one.name != best.hypothesis.name):
        ordered = order[hypothesis.name]
        near_kg = [loads[ordered[0], 0], best.x[N]]
        for i in ordered:
            if np.min(np.abs(loads[i, 0] - near_kg)) > apart_kg:
                found.append(climb(own, hypothesis, np.r_[hypothesis.mean, loads[i]], COARSE, found))
                near_kg.append(loads[i, 0])
                if max(found, key=lambda one: one.log_evidence).tension < DOUBTFUL:
                    return _distinct(found)
    return _distinct(found)


def climb(
    own: BatchLikelihood, hypothesis: Hypothesis, start: F64, tolerance: float, rivals: Sequence[Peak] = ()
) -> Peak:
    """The peak reached from ``start``; given up where it must stay far less probable than a rival, or leads to one."""
    prior = hypothesis.prior
    _, log_determinant = np.linalg.slogdet(hypothesis.covariance)
    worth = np.inf
    if rivals:
        rival = max(rivals, key=lambda one: one.log_evidence)
        of_rival = float(np.linalg.slogdet(rival.covariance)[1])
        worth = HOPELESS - rival.log_evidence + 0.5 * of_rival
        worth -= 0.5 * float(log_determinant) + hypothesis.cost
    known = [fit.Gaussian.of(one.x, one.covariance) for one in rivals if one.hypothesis.name == hypothesis.name]
    found = fit.climb(own, prior, start, tolerance, worth, known)
    log_evidence = -found.cost - found.log_volume - 0.5 * float(log_determinant) - hypothesis.cost
    return Peak(hypothesis, found.own[0], found.own_covariances[0], log_evidence, found.is_converged)


def _of_payload(payload_kg: float, load: Load, model: VehicleModel) -> tuple[float, float]:
    """Payload and front share (0..1) of another payload at the place of a load."""
    empty_kg, empty_share = model.empty_mass_kg, model.ground.empty_front_share
    front_kg = 0.01 * load.front_share_pct * (empty_kg + load.payload_kg) - empty_share * empty_kg
    in_front = front_kg / load.payload_kg if load.payload_kg > 0.0 else empty_share
    return payload_kg, _front_share(payload_kg, in_front, model)


def _front_share(payload_kg: float, in_front: float, model: VehicleModel) -> float:
    """The vehicle's front share (0..1) when the part ``in_front`` of its payload rests on the front axle."""
    empty_kg, empty_share = model.empty_mass_kg, model.ground.empty_front_share
    return (empty_share * empty_kg + in_front * payload_kg) / (empty_kg + payload_kg)


def _distinct(peaks: Sequence[Peak]) -> list[Peak]:
    """The peaks, the likeliest first, without those that another search of the same hypothesis has found."""
    found: list[Peak] = []
    for one in sorted(peaks, key=lambda peak: -peak.log_evidence):
        same = (
            other.hypothesis.name == one.hypothesis.name
            and abs(other.x[N] - one.x[N]) < SAME_PEAK * math.sqrt(other.covariance[N, N])
            for other in found
        )
        if not any(same) and (not found or one.log_evidence > found[0].log_evidence - HOPELESS):
            found.append(one)
    return found


def _against(excess: F64) -> F64:
    """Minus the log probability of each peak (k,), from how far its evidence lies below that of the best."""
    found: F64 = 0.5 * (EVIDENCE_DOF + 1.0) * np.log1p(2.0 * excess / EVIDENCE_DOF)
    return found


def starting_loads(model: VehicleModel) -> list[tuple[float, float]]:
    """(payload in kg, front share 0..1) for a few loads at a few places."""
    most_kg = max(model.payload_seen_kg[1], LEAST_START_SHARE * model.empty_mass_kg)
    return [
        (payload_kg, _front_share(payload_kg, 1.0 - place, model))
        for payload_kg in np.linspace(0.0, most_kg, START_PAYLOADS_N).tolist()
        for place in (START_PLACES if payload_kg else (0.5,))
    ]
