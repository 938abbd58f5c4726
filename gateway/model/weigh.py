"""The load of one batch: the maximum of the posterior under each hypothesis, and their mixture by source of error.

    by_cross_spectrum(batch, model, shapes, blank) -> Estimate

Both sensors are on one vehicle on one road, so the ratio of their signals at each frequency and speed does not depend
on the road. Every parameter is free within what calibration left open and within what differs from day to day, from
load to load and from batch to batch (the table); payload and front share have no prior. What is more than one Gaussian
is a hypothesis: a compact load or one that is spread out, firm or soft on its mount, sound or worn dampers. Distinct
peaks are a mixture. docs/method.md has the derivation.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway.core.cargo import HABIT_PART, ShapeHypothesis
from gateway.core.vehicle import Load
from gateway.estimates.batch_estimate import Estimate
from gateway.estimates.posterior import NORMAL_TAILS, PAYLOAD, Posterior, Source
from gateway.model import fit
from gateway.model.checks import VEHICLE_ROWS, Signs, disbelieved, fits, reach_of, unseen_of, why_not
from gateway.model.expected import with_strokes
from gateway.model.place import ROLL_BAND_HZ, Place, place_of, roll_share_of, search_of_place, spectra_of_sides
from gateway.model.sensors import GAIN_STD, NOISE_RATIOS, Noise, gain_of, is_changed, noise_of, watched
from gateway.model.spectra import CrossSpectra, cross_spectra_of, level
from gateway.model.table import INDEX, UPRIGHT, N, covariance_of
from gateway.model.vehicle_model import VehicleModel
from gateway.model.whittle import Point, Whittle
from gateway.records import F64, Batch, Why

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
SOFT_HZ: Final = 10.5  # chosen: middle of the resonances of loads on soft mounts
SOFT_COST: Final = 3.0  # chosen: minus the logarithm of the share of loads on soft mounts
WORN_STD: Final = 0.3  # chosen: of the logarithm of each axle's dampers, if they may have worn or been replaced
WORN_COST: Final = 3.0
"""Minus the logarithm of the share of batches with worn dampers. Chosen on four simulated vans that serve nothing else:
with 4, of 24 batches on worn dampers five were ambiguous and the payloads of the others 6.4 % off; with 3 two, and
3.1 %.
"""
LEAST_WEAR: Final = 2.0  # chosen: standard deviations of a damper from which worn ones are tried
START_PAYLOADS_N: Final = 6  # chosen: from 0 to the largest load seen, or a third of the empty mass
LEAST_START_SHARE: Final = 0.33  # chosen: of the empty mass
START_PLACES: Final = (0.25, 0.5, 0.9)  # chosen: of the wheelbase
APART_SHARE: Final = 0.15  # chosen: of the largest starting load; starts nearer to a peak lead to it
COARSE: Final = 0.2  # chosen: tolerance in log posterior, enough to compare peaks
FINE: Final = 1e-2  # chosen: tolerance of the final search
HOPELESS: Final = 12.0  # chosen: a peak that is less probable by so many logarithms is not climbed to its end
SAME_PEAK: Final = 0.3  # chosen: of a standard deviation; peaks of one hypothesis nearer than that are one
MOST_LOAD_SHARE: Final = 4.0  # chosen: of the empty mass; bound of the search
MOST_LAG_LEFT_S: Final = 0.002  # beyond it, roll is taken out again, at the lag that was found
MOST_LAGS: Final = 4  # tried; a lag that still moves has no fixed point
HELD_STD: Final = 1e-3  # chosen: of the noise without a roll rate: roll leaks into the sensors and looks like noise

_GYRATION, _MODE, _LAG, _GAIN = (
    INDEX[name] for name in ("payload_gyration_m2", "payload_mode_hz", "gyro_lag_s", "accelerometer_gain")
)
_DAMPERS: Final = [INDEX["damper_front_nspm"], INDEX["damper_rear_nspm"]]
_NOISES: Final = [INDEX["noise_acceleration_m2ps3"], INDEX["noise_pitch_rate_rad2ps"]]


def _root(covariance: F64) -> F64:
    """(k, r) factor of a positive semi-definite (k, k); its columns are independent causes of unit variance."""
    values, vectors = np.linalg.eigh(covariance)
    kept = values > 1e-12 * max(values.max(), 0.0)
    return np.asarray(vectors[:, kept] * np.sqrt(values[kept]))


def _of_column(*columns: str) -> F64:
    covariance = covariance_of(UPRIGHT, *columns)
    covariance[_GAIN] = covariance[:, _GAIN] = 0.0  # the sensor's: each batch has its own
    return covariance


DAY, LOAD, BATCH = (_of_column(name) for name in ("day", "load", "batch"))
_ROOT_OF_DAY: Final = _root(DAY)


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """A prior of the parameters: mean (N,) and covariance (N, N), of which of_load (N, N) is the load's part.

    cost is minus the logarithm of its probability. shape names what it says of the load.
    """

    name: str
    mean: F64
    covariance: F64
    of_load: F64
    cost: float = 0.0
    is_soft: bool = False
    is_worn: bool = False

    @property
    def prior(self) -> fit.Gaussian:
        """The prior of parameters, payload and front share; flat in the load."""
        precision = np.zeros((N + 2, N + 2))
        precision[:N, :N] = np.linalg.inv(self.covariance)
        return fit.Gaussian(np.r_[self.mean, 0.0, 0.0], precision)

    def soft(self) -> "Hypothesis":
        """The load as if it stood on a soft mount."""
        mean = self.mean.copy()
        mean[_MODE] = math.log(SOFT_HZ)
        return replace(self, name=f"{self.name}, soft", mean=mean, cost=self.cost + SOFT_COST, is_soft=True)

    def worn(self) -> "Hypothesis":
        """The load as if the dampers had worn or been replaced."""
        covariance = self.covariance.copy()
        covariance[_DAMPERS, _DAMPERS] += WORN_STD**2
        return replace(self, name=f"{self.name}, worn", covariance=covariance, cost=self.cost + WORN_COST, is_worn=True)


def hypotheses_of(
    model: VehicleModel, shapes: Sequence[ShapeHypothesis], gain: tuple[float, float], *, with_roll: bool
) -> list[Hypothesis]:
    """One for each shape of the load, firm and sound.

    ``gain`` is the logarithm of the accelerometer's gain and its standard deviation. ``with_roll``: each batch
    determines its sensors' noise.
    """
    of_batch = BATCH.copy()
    if not with_roll:
        of_batch[_NOISES, _NOISES] = HELD_STD**2
    found = []
    for shape in shapes:
        mean, of_load = model.parameters[:N].copy(), LOAD.copy()
        known = model.covariance[:N, :N].copy()
        known[_GYRATION] = known[:, _GYRATION] = 0.0
        mean[_GYRATION], of_load[_GYRATION, _GYRATION] = shape.log_s, shape.std**2
        of_batch[_GAIN, _GAIN], mean[_GAIN] = gain[1] ** 2, gain[0]
        covariance = known + DAY + of_load + of_batch
        found.append(Hypothesis(shape.name, mean, covariance, of_load, -math.log(shape.probability)))
    return found


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
class _Own:
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
    own = _Own(Whittle(spectra.without_roll, model.ground, weight), roll, 0.0, most_kg)
    likeliest, *rivals = _coarse(own, first, model)
    rolling = sideways = None
    if with_roll:
        roll = level(model.parameters)[N:]
        moving = with_strokes(spectra, np.r_[model.parameters[:N], roll], likeliest.load, model.ground)
        rolling = Whittle(moving.within(ROLL_BAND_HZ), model.ground)
        sideways = search_of_place(rolling, Point.of(np.r_[likeliest.x[:N], roll], likeliest.load)).own[0]
        own = _Own(Whittle(moving.without_roll, model.ground, weight), roll, float(sideways[-1]), most_kg)
    best = _climb(own, likeliest.hypothesis, likeliest.x, FINE)
    peaks = [best, *(one.moved_as(likeliest, best) for one in rivals)]
    for other in others:
        hypothesis = other.soft() if best.hypothesis.is_soft else other
        start = best.x.copy()
        start[_GYRATION] = 0.5 * (start[_GYRATION] + other.mean[_GYRATION])
        peaks.append(_climb(own, hypothesis, start, FINE, peaks))
    if np.max(np.abs(best.deviations[_DAMPERS])) > LEAST_WEAR:
        peaks.append(_climb(own, best.hypothesis.worn(), best.x, FINE))
    distinct = _distinct(peaks)
    costs = np.array([one.hypothesis.cost for one in distinct])
    evidence = np.array([one.log_evidence for one in distinct]) + costs
    weights = np.exp(-costs - _against(evidence.max() - evidence))
    order = np.argsort(-weights, kind="stable").tolist()
    distinct, weights = [distinct[i] for i in order], weights[order] / weights.sum()
    point = own.point(distinct[0].x)
    placed = None if rolling is None else place_of(rolling, point, search_of_place(rolling, point, sideways))
    return Mixture(tuple(distinct), weights, own.whittle, point, placed)


def _coarse(own: _Own, first: Hypothesis, model: VehicleModel) -> list[Peak]:
    """Distinct peaks, the likeliest first: on a soft and on a firm mount from the best of a few starting loads, and on
    the likelier of them from a load far from both.

    The soft mount is first: a search on a firm one follows a long valley if the load stands on a soft one.
    """
    loads = np.array(_starting_loads(model))
    apart_kg = APART_SHARE * float(loads[:, 0].max())
    found: list[Peak] = []
    order: dict[str, list[int]] = {}
    for hypothesis in (first.soft(), first):
        costs = own.whittle.costs([own.point(np.r_[hypothesis.mean, load]) for load in loads])
        order[hypothesis.name] = np.argsort(costs, kind="stable").tolist()
        start = np.r_[hypothesis.mean, loads[order[hypothesis.name][0]]]
        found.append(_climb(own, hypothesis, start, COARSE, found))
    best = max(found, key=lambda one: one.log_evidence)
    ordered = order[best.hypothesis.name]
    near_kg = np.array([loads[ordered[0], 0], best.x[N]])
    far = next((i for i in ordered if np.min(np.abs(loads[i, 0] - near_kg)) > apart_kg), None)
    if far is not None:
        found.append(_climb(own, best.hypothesis, np.r_[best.hypothesis.mean, loads[far]], COARSE, found))
    return _distinct(found)


def _climb(own: _Own, hypothesis: Hypothesis, start: F64, tolerance: float, rivals: Sequence[Peak] = ()) -> Peak:
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
    """Minus the log probability of each peak, whose evidence lies ``excess`` (k,) below that of the best."""
    found: F64 = 0.5 * (EVIDENCE_DOF + 1.0) * np.log1p(2.0 * excess / EVIDENCE_DOF)
    return found


def _starting_loads(model: VehicleModel) -> list[tuple[float, float]]:
    """(payload in kg, front share 0..1) for a few loads at a few places."""
    empty_kg, share = model.empty_mass_kg, model.ground.empty_front_share
    loads = []
    most_kg = max(model.payload_seen_kg[1], LEAST_START_SHARE * empty_kg)
    for payload_kg in np.linspace(0.0, most_kg, START_PAYLOADS_N).tolist():
        for place in START_PLACES if payload_kg else (0.5,):
            front_kg = share * empty_kg + (1.0 - place) * payload_kg
            loads.append((payload_kg, front_kg / (empty_kg + payload_kg)))
    return loads


def _outward(mixture: Mixture) -> F64:
    """Derivatives (d, N + 2) of payload (kg), front share (%) and lateral place (m) by parameters and load at the
    peak.
    """
    place = mixture.place
    outward = np.zeros((2 if place is None else 3, N + 2))
    outward[0, N], outward[1, N + 1] = 1.0, 100.0
    if place is not None:
        outward[2, :N], outward[2, N:] = place.moves[:N], place.moves_with_load
    return outward


def answers_by_vehicle(mixture: Mixture, model: VehicleModel) -> F64:
    """(d, n) derivative of the answer by each of the vehicle's parameters, all others of the batch following."""
    best, outward = mixture.best, _outward(mixture)
    answers = outward @ best.covariance[:, :N] @ np.linalg.inv(best.hypothesis.covariance)
    answers[:, _GYRATION] = 0.0
    of_roll = np.zeros((len(outward), len(model.parameters) - N))
    if mixture.place is not None:
        of_roll[2] = mixture.place.moves[N:]
    return np.concatenate([answers, of_roll], axis=1)


