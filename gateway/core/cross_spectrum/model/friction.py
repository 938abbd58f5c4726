"""What makes an axle stiffer and more damped where it moves less: friction, and rubber.

A friction force F acts on a movement of standard deviation s as a damper sqrt(2/pi) F/s does (statistical
linearisation; J. B. Roberts, P. D. Spanos, Random Vibration and Statistical Linearization, 1990). Where it sticks,
the bushes beside it are the spring, and rubber itself is softer in large movements than in small ones (A. R. Payne,
J. Appl. Polym. Sci. 6, 1962). Of the rate of each damper and of each spring a share p is of this kind where the
vehicle moves as much as it usually does; where it moves s times as much, the rate is 1 - p + p/s times as large.
"""

from typing import Final

import numpy as np

from gateway.core.cross_spectrum.model.parameters import INDEX
from gateway.records import F64

LEVELS: Final = (-0.8, 0.0, 0.8)
"""Logarithms x of amplitude over the usual one at which a vehicle is solved.

Of a rate 1 - p + p exp(-x) quadratic interpolation misses at most p |x (x^2 - 0.8^2)| exp(0.8) / 6, which is 0.07 p
between the outer levels; p is 0.1 or so.
"""
MOST: Final = 1.2  # an amplitude further from the usual one counts as this far
LEAST_LEFT: Final = 0.05  # of a rate, however large its friction is thought to be

RATES: Final = tuple(
    (INDEX[f"{kind}_friction_{end}"], INDEX[f"{kind}_{end}_{unit}"])
    for kind, unit in (("damper", "nspm"), ("spring", "npm"))
    for end in ("front", "rear")
)
"""Where the vector has each friction share, and the rate that it is a share of."""


def at_levels(theta: F64) -> F64:
    """Parameters theta (..., p) as they act at each of LEVELS: (..., 3, p)."""
    return np.stack([_at(theta, level) for level in LEVELS], axis=-2)


def level_weights(log_amplitude: F64) -> F64:
    """What of the three LEVELS makes up each amplitude (b, 1), by quadratic interpolation: (b, 3)."""
    x = np.clip(log_amplitude, -MOST, MOST) / LEVELS[2]
    weights: F64 = np.concatenate([0.5 * x * (x - 1.0), 1.0 - x**2, 0.5 * x * (x + 1.0)], axis=1)
    return weights


def _at(theta: F64, log_amplitude: float) -> F64:
    moved = theta.copy()
    for share, rate in RATES:
        ratio = 1.0 + theta[..., share] * np.expm1(-log_amplitude)
        moved[..., rate] += np.log(np.maximum(ratio, LEAST_LEFT))
    return moved
