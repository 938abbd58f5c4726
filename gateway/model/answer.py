"""What a batch's peaks say of its load: the answer, with its error by source.

    posterior_of(mixture, model, unseen, gain_std) -> Posterior

A parameter that is off moves the answer with it, so the error has the sources of the parameters' errors.
"""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from gateway.core.cargo import HABIT_PART
from gateway.estimates.posterior import NORMAL_TAILS, Posterior, Source
from gateway.estimates.quantity import Z95
from gateway.model.fit import NOTHING
from gateway.model.hypotheses import DAY
from gateway.model.mixture import BatchLikelihood, Mixture
from gateway.model.place import spectra_of_sides
from gateway.model.table import INDEX, N
from gateway.model.vehicle_model import VehicleModel
from gateway.records import F64

LEAN_AT: Final = Z95  # standard deviations from a peak at which it is seen how it leans: where the interval ends
MOST_LEAN: Final = 1.5
"""Chosen: largest factor of an interval's end by how the peak leans; 1 is the least, for the model's own error leans
nowhere: of 16 simulated vans, two batches were missed by far where a steep side made the interval shorter.
"""
_GYRATION, _GAIN = INDEX["payload_gyration_m2"], INDEX["accelerometer_gain"]


def _root(covariance: F64) -> F64:
    """(k, r) factor of a positive semi-definite (k, k); its columns are independent causes of unit variance."""
    values, vectors = np.linalg.eigh(covariance)
    kept = values > 1e-12 * max(values.max(), 0.0)
    return np.asarray(vectors[:, kept] * np.sqrt(values[kept]))


_ROOT_OF_DAY: Final = _root(DAY)


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
    return Posterior(mean, own * np.outer(spread, spread), sources, tails, _leans_of(mixture))


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


def _leans_of(mixture: Mixture) -> tuple[float, float]:
    """How many times wider than a normal distribution the likeliest peak is towards lighter, and towards heavier loads.

    From the log posterior at a payload on either side, the other parameters as they are most probable there, by one
    Newton step from where the peak's covariance puts them. A load can be much longer than it is thought to be, but
    hardly shorter, and the springs of a vehicle that few known loads have taught can be harder.
    """
    best = mixture.best
    own = BatchLikelihood(mixture.whittle, mixture.point.theta[N:], mixture.point.cg_left_m, np.inf)
    prior = best.hypothesis.prior

    def cost(x: F64) -> float:
        return own.cost(NOTHING.mean, x) + prior.cost(x)

    others = np.delete(np.arange(N + 2), N)
    along = best.covariance[:, N] / math.sqrt(float(best.covariance[N, N]))
    top = cost(best.x)

    def lean(x: F64) -> float:
        gradient, information = own.curvature(NOTHING.mean, x)
        pull = (gradient + prior.pull(x))[others]
        gain = 0.5 * float(pull @ np.linalg.solve((information + prior.precision)[np.ix_(others, others)], pull))
        drop = max(cost(x) - gain - top, 1e-9)
        return float(np.clip(LEAN_AT / math.sqrt(2.0 * drop), 1.0, MOST_LEAN))

    return lean(best.x - LEAN_AT * along), lean(best.x + LEAN_AT * along)


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
    own = BatchLikelihood(mixture.whittle, mixture.point.theta[N:], 0.0, np.inf)

    def answer(parts: F64) -> F64:
        shown = own.whittle.showing(own.whittle.spectra.showing(parts))
        gradient, _ = replace(own, whittle=shown).curvature(np.empty(0), mixture.best.x)
        return np.asarray(-outward @ mixture.best.covariance @ gradient)

    left, right, middle = (answer(parts) for parts in sides)
    return np.array([0.5 * (left - right), 0.5 * (left + right) - middle])