def posterior_of(mixture: Mixture, model: VehicleModel, unseen: float, gain_std: float) -> Posterior:
    """The load in kg and percent, with the lateral place if roll shows it, and its error by source.

    A parameter that is off its prior's mean by e moves the answer by K e, K = C P^-1, with C the covariance of the
    answer with the parameters and P that of the prior: the columns of a source are K times the columns of its part of
    P. What is left of the answer's covariance is the batch's own: by the weight of its evidence a part of it is chance,
    and the rest the model's error that a batch repeats, which grows away from what taught the vehicle.
    """
    best, place = mixture.best, mixture.place
    outward = _outward(mixture)
    by_vehicle = answers_by_vehicle(mixture, model)
    of_roll = by_vehicle[:, N:]
    answers = outward @ best.covariance[:, :N] @ np.linalg.inv(best.hypothesis.covariance)
    size = len(outward)
    calibrated = (by_vehicle @ model.directions).T
    of_calibration = by_vehicle @ model.covariance @ by_vehicle.T
    of_day = (answers @ _ROOT_OF_DAY).T
    of_load = (answers @ _root(best.hypothesis.of_load)).T
    of_gain = gain_std * answers[:, _GAIN][None]
    own = outward @ best.covariance @ outward.T
    own = (
        own
        - sum(one.T @ one for one in (of_day, of_load, of_gain))
        - of_calibration
        + of_roll @ (model.covariance[N:, N:] @ of_roll.T)
    )
    if place is not None:
        own[2, 2] += place.own_variance
    of_statistics = mixture.whittle.weight
    own = _definite(own) * (of_statistics + (1.0 - of_statistics) * unseen**2)
    shape, mean, tails = _shape_of(mixture, outward, of_load)
    spread = np.array(model.spread[:size])
    of_model = np.diag(np.array(model.model_std[:size]) * unseen)
    left_over = _root(of_calibration - calibrated.T @ calibrated).T
    sources = {
        Source.CALIBRATION: calibrated * spread,
        Source.DAY: of_day * spread,
        Source.GOODS: shape[:1] * spread * math.sqrt(HABIT_PART),
        Source.LOAD_LENGTH: np.concatenate([shape[:1] * math.sqrt(1.0 - HABIT_PART), shape[1:]]) * spread,
        Source.SENSOR: of_gain,
        Source.MODEL: np.vstack([of_model, left_over * spread]),
    }
    if place is None:
        sources[Source.SIDEWAYS] = _of_sides(mixture, model, outward) * spread
    return Posterior(mean, own * np.outer(spread, spread), sources, tails)


