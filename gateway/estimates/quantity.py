"""A number with its standard deviation and its 95 % interval."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

Z95: Final = 1.959964  # standard deviations to either side of a normal distribution's middle 95 %
UNKNOWN_INTERVAL: Final = (math.nan, math.nan)


def half_width(interval95: Sequence[float]) -> float:
    """Half the width of a 95 % interval (low, high), the number after ±; NaN if it is unknown."""
    return (interval95[1] - interval95[0]) / 2.0


@dataclass(frozen=True, slots=True)
class Quantity:
    """A number, its standard deviation and its 95 % interval (low, high), all in one unit. NaN if unknown.

    A payload is in kg, the lateral place of a centre of gravity in m. A share of the sprung mass, on the front axle
    or on the left wheels, is in percent, its standard deviation in percentage points.
    """

    number: float = math.nan
    std: float = math.nan
    interval95: tuple[float, float] = UNKNOWN_INTERVAL

    @classmethod
    def normal(cls, number: float, std: float) -> "Quantity":
        """A quantity with the interval of a normal distribution."""
        return cls(number, std, (number - Z95 * std, number + Z95 * std))

    def widened(self, std: float) -> "Quantity":
        """This quantity with one more independent error: its interval keeps its shape, each half grows in
        quadrature."""
        below, above = self.number - self.interval95[0], self.interval95[1] - self.number
        interval95 = (self.number - math.hypot(below, Z95 * std), self.number + math.hypot(above, Z95 * std))
        return Quantity(self.number, math.hypot(self.std, std), interval95)


UNKNOWN: Final = Quantity()
