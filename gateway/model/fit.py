"""The maximum of a hierarchical posterior: one vector common to all drives, and one of its own for each.

The information matrix is an arrow: the common block, a block for each drive, and nothing between two drives.
Eliminating the drives' blocks (Schur complement) makes the cost grow linearly with their number. With one drive and
nothing in common this is an ordinary search.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from gateway.records import F64

MOST_STEPS: Final = 60  # chosen: a search takes about ten
MOST_HALVINGS: Final = 12  # chosen: attempts with more damping per step
DISAPPOINTING: Final = 0.25  # chosen: of the gain to first order; a step that gains less is tried shorter
LEAST_STEPS: Final = 4  # chosen: before a search may be given up; far from a peak a parabola tells little of it
HOPE: Final = 3.0  # chosen: times the expected gain
SHORTEST: Final = 0.05  # chosen: part of a step
ROUNDING: Final = 1e-4  # chosen: of an information, beyond that of its products in four bytes
MET: Final = 2.0  # chosen: in log posterior; a step that ends nearer to a known maximum leads to it


@dataclass(frozen=True, slots=True)
class Gaussian:
    """A prior: mean (k,) and precision (k, k); zero precision is a flat prior."""

    mean: F64
    precision: F64

    @classmethod
    def of(cls, mean: F64, covariance: F64) -> "Gaussian":
        """The result, made from its covariance."""
        return cls(np.asarray(mean, float), np.asarray(np.linalg.inv(covariance), float))

    def cost(self, x: F64) -> float:
        """Minus the log density at x (k,), up to a constant."""
        off = x - self.mean
        return 0.5 * float(off @ self.precision @ off)

    def pull(self, x: F64) -> F64:
        """(k,) its gradient."""
        return np.asarray(self.precision @ (x - self.mean), float)

    def information(self, x: F64) -> F64:
        """(k, k) its second derivative."""
        return self.precision


@dataclass(frozen=True, slots=True)
class Rising(Gaussian):
    """A Gaussian that penalises combinations below 0: where a row of ``rows`` (m, k) times x is negative, the cost
    rises by half its square.
    """

    rows: F64

    def cost(self, x: F64) -> float:
        below = np.minimum(self.rows @ x, 0.0)
        return Gaussian.cost(self, x) + 0.5 * float(below @ below)

    def pull(self, x: F64) -> F64:
        return Gaussian.pull(self, x) + self.rows.T @ np.minimum(self.rows @ x, 0.0)

    def information(self, x: F64) -> F64:
        falling = self.rows[self.rows @ x < 0.0]
        return np.asarray(self.precision + falling.T @ falling, float)


class Likelihood(Protocol):
    """Minus the log-likelihood of one drive, as a function of the common vector (n,) and its own (k,)."""

    def cost(self, common: F64, own: F64) -> float:
        """The cost at these parameters; infinite where the model has none."""

    def curvature(self, common: F64, own: F64) -> tuple[F64, F64]:
        """Gradient (n + k,) and expected second derivative (n + k, n + k)."""


@dataclass(frozen=True, slots=True)
class Drive:
    """One drive's likelihood with the prior of its own vector and the point from which the search starts."""

    likelihood: Likelihood
    prior: Gaussian
    start: F64


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """The maximum: the common vector with its covariance, and each drive's own with its covariance.

    across (n, k) of a drive is the covariance of its vector with the common one. cost is minus the log posterior, and
    log_volume half the logarithm of the determinant of the information. ``is_converged`` is false if the steps ran out
    or none lowered a cost that could still fall; the cost is infinite if the search was on its way to a known maximum.
    """

    common: F64
    covariance: F64
    own: tuple[F64, ...]
    own_covariances: tuple[F64, ...]
    across: tuple[F64, ...]
    cost: float
    log_volume: float
    is_converged: bool


@dataclass(slots=True)
class _Arrow:
    """Gradient and information at a point: of the common block, and of every drive's."""

    gradient: F64
    information: F64
    own_gradients: list[F64]
    own_informations: list[F64]
    across: list[F64]

    def step(self, damping: float) -> tuple[F64, list[F64]]:
        """The step that lowers the cost, with the diagonals raised by ``damping`` times themselves (Levenberg 1944)."""
        schur = self.information + damping * np.diag(np.diag(self.information))
        pull = self.gradient.copy()
        solved = []
        for gradient, information, across in zip(self.own_gradients, self.own_informations, self.across, strict=True):
            damped = information + damping * np.diag(np.diag(information))
            by_own = np.asarray(np.linalg.solve(damped, np.column_stack([across.T, gradient])), float)
            solved.append(by_own)
            schur -= across @ by_own[:, :-1]
            pull -= across @ by_own[:, -1]
        common: F64 = np.asarray(np.linalg.solve(schur, -pull), float) if len(pull) else pull
        return common, [-by_own[:, -1] - by_own[:, :-1] @ common for by_own in solved]

    def slope(self, common: F64, own: Sequence[F64]) -> float:
        """The rise of the cost along a step, to first order."""
        return float(self.gradient @ common) + sum(float(g @ s) for g, s in zip(self.own_gradients, own, strict=True))


NOTHING: Final = Gaussian(np.empty(0), np.empty((0, 0)))
"""The prior of an empty common vector."""