def _definite(own: F64) -> F64:
    """The covariance with eigenvalues that are negative by rounding raised to a trace of the largest."""
    values, vectors = np.linalg.eigh(0.5 * (own + own.T))
    return np.asarray(vectors * np.maximum(values, 1e-9 * max(values.max(), 1e-12)) @ vectors.T)


def _shape_of(mixture: Mixture, outward: F64, of_load: F64) -> tuple[F64, F64, tuple[float, float]]:
    """Columns (k, d) of the error by shape and mount of the load, the median answer (d,), and the tails of that error.

    The first column holds the distance of the peaks; the tails are the 2.5 and 97.5 % points of peaks and columns
    together, in their standard deviation (posterior.Posterior).
    """
    best, weights = mixture.best, mixture.weights
    answer = outward @ np.r_[np.zeros(N), best.x[N:]]
    if mixture.place is not None:
        answer[2] = mixture.place.cg_left_m
    away = np.array([outward[:, N:] @ (one.x[N:] - best.x[N:]) for one in mixture.peaks])
    mean = weights @ away
    off = away - mean
    variance = float(weights @ off[:, 0] ** 2)
    column = weights @ (off * off[:, :1]) / math.sqrt(variance) if variance > 0.0 else np.zeros(len(mean))
    shape = np.concatenate([column[None], of_load])
    std = math.sqrt(float(np.sum(shape[:, 0] ** 2)))
    if not variance > 1e-12 * max(std, 1e-9) ** 2:
        return shape, answer + mean, NORMAL_TAILS
    within = max(math.sqrt(float(np.sum(of_load[:, 0] ** 2))), 1e-3 * std)
    low, middle, high = _quantiles(off[:, 0], weights, within)
    return shape, answer + mean + middle * column / math.sqrt(variance), ((middle - low) / std, (high - middle) / std)


