"""The words on a drive's payload in the fit, and the test of each: does it agree with its drive and with the others?

A claim says that a payload x is s kg, up to an error of its own and errors that it has in common with other claims:

    x = s + a b + e,    e ~ N(0, own^2),    b ~ N(0, 1) for each cause of a common error

So a claim is one more row of the likelihood, in x and in b (m,). What the drive says without it follows from the
Gaussian posterior of (x, b) by taking that row away.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.calibration.statements import Claim
from gateway.records import F64

LEAST_PRECISION: Final = 1e-7  # per kg2: of a payload of which nothing is known


def common_causes(claims: Iterable[Claim]) -> tuple[str, ...]:
    """The causes of error that at least two claims have in common, in order of appearance."""
    counted = Counter(cause for claim in claims for cause, _ in claim.shared)
    return tuple(cause for cause, n in counted.items() if n > 1)


@dataclass(frozen=True, slots=True, eq=False)
class Terms:
    """The claims on one payload: said_kg (c,), own_kg (c,) the standard deviations of their own errors, and shared_kg
    (c, m) the kilograms that one standard deviation of each common cause makes.
    """

    names: tuple[str, ...]
    said_kg: F64
    own_kg: F64
    shared_kg: F64

    @classmethod
    def of(cls, claims: Sequence[Claim], causes: Sequence[str]) -> "Terms":
        """An error whose cause is not among ``causes`` counts as the claim's own."""
        shared = np.zeros((len(claims), len(causes)))
        own = np.zeros(len(claims))
        for i, claim in enumerate(claims):
            alone = [claim.own_std_kg]
            for cause, std_kg in claim.shared:
                if cause in causes:
                    shared[i, causes.index(cause)] = std_kg
                else:
                    alone.append(std_kg)
            own[i] = np.hypot.reduce(alone)
        return cls(tuple(claim.name for claim in claims), np.array([c.payload_kg for c in claims]), own, shared)

    @property
    def rows(self) -> F64:
        """(c, 1 + m) the derivatives of the standardised errors by payload and causes."""
        return np.asarray(np.column_stack([np.ones(len(self.names)), -self.shared_kg]) / self.own_kg[:, None])

    def off(self, payload_kg: float, causes: F64) -> F64:
        """(c,) the standardised errors of the claims."""
        return np.asarray((payload_kg - self.said_kg - self.shared_kg @ causes) / self.own_kg)

    def truth(self, causes: F64, covariance: F64) -> tuple[float, float]:
        """The payload that the claims leave once the common errors are known, and its standard deviation (kg)."""
        each = self.said_kg + self.shared_kg @ causes
        weights = self.own_kg**-2.0
        part = weights / weights.sum()
        shared = part @ self.shared_kg
        return float(part @ each), float(np.sqrt(1.0 / weights.sum() + shared @ covariance @ shared))

    def without(self, mean: F64, covariance: F64, left_out: Sequence[int]) -> tuple[F64, F64]:
        """Mean and covariance (1 + m) of payload and causes without these claims, from those with all."""
        rows = self.rows[left_out]
        precision = np.linalg.inv(covariance)
        pull = precision @ mean - rows.T @ (self.said_kg / self.own_kg)[left_out]
        values, vectors = np.linalg.eigh(precision - rows.T @ rows)
        left = (vectors / np.maximum(values, LEAST_PRECISION)) @ vectors.T
        return np.asarray(left @ pull), np.asarray(left)

    def disagreement(self, i: int, mean: F64, covariance: F64, stated_std_kg: float) -> float:
        """Of claim ``i`` with what the drive and the others say, in standard deviations of the difference.

        ``stated_std_kg`` is of its own error as stated; in the fit it may have less weight.
        """
        by_others, left = self.without(mean, covariance, [i])
        row = np.r_[1.0, -self.shared_kg[i]]
        return float(abs(row @ by_others - self.said_kg[i]) / np.sqrt(row @ left @ row + stated_std_kg**2))


def shared_disagreement(mean: float, variance: float) -> float:
    """Of a cause with its prior N(0, 1), in standard deviations: what its claims' drives say without the prior."""
    return abs(mean) / float(np.sqrt(max(1.0 - variance, 1e-9)))
