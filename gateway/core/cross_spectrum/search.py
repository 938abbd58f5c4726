"""The most probable parameters: Fisher scoring with damping, for any sum of likelihoods and Gaussian priors."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gateway.core.cross_spectrum.likelihood import Curvature
from gateway.records import F64

MOST_STEPS = 60  # chosen: a search takes about ten
MOST_HALVINGS = 10  # chosen: attempts with more damping per step


@dataclass(frozen=True, slots=True)
class Found:
    """Solution x (k,), its cost and its posterior covariance (k, k) by Laplace's approximation.

    near (k,) is the point of the last curvature, one small step before x. ``is_converged`` is false if the steps ran
    out, or none lowered a cost that was still falling.
    """

    x: F64
    cost: float
    covariance: F64
    is_converged: bool
    near: F64


def most_probable(
    start: F64,
    prior_mean: F64,
    prior_precision: F64,
    cost: Callable[[F64], float],
    curvature: Callable[[F64], Curvature],
    tolerance: float = 1e-3,
) -> Found:
    """Minimise cost(x) + (x - mean)' precision (x - mean) / 2 from ``start`` (k,).

    Where ``prior_precision`` (k, k) is zero the prior is flat. Steps are damped (Levenberg 1944) until the cost falls;
    the search ends with a step that gains less than ``tolerance``, in units of log-likelihood.
    """

    def total(x: F64) -> float:
        return cost(x) + 0.5 * float((x - prior_mean) @ prior_precision @ (x - prior_mean))

    x = near = start
    here = curvature(x)  # before the cost: whoever solves the model then knows which slopes are sought
    best, damping, is_converged = total(x), 1e-3, False
    information = prior_precision
    for _ in range(MOST_STEPS):
        near = x
        gradient = here.gradient + prior_precision @ (x - prior_mean)
        information = here.information + prior_precision
        step = np.linalg.solve(information, -gradient)
        expected = -0.5 * float(gradient @ step)
        if 0.0 <= expected < tolerance:
            x, best, is_converged = x + step, best - expected, True
            break
        moved = _damped_step(x, gradient, information, damping, total, best)
        if moved is None:
            break
        gain = best - moved[1]
        x, best, damping = moved[0], moved[1], max(moved[2] / 5.0, 1e-6)
        if gain < tolerance:
            is_converged = True
            break
        here = curvature(x)
    return Found(x, best, np.asarray(np.linalg.inv(information), float), is_converged, near)


def _damped_step(
    x: F64, gradient: F64, information: F64, damping: float, total: Callable[[F64], float], best: float
) -> tuple[F64, float, float] | None:
    """The first damped step that lowers the cost, with that cost and damping; None if none does."""
    for _ in range(MOST_HALVINGS):
        step = np.linalg.solve(information + damping * np.diag(np.diag(information)), -gradient)
        reached = total(x + step)
        if reached < best:
            return x + step, reached, damping
        damping *= 8.0
    return None
