"""A vehicle together with what calibration found out about it: all an estimator may know beforehand."""

from dataclasses import dataclass
from functools import lru_cache

from gateway.core.cargo import ShapePrior, is_said, shape_prior
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.ratio_index.index import RatioIndexCalibration
from gateway.core.vehicle import Vehicle
from gateway.core.weights import NOT_CALIBRATED, Unsprung

RANGE_MARGIN = 0.25  # of the span seen in calibration, at either end
RATE_MARGIN = 0.25  # of a sampling rate: devices of one setting differ by 1 %, settings by a factor of 2; chosen


def is_other_rate(rate_hz: float, slowest_hz: float, fastest_hz: float) -> bool:
    """Whether a device samples otherwise than at the rates from slowest to fastest; NaN tells nothing."""
    margin = 1.0 + RATE_MARGIN
    return rate_hz * margin < slowest_hz or rate_hz > fastest_hz * margin


@dataclass(frozen=True, slots=True)
class CalibratedVehicle:
    """One calibration file, ready for use. ``id`` is the hash of its content. ``is_shape_known``: what is weighed has
    the shape of the known loads, as runs left out of a calibration have.
    """

    id: str
    vehicle: Vehicle
    payload_seen_kg: tuple[float, float]
    front_share_seen_pct: tuple[float, float]
    ratio_index: RatioIndexCalibration | None = None
    cross_spectrum: CrossSpectrumCalibration | None = None
    is_shape_known: bool = False
    sensor_rate_seen_hz: tuple[float, float] | None = None

    @property
    def unsprung(self) -> Unsprung:
        """As known loads tell it; the ratio index tells nothing of it."""
        return NOT_CALIBRATED if self.cross_spectrum is None else self.cross_spectrum.unsprung

    @property
    def shape_prior(self) -> ShapePrior | None:
        """What is believed of a load's shape, from what the fitter said and from the known loads.

        None where one load alone was driven and nothing is said: the shape of that load is all that the half-car was
        fitted with, its covariance says how little is known of it, and a second shape would have no scale to go by.
        """
        known = self.cross_spectrum
        if (
            self.is_shape_known
            or known is None
            or (known.payload_seen_kg[0] == known.payload_seen_kg[1] and not is_said(self.vehicle))
        ):
            return None
        return _shape_prior(self.vehicle, *known.known_shape)

    def is_sampled_otherwise(self, sensor_rate_hz: float) -> bool:
        """True where sensors send so much faster or slower than in calibration that other vibration folds into the
        bands; NaN, and a calibration that does not say how often they sent, tell nothing.
        """
        if self.sensor_rate_seen_hz is None:
            return False
        return is_other_rate(sensor_rate_hz, *self.sensor_rate_seen_hz)

    def is_out_of_range(self, payload95_kg: tuple[float, float], front_share95_pct: tuple[float, float]) -> bool:
        """True where a 95 % interval lies wholly outside what calibration saw, plus a quarter of its span.

        A calibration from one load saw no span and so sets no limit; an interval of NaN is not outside.
        """
        return _is_outside(payload95_kg, self.payload_seen_kg) or _is_outside(
            front_share95_pct, self.front_share_seen_pct
        )


_shape_prior = lru_cache(maxsize=8)(shape_prior)


def believed(seen: tuple[float, float]) -> tuple[float, float] | None:
    """The range seen plus its margin; None where one load was seen, which sets no limit."""
    margin = RANGE_MARGIN * (seen[1] - seen[0])
    return (seen[0] - margin, seen[1] + margin) if margin > 0.0 else None


def _is_outside(interval: tuple[float, float], seen: tuple[float, float]) -> bool:
    limits = believed(seen)
    return limits is not None and (interval[1] < limits[0] or interval[0] > limits[1])
