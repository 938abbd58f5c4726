"""Friction and rubber: an axle is stiffer and more damped where it moves less.

A friction force F acts on a movement of standard deviation s as a damper sqrt(2/pi) F/s does (statistical
linearisation; J. B. Roberts, P. D. Spanos, Random Vibration and Statistical Linearization, 1990). Where it sticks, the
bushes act as the spring, and rubber itself is softer in large movements (A. R. Payne, J. Appl. Polym. Sci. 6, 1962). A
share p of the rate of each damper and spring is of this kind at the usual amplitude; at s times that amplitude the rate
is 1 - p + p/s times as large.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from gateway.core.cross_spectrum.model.half_car import Axle, HalfCar
from gateway.core.cross_spectrum.model.parameters import INDEX
from gateway.core.memoized import memoized
from gateway.records import F64

LEVEL_STEPS: Final = (0.8, 0.4)
"""Chosen: distances between the levels at which a vehicle is solved, in logarithms of amplitude over the usual one: of
u, the mean of front and rear axle, and of d, half their difference.

Of a rate 1 - p + p exp(-x) quadratic interpolation along u misses at most p |u (u^2 - 0.8^2)| exp(0.8) / 6, which is
0.07 p between the outer levels; p is 0.1 or so. What u and d do together to both axles is left out.
"""
MOST: Final = 1.2  # chosen: limit of the mean u
MOST_APART: Final = 0.8  # chosen: limit of d
LEAST_LEFT: Final = 0.05  # chosen: least part of a rate, for any friction share

RATES: Final = tuple(
    (axle, INDEX[f"{kind}_friction_{end}"], INDEX[f"{kind}_{end}_{unit}"])
    for kind, unit in (("damper", "nspm"), ("spring", "npm"))
    for axle, end in enumerate(("front", "rear"))
)
"""For each friction share: its axle (0: front), its entry in the vector, and the entry of its rate."""


def levels() -> tuple[tuple[float, float], ...]:
    """The five levels of front and rear axle at which a vehicle is solved."""
    u, d = LEVEL_STEPS
    return (-u, -u), (0.0, 0.0), (u, u), (d, -d), (-d, d)


_AXLES, _SHARES, _ = (list(each) for each in zip(*RATES, strict=True))
_LESS: Final = np.expm1(-np.array(levels()))[:, _AXLES]  # (5, 4) of the axle of each rate: 1/s - 1


def at_levels(car: HalfCar, theta: F64) -> HalfCar:
    """``car`` with the spring and damper rates at each of :func:`levels`, by friction.

    theta (..., p) are the parameters of ``car``, whose numbers are (..., 1, 1); the rates of the result are (..., 5,
    1).
    """
    left = np.maximum(1.0 + theta[..., None, _SHARES] * _LESS, LEAST_LEFT)[..., None]
    dampers, springs = left[..., :2, :], left[..., 2:, :]

    def acting(axle: Axle, i: int) -> Axle:
        damper_nspm, spring_npm = axle.damper_nspm * dampers[..., i, :], axle.spring_npm * springs[..., i, :]
        return replace(axle, damper_nspm=damper_nspm, spring_npm=spring_npm)

    return replace(car, front=acting(car.front, 0), rear=acting(car.rear, 1))


@memoized
def level_weights(log_amplitudes: F64) -> F64:
    """(b, 5) weights of :func:`levels` for amplitudes (b, 2) of front and rear axle, by quadratic interpolation."""
    front, rear = log_amplitudes[:, :1], log_amplitudes[:, 1:]
    u = np.clip(0.5 * (front + rear), -MOST, MOST) / LEVEL_STEPS[0]
    d = np.clip(0.5 * (front - rear), -MOST_APART, MOST_APART) / LEVEL_STEPS[1]
    parts = [0.5 * u * (u - 1.0), 1.0 - u**2 - d**2, 0.5 * u * (u + 1.0), 0.5 * d * (d + 1.0), 0.5 * d * (d - 1.0)]
    weights: F64 = np.concatenate(parts, axis=1)
    return weights