def _quantiles(middles: F64, weights: F64, std: float) -> tuple[float, float, float]:
    """The 2.5, 50 and 97.5 % points of a mixture of normal distributions of one standard deviation."""
    at = np.sort((middles[:, None] + std * np.linspace(-5.0, 5.0, 201)).ravel())
    z = np.clip((at - middles[:, None]) / std, -8.0, 8.0)
    cumulated = weights @ (1.0 / (1.0 + np.exp(-z * (1.5976 + 0.070566 * z**2))))  # within 2e-4 (E. Page, 1977)
    low, middle, high = np.interp((0.025, 0.5, 0.975), cumulated, at)
    return float(low), float(middle), float(high)


def _of_sides(mixture: Mixture, model: VehicleModel, outward: F64) -> F64:
    """(k, d) change of the answer with the unknown lateral place of the load, one standard deviation of it.

    By one Newton step from the answer: the slope of the likelihood towards spectra of a load on either side. By
    symmetry it is zero for a sensor on the centre line.
    """
    sides = spectra_of_sides(mixture.whittle, mixture.point, model)
    if not sides:
        return np.zeros((1, len(outward)))
    own = _Own(mixture.whittle, mixture.point.theta[N:], 0.0, np.inf)

    def answer(parts: F64) -> F64:
        shown = own.whittle.showing(own.whittle.spectra.showing(parts))
        gradient, _ = replace(own, whittle=shown).curvature(np.empty(0), mixture.best.x)
        return np.asarray(-outward @ mixture.best.covariance @ gradient)

    left, right, middle = (answer(parts) for parts in sides)
    return np.array([0.5 * (left - right), 0.5 * (left + right) - middle])


