"""The most probable vehicle: its half-car, and with a roll rate its roll parameters, fitted in turn.

The half-car is fitted to what the sensors would measure on the centre line (core.cross_spectrum.model.reading); for
that their position must be known. Roll is fitted to all three sensors with the half-car as found. Each needs the other,
so they alternate.

A model of roll is cruder than one of heave: tyres slip sideways, axles turn about points that nobody measured. Fitted
together, its errors would bend dampers and tyres of the half-car by several standard deviations (measured:
docs/adr/roll-takes-turns.md). With this alternation, errors of the roll model stay in the roll parameters.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import exp
from typing import Final

import numpy as np

from gateway.calibration.half_car.known_spectra import KnownSpectra
from gateway.calibration.half_car.prior import Prior
from gateway.core.cross_spectrum.likelihood import Curvature, Whittle
from gateway.core.cross_spectrum.model.parameters import INDEX, PARAMETERS, has_roll, upright
from gateway.core.cross_spectrum.search import Found, most_probable
from gateway.core.late import linalg
from gateway.records import F64

TURNS: Final = 3  # chosen: the second finds the sensor's place, the third the stroke speeds and so friction


def fit_vehicle(
    known: Sequence[KnownSpectra], prior: Prior, starts: Sequence[F64], step: Callable[[], None] = lambda: None
) -> Found:
    """The most probable parameters (n,) of all known runs together, the best result from ``starts`` (n,).

    ``step`` is called after each. Stroke speeds enter in the second turn: before the first, the vehicle that predicts
    them is unknown.
    """
    tried = []
    for start in starts:
        tried.append(fit_half_car(_brought(known, start), prior.upright, upright(start)))
        step()
    found = min(tried, key=lambda one: one.cost)
    if not has_roll(prior.mean):
        return found
    seen = known
    rolling = fit_roll(seen, found, prior.roll, starts[0][_N:])
    for _ in range(TURNS - 1):
        seen = seen_by(known, np.r_[found.x, rolling.x[: -len(known)]])
        found = fit_half_car(seen, prior.upright, found.x)
        rolling = fit_roll(seen, found, prior.roll, rolling.x[: -len(known)])
    return _together(seen, found, rolling)


def seen_by(known: Sequence[KnownSpectra], theta: F64) -> Sequence[KnownSpectra]:
    """The runs as the half-car is fitted to them.

    If theta (n,) has roll parameters, seen from the centre line, and with each axle's stroke speed relative to the
    usual one: the median of the runs if they do not state it.
    """
    if not has_roll(theta):
        return known
    brought, flat = _brought(known, theta), upright(theta)
    usual_mps = known[0].spectra.reading.usual_stroke_mps
    if usual_mps is None:
        front, rear = np.median([one.log_stroke_speeds(flat) for one in brought], axis=0).tolist()
        usual_mps = (exp(front), exp(rear))
    return [one.stroking(flat, usual_mps) for one in brought]


def _brought(known: Sequence[KnownSpectra], theta: F64) -> Sequence[KnownSpectra]:
    return [one.brought(theta) for one in known] if has_roll(theta) else known


def fit_half_car(known: Sequence[KnownSpectra], prior: Prior, start: F64) -> Found:
    """The most probable half-car (p,) of all known runs together, found from ``start`` (p,)."""
    everything = range(len(PARAMETERS))

    def cost(theta: F64) -> float:
        return sum(k.whittle.cost(k.at(theta)) for k in known)

    def curvature(theta: F64) -> Curvature:
        parts = [k.whittle.curvature(k.at(theta), everything) for k in known]
        return Curvature(
            gradient=np.sum([part.gradient for part in parts], axis=0),
            information=np.sum([part.information for part in parts], axis=0),
        )

    return most_probable(start, prior.mean, prior.precision, cost, curvature, tolerance=0.05)


_N: Final = len(PARAMETERS)


def fit_roll(known: Sequence[KnownSpectra], upright: Found, prior: Prior, start: F64) -> Found:
    """The most probable roll parameters of a vehicle, its half-car as ``upright`` has it, and behind them the error of
    each run's moment.

    ``prior`` and ``start`` (n - p,) are of the roll parameters alone. Each run's payload has a moment about the centre
    line that is known only roughly (kg m).
    """
    m, r = len(start), len(known)
    seen = [(one, one.rolling) for one in known]
    mean = np.r_[prior.mean, np.zeros(r)]
    precision = linalg.block_diag(prior.precision, np.diag([one.moment_std_kgm**-2.0 for one in known]))

    def cost(x: F64) -> float:
        theta = np.r_[upright.x, x[:m]]
        offs = x[m:].tolist()
        return sum(rolling.cost(one.placed(theta, off)) for (one, rolling), off in zip(seen, offs, strict=True))

    def curvature(x: F64) -> Curvature:
        gradient, information = np.zeros(m + r), np.zeros((m + r, m + r))
        theta = np.r_[upright.x, x[:m]]
        for i, ((one, rolling), off) in enumerate(zip(seen, x[m:].tolist(), strict=True)):
            part = _curvature(one, rolling, theta, off, range(_N, _N + m))
            at = [*range(m), m + i]
            gradient[at] += part.gradient
            information[np.ix_(at, at)] += part.information
        return Curvature(gradient, information)

    return most_probable(np.r_[start, np.zeros(r)], mean, precision, cost, curvature, tolerance=0.05)


def _together(known: Sequence[KnownSpectra], upright: Found, rolling: Found) -> Found:
    """All parameters (n,) of a vehicle that rolls, from its half-car and from fit_roll to the same runs."""
    m = len(rolling.x) - len(known)
    theta = np.r_[upright.x, rolling.x[:m]]
    moves = _moves([(one, one.rolling) for one in known], theta, rolling)
    own = rolling.covariance[:m, :m]
    beside = moves @ upright.covariance
    covariance = np.block([[upright.covariance, beside.T], [beside, own + beside @ moves.T]])
    return replace(rolling, x=theta, covariance=covariance)


def _moves(seen: Sequence[tuple[KnownSpectra, Whittle]], theta: F64, found: Found) -> F64:
    """(m, p) change of the roll parameters with each of the half-car's: -C I_rp."""
    m = len(theta) - _N
    across = np.zeros((len(found.x), _N))
    for i, ((one, rolling), off) in enumerate(zip(seen, found.x[m:].tolist(), strict=True)):
        part = _curvature(one, rolling, theta, off, range(len(theta)))
        across[:m] += part.information[_N:-1, :_N]
        across[m + i] += part.information[-1, :_N]
    moves: F64 = -(found.covariance @ across)[:m]
    return moves


def _curvature(one: KnownSpectra, rolling: Whittle, theta: F64, moment_off_kgm: float, free: range) -> Curvature:
    """Of one run's three sensors, for the ``free`` entries of theta and then for the error of the moment."""
    n, k = len(theta), len(free)
    whole = rolling.curvature(one.placed(theta, moment_off_kgm), [*free, n + 2])
    chain = np.eye(k + 1)  # of the parameters and the place by the parameters and the moment
    chain[-1, free.index(INDEX["empty_left_m"])] = one.empty_share
    chain[-1, -1] = 1.0 / one.total_kg
    return Curvature(chain.T @ whole.gradient, chain.T @ whole.information @ chain)