def climb(
    likelihood: Likelihood,
    prior: Gaussian,
    start: F64,
    tolerance: float = 1e-2,
    worth: float = np.inf,
    known: Sequence[Gaussian] = (),
) -> Found:
    """The maximum of one drive's own vector, reached from ``start`` (k,); see :func:`most_probable`."""
    return most_probable(NOTHING.mean, NOTHING, [Drive(likelihood, prior, start)], tolerance, worth, known)


def most_probable(
    start: F64,
    prior: Gaussian,
    drives: Sequence[Drive],
    tolerance: float = 1e-2,
    worth: float = np.inf,
    known: Sequence[Gaussian] = (),
) -> Found:
    """The maximum reached from ``start`` (n,) and each drive's own start.

    Ends where an undamped step would gain less than ``tolerance``, in units of log posterior. It is given up where
    HOPE times the expected gain would leave the cost above ``worth``, and where an undamped step of the first drive
    ends at a maximum that is ``known``, here as the parabola about it.
    """

    def total(common: F64, own: Sequence[F64]) -> float:
        cost = prior.cost(common)
        for drive, x in zip(drives, own, strict=True):
            cost += drive.likelihood.cost(common, x) + drive.prior.cost(x)
        return cost

    common, own = np.asarray(start, float), [np.asarray(drive.start, float) for drive in drives]
    arrow = _arrow(common, own, prior, drives)
    best, damping, is_converged = total(common, own), 1e-3, False
    for taken in range(MOST_STEPS):
        whole, parts = arrow.step(0.0)
        expected = -0.5 * arrow.slope(whole, parts)  # what an undamped step gains if the cost is a parabola
        if 0.0 <= expected < tolerance:
            common, own, best, is_converged = (
                common + whole,
                [x + s for x, s in zip(own, parts, strict=True)],
                best - expected,
                True,
            )
            break
        if any(one.cost(own[0] + parts[0]) < MET for one in known):
            best = np.inf
            break
        if taken >= LEAST_STEPS and best - HOPE * max(expected, 0.0) > worth:
            break
        moved = _damped(arrow, common, own, damping, best, total)
        if moved is None:
            is_converged = expected < 20.0 * tolerance
            break
        common, own, best, damping = moved
        damping = max(damping / 6.0, 1e-7)
        arrow = _arrow(common, own, prior, drives)
    return _found(arrow, common, own, best, is_converged=is_converged)


def _damped(
    arrow: _Arrow,
    common: F64,
    own: Sequence[F64],
    damping: float,
    best: float,
    total: Callable[[F64, Sequence[F64]], float],
) -> tuple[F64, list[F64], float, float] | None:
    """The first damped step that lowers the cost, with that cost and its damping; None if none does.

    Where a step disappoints, a part of it is tried too: the one at the bottom of the parabola through the cost and its
    slope here and the cost there.
    """
    for _ in range(MOST_HALVINGS):
        whole, parts = arrow.step(damping)
        slope = -arrow.slope(whole, parts)
        share, reached = 1.0, total(common + whole, [x + s for x, s in zip(own, parts, strict=True)])
        if reached > best - DISAPPOINTING * slope and np.isfinite(reached):
            shorter = max(0.5 * slope / (reached - best + slope), SHORTEST)
            there = total(common + shorter * whole, [x + shorter * s for x, s in zip(own, parts, strict=True)])
            if there < min(reached, best):
                share, reached = shorter, there
        if reached < best:
            moved = [x + share * s for x, s in zip(own, parts, strict=True)]
            return common + share * whole, moved, reached, damping
        damping *= 8.0
    return None


def _arrow(common: F64, own: Sequence[F64], prior: Gaussian, drives: Sequence[Drive]) -> _Arrow:
    n = len(common)
    arrow = _Arrow(prior.pull(common), prior.information(common).copy(), [], [], [])
    for drive, x in zip(drives, own, strict=True):
        gradient, information = drive.likelihood.curvature(common, x)
        arrow.gradient += gradient[:n]
        arrow.information += information[:n, :n]
        arrow.own_gradients.append(gradient[n:] + drive.prior.pull(x))
        arrow.own_informations.append(information[n:, n:] + drive.prior.information(x))
        arrow.across.append(information[:n, n:])
    return arrow


def _found(arrow: _Arrow, common: F64, own: Sequence[F64], cost: float, *, is_converged: bool) -> Found:
    schur, log_determinant = arrow.information.copy(), 0.0
    by_own = []
    for information, across in zip(arrow.own_informations, arrow.across, strict=True):
        inverse = _inverse(information)
        log_determinant += float(np.linalg.slogdet(information)[1])
        by_own.append((inverse, across @ inverse))
        schur -= across @ inverse @ across.T
    covariance = np.asarray(np.linalg.inv(schur), float) if len(schur) else schur
    log_determinant += float(np.linalg.slogdet(schur)[1]) if len(schur) else 0.0
    across_covariances = [-covariance @ moves for _, moves in by_own]
    own_covariances = [inverse + moves.T @ covariance @ moves for inverse, moves in by_own]
    return Found(
        common=common,
        covariance=covariance,
        own=tuple(own),
        own_covariances=tuple(own_covariances),
        across=tuple(across_covariances),
        cost=cost,
        log_volume=0.5 * log_determinant,
        is_converged=is_converged,
    )


def _inverse(information: F64) -> F64:
    """The inverse; with what is hardly determined, and negative by rounding, as undetermined as rounding allows."""
    inverse = np.asarray(np.linalg.inv(information), float)
    if (np.diag(inverse) > 0.0).all():
        return inverse
    return np.asarray(np.linalg.inv(information + ROUNDING * np.diag(np.diag(information))), float)