@dataclass(frozen=True, slots=True, eq=False)
class Weighed:
    """The result of a batch's spectra: the peaks, what they show of themselves, and the answer."""

    spectra: CrossSpectra
    mixture: Mixture
    signs: Signs
    noise: Noise
    posterior: Posterior


_BY_NOISE: Final = (
    Why.SENSOR_DISAGREEMENT,
    Why.SENSOR_CHANGED,
    Why.WRONG_SIGN,
    Why.MODEL_MISFIT,
    Why.TOO_UNCERTAIN,
    Why.AMBIGUOUS,
    Why.NO_SOLUTION,
)
"""Reasons that a noisy sensor can cause."""


def by_cross_spectrum(
    batch: Batch, model: VehicleModel, shapes: Sequence[ShapeHypothesis], blank: Estimate
) -> Estimate:
    """``blank`` with payload, front share and diagnostics of the batch, or with the reason for a refusal."""
    of_sensors = watched(batch, model)
    found = weigh(batch, model, shapes)
    if isinstance(found, Why):
        return replace(blank, diagnostics=of_sensors, rejected=(found,))
    diagnosed = replace(blank, diagnostics={**_diagnostics(found, model), **of_sensors})
    why = disbelieved(found.signs)
    if why is not None:
        return replace(diagnosed, rejected=(Why.SENSOR_NOISY if found.noise.is_there and why in _BY_NOISE else why,))
    answer = diagnosed.answered(found.posterior)
    if found.mixture.place is None:
        return answer
    share = roll_share_of(found.mixture.point, model)
    return replace(answer, roll_share_front=share.number, roll_share_front_std=share.std)


def weigh(batch: Batch, model: VehicleModel, shapes: Sequence[ShapeHypothesis]) -> Weighed | Why:
    """The load of a batch, however badly it fits, or why it cannot be compared with the model."""
    spectra = cross_spectra_of([batch], model.reading)
    why = why_not(batch, spectra, model) or (Why.SENSOR_CHANGED if is_changed(batch, model) else None)
    if spectra is None or why in (Why.NOT_ENOUGH_EXCITATION, Why.SENSOR_CHANGED):
        return why or Why.TOO_SHORT
    noise = noise_of(batch, spectra, model)
    if why is not None:
        return Why.SENSOR_NOISY if noise.is_there else why
    gain = gain_of(batch.gravity_mps2, model.gravity_mps2)
    taken_out_s = float(model.parameters[_LAG])
    for _ in range(MOST_LAGS):
        spectra = replace(spectra, noise=noise.on(spectra))
        mixture = mixture_of(spectra, model, shapes, gain)
        lag_s = float(mixture.best.x[_LAG])
        is_settled = mixture.place is None or abs(lag_s - taken_out_s) <= MOST_LAG_LEFT_S
        if is_settled:
            break
        again = cross_spectra_of([batch], model.reading.with_gyro_late_by(lag_s))
        spectra, taken_out_s = spectra if again is None else again, lag_s
    reach = reach_of(mixture.best.load, model)
    unseen = unseen_of(batch.mean_speed_mps, spectra.acceleration_rms_mps2, reach, model)
    posterior = posterior_of(mixture, model, unseen, gain[1])
    signs = _signs_of(mixture, model, unseen, reach, noise, posterior, is_settled=is_settled)
    return Weighed(spectra, mixture, signs, noise, posterior)


