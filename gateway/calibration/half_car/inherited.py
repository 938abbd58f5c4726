"""What a fit is told before it starts, by vehicles of the same line (calibration.line)."""

from typing import Protocol

from gateway.calibration.half_car.prior import Prior
from gateway.calibration.half_car.usual import Usual
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.vehicle import Vehicle


class Inherited(Protocol):
    """A line, as a fit sees it."""

    @property
    def usual(self) -> Usual:
        """How much its vehicles usually moved."""

    def prior_of(self, vehicle: Vehicle, *, with_roll: bool) -> Prior:
        """Of one of its vehicles that has not been driven yet."""

    def on(self, calibration: CrossSpectrumCalibration, *, is_tested: bool) -> CrossSpectrumCalibration:
        """``calibration`` of one of its vehicles, valid where the line is, with the line's limits.

        Where runs of its own that were left out ``is_tested``, its limits are the wider of both.
        """
