"""A vehicle together with its calibration: all prior knowledge of an estimator."""

from dataclasses import dataclass
from functools import lru_cache

from gateway.core.cargo import ShapePrior, is_said, shape_prior
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.ratio_index.index import RatioIndexCalibration
from gateway.core.vehicle import Vehicle
from gateway.core.weights.on_the_road import NOT_CALIBRATED, Unsprung

RANGE_MARGIN = 0.25  # chosen: share of the calibrated span, added at either end
RATE_MARGIN = 0.25  # of a sampling rate: devices of one setting differ by 1 %, settings by a factor of 2; chosen


def is_other_rate(rate_hz: float, slowest_hz: float, fastest_hz: float) -> bool:
    """Whether a device samples at a rate outside the range from slowest to fastest; False for NaN."""
    margin = 1.0 + RATE_MARGIN
    return rate_hz * margin < slowest_hz or rate_hz > fastest_hz * margin


@dataclass(frozen=True, slots=True)
class CalibratedVehicle:
    """One calibration file, ready for use. ``id`` is the hash of its content. ``is_shape_known``: the weighed load has
    the shape of the known loads, as in the runs left out of a calibration.
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
        """The unsprung masses as calibrated with known loads; the ratio index gives none."""
        return NOT_CALIBRATED if self.cross_spectrum is None else self.cross_spectrum.unsprung

    @property
    def shape_prior(self) -> ShapePrior | None:
        """The prior of a load's shape, from the fitter's answers and from the known loads.

        None if calibration saw a single load and the fitter said nothing: the half-car was fitted with that load's
        shape, its covariance already includes the doubt about it, and a second shape has no scale to refer to.
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
        """Whether the sensors send so much faster or slower than in calibration that other vibration aliases into the
        bands. False for NaN, and for a calibration that does not state its sampling rate.
        """
        if self.sensor_rate_seen_hz is None:
            return False
        return is_other_rate(sensor_rate_hz, *self.sensor_rate_seen_hz)

    def is_out_of_range(self, payload95_kg: tuple[float, float], front_share95_pct: tuple[float, float]) -> bool:
        """Whether a 95 % interval lies entirely outside the calibrated range plus a quarter of its span.

        A calibration from one load has no span and sets no limit; an interval of NaN is not outside.
        """
        return _is_outside(payload95_kg, self.payload_seen_kg) or _is_outside(
            front_share95_pct, self.front_share_seen_pct
        )


_shape_prior = lru_cache(maxsize=8)(shape_prior)


def believed(seen: tuple[float, float]) -> tuple[float, float] | None:
    """The calibrated range plus its margin; None if calibration saw one load, which sets no limit."""
    margin = RANGE_MARGIN * (seen[1] - seen[0])
    return (seen[0] - margin, seen[1] + margin) if margin > 0.0 else None


def _is_outside(interval: tuple[float, float], seen: tuple[float, float]) -> bool:
    limits = believed(seen)
    return limits is not None and (interval[1] < limits[0] or interval[0] > limits[1])