def _signs_of(
    mixture: Mixture,
    model: VehicleModel,
    unseen: float,
    reach: float,
    noise: Noise,
    posterior: Posterior,
    *,
    is_settled: bool,
) -> Signs:
    best, whittle, point = mixture.best, mixture.whittle, mixture.point
    misfit = followed = whittle.misfit(point)
    followed_by = best
    if not fits(misfit, model, unseen):
        followed_by, followed = _following(mixture, model)
    off = best.x[:N] - best.hypothesis.mean
    of_vehicle = off[VEHICLE_ROWS]
    prior = best.hypothesis.covariance[np.ix_(VEHICLE_ROWS, VEHICLE_ROWS)]
    between = float(mixture.weights @ np.array([one.x[N] - best.x[N] for one in mixture.peaks]) ** 2)
    return Signs(
        model=model,
        misfit=misfit,
        followed=followed,
        unseen=unseen,
        reach=reach,
        is_reversed=_is_reversed(mixture, model, misfit),
        off=followed_by.x[:N] - model.parameters[:N],
        deviations=followed_by.deviations,
        tension=float(of_vehicle @ np.linalg.solve(prior, of_vehicle)),
        loudness=noise.loudness,
        is_mount_changed=mixture.place is not None and mixture.place.is_mount_changed,
        is_settled=is_settled and mixture.is_converged,
        payload_std_kg=posterior.std(PAYLOAD),
        rivalry=between / max(posterior.std(PAYLOAD) ** 2 - between, 1e-9),
    )


def _following(mixture: Mixture, model: VehicleModel) -> tuple[Peak, float]:
    """The likeliest peak if all of the batch's evidence counts, and its misfit: what may explain that it does not
    fit.
    """
    whittle = Whittle(mixture.whittle.spectra, mixture.whittle.ground)
    own = _own_by(whittle, mixture, model)
    peak = _climb(own, mixture.best.hypothesis, mixture.best.x, COARSE)
    return peak, whittle.misfit(own.point(peak.x))


def _own_by(whittle: Whittle, mixture: Mixture, model: VehicleModel) -> _Own:
    """Another likelihood of the batch, with roll and the lateral place as the mixture has them."""
    return _Own(whittle, mixture.point.theta[N:], mixture.point.cg_left_m, MOST_LOAD_SHARE * model.empty_mass_kg)


def _is_reversed(mixture: Mixture, model: VehicleModel, misfit: float) -> bool:
    """True if the pitch rate fits better with the other sign: at this load or, if this fits badly, at any start; or if
    the search from there ends where the model fits.

    Spectra with the wrong sign may lead the search to a load where neither sign fits.
    """
    whittle, point = mixture.whittle, mixture.point
    reverse = whittle.showing(whittle.spectra.with_pitch_reversed())
    least = reverse.cost(point)
    if not misfit <= model.misfit_limit:
        own = _own_by(reverse, mixture, model)
        starts = [np.r_[mixture.best.hypothesis.mean, load] for load in _starting_loads(model)]
        costs = reverse.costs([own.point(one) for one in starts])
        peak = _climb(own, mixture.best.hypothesis, starts[int(np.argmin(costs))], COARSE)
        least = min(least, float(costs.min()))
        if reverse.misfit(own.point(peak.x)) <= model.misfit_limit:
            return True
    return least < whittle.cost(point)


def _diagnostics(found: Weighed, model: VehicleModel) -> dict[str, float]:
    spectra, signs, best = found.spectra, found.signs, found.mixture.best

    def of(name: str) -> float:
        return float(best.x[INDEX[name]])

    return {
        "reach": signs.reach,
        "misfit": signs.misfit,
        "n_segments": float(spectra.n_total),
        "amplitude_ratio": math.exp(spectra.log_amplitude_mean),
        "damper_front_ratio": math.exp(signs.changed("damper_front_nspm")),
        "damper_rear_ratio": math.exp(signs.changed("damper_rear_nspm")),
        "delay_scale": of("delay_scale"),
        "tension": signs.tension,
        "sensor_position_deviation": signs.deviation("sensor_position_m"),
        "sensor_noise_deviation": signs.deviation("noise_acceleration_m2ps3"),
        **dict(zip(NOISE_RATIOS, found.noise.loudness.tolist(), strict=False)),
        "payload_gyration_m2": math.exp(of("payload_gyration_m2")),
        "payload_mode_hz": math.exp(of("payload_mode_hz")),
        "payload_damping_ratio": math.exp(of("payload_damping_ratio")),
        "delay_s": spectra.delay_mean_s,
        "delay_std_s": spectra.delay_std_s,
    }
