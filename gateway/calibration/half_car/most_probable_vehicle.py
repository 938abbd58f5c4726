"""The most probable vehicle: its half-car, and with a roll rate its roll parameters."""

from collections.abc import Callable, Sequence
from math import exp
from typing import Final

import numpy as np

from gateway.calibration.half_car.known_spectra import KnownSpectra
from gateway.calibration.half_car.prior import Prior
from gateway.calibration.half_car.rolling_fit import fit_roll
from gateway.core.cross_spectrum.likelihood import Curvature
from gateway.core.cross_spectrum.model.parameters import PARAMETERS, has_roll, upright
from gateway.core.cross_spectrum.search import Found, most_probable
from gateway.records import F64

TURNS: Final = 3  # chosen: the second finds the sensor's place, the third the stroke speeds and so friction


def fit_vehicle(
    known: Sequence[KnownSpectra], prior: Prior, starts: Sequence[F64], step: Callable[[], None] = lambda: None
) -> Found:
    """The most probable parameters (n,) of all known runs together, the best result from ``starts`` (n,).

    ``step`` is called after each. For the alternation of half-car and roll see rolling_fit. Stroke speeds enter in the
    second turn: before the first, the vehicle that predicts them is unknown.
    """
    tried = []
    for start in starts:
        tried.append(fit_half_car(_brought(known, start), prior.upright, upright(start)))
        step()
    found = min(tried, key=lambda one: one.cost)
    if not has_roll(prior.mean):
        return found
    rolling = fit_roll(known, found, prior.roll, starts[0][len(PARAMETERS) :])
    for _ in range(TURNS - 1):
        seen = seen_by(known, rolling.x)
        found = fit_half_car(seen, prior.upright, found.x)
        rolling = fit_roll(seen, found, prior.roll, rolling.x[len(PARAMETERS) :])
    return rolling


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
