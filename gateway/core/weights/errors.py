"""How errors of what was estimated add up in what follows from it.

They are of first order, in this order: payload L (kg), front share D (0 to 1), lateral place y of the centre of gravity
(m left of the centre line) and the front axle's part phi of a sideways moment (0 to 1).
"""

import math
from collections.abc import Sequence

from gateway.core.weights.sideways import Sideways
from gateway.estimate import Quantity


class Errors:
    """Of what was estimated, in the module's order and units; NaN where one is unknown."""

    def __init__(self, payload: Quantity, front_share: Quantity, correlation: float, sideways: Sideways) -> None:
        of_share, of_cg = front_share.std / 100.0, sideways.cg_left.std
        self._std = (payload.std, of_share, of_cg, sideways.roll_share_front_std)
        self._together = {
            (0, 1): _known_or_0(correlation),
            (0, 2): _known_or_0(sideways.payload_correlation),
            (1, 2): _known_or_0(sideways.front_share_correlation),
        }

    def std(self, slopes: Sequence[float]) -> float:
        """Of what has these slopes by the first so many."""
        errors = self._of(slopes)
        if any(map(math.isnan, errors)):
            return math.nan
        largest = max(map(abs, errors))
        if largest == 0.0:
            return 0.0
        relative = [error / largest for error in errors]
        return largest * math.sqrt(max(0.0, self._common(relative, relative)))

    def covariance(self, slopes: Sequence[float], other_slopes: Sequence[float]) -> float:
        """Of two such."""
        return self._common(self._of(slopes), self._of(other_slopes))

    def _of(self, slopes: Sequence[float]) -> list[float]:
        return [slope * std for slope, std in zip(slopes, self._std, strict=False)]

    def _common(self, errors: Sequence[float], others: Sequence[float]) -> float:
        alike = sum(error * other for error, other in zip(errors, others, strict=False))
        crossed = (
            shared * (_at(errors, one) * _at(others, other) + _at(errors, other) * _at(others, one))
            for (one, other), shared in self._together.items()
        )
        return alike + sum(crossed)


def _at(errors: Sequence[float], n: int) -> float:
    return errors[n] if n < len(errors) else 0.0


def _known_or_0(correlation: float) -> float:
    return 0.0 if math.isnan(correlation) else correlation
