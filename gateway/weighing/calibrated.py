"""A vehicle together with its calibration: all prior knowledge of an estimator."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from gateway.core.cargo import ShapeHypothesis, is_said, known_shape, shape_hypotheses
from gateway.core.ratio_index.index import RatioIndexCalibration
from gateway.core.vehicle import Vehicle
from gateway.core.weights.on_the_road import NOT_CALIBRATED, Unsprung
from gateway.model.vehicle_model import VehicleModel

RANGE_MARGIN: Final = 0.25  # chosen: share of the believed span, added at either end
OVERLOAD: Final = 1.5  # chosen: times what the vehicle may carry, of loads that must be seen because they are too heavy
RATE_MARGIN: Final = 0.25
"""Of a sampling rate: devices of one setting differ by 1 %, settings by a factor of 2; chosen."""
BY_MODEL: Final = "cross_spectrum"
ONE_LOAD_SHARE: Final = 0.05  # chosen: of the empty mass; loads that differ by less are one load


def is_other_rate(rate_hz: float, slowest_hz: float, fastest_hz: float) -> bool:
    """Whether a device samples at a rate outside the range from slowest to fastest; False for NaN."""
    margin = 1.0 + RATE_MARGIN
    return rate_hz * margin < slowest_hz or rate_hz > fastest_hz * margin


@dataclass(frozen=True, slots=True)
class CalibratedVehicle:
    """One calibration file, ready for use. ``id`` is the hash of its bytes. ``is_shape_known``: the weighed load has
    the shape of the known loads, as in the runs left out of a calibration.
    """

    id: str
    vehicle: Vehicle
    payload_seen_kg: tuple[float, float]
    front_share_seen_pct: tuple[float, float]
    ratio_index: RatioIndexCalibration | None = None
    cross_spectrum: VehicleModel | None = None
    is_shape_known: bool = False
    sensor_rate_seen_hz: tuple[float, float] | None = None

    @property
    def unsprung(self) -> Unsprung:
        """The unsprung masses as calibrated; the ratio index gives none."""
        return NOT_CALIBRATED if self.cross_spectrum is None else self.cross_spectrum.unsprung

    @property
    def shapes(self) -> tuple[ShapeHypothesis, ...]:
        """The kinds of shape that a weighed load may have; none without the model of the vehicle.

        A calibration of one load leaves its shape as open as any load's: unless the fitter stated what is carried,
        there is nothing that a second kind would refer to.
        """
        if self.cross_spectrum is None:
            return ()
        like = self.cross_spectrum.known_shape
        has_one_kind = self.is_shape_known or (self.is_of_one_load and not is_said(self.vehicle))
        return known_shape(*like) if has_one_kind else _shapes(self.vehicle, *like)

    def is_sampled_otherwise(self, sensor_rate_hz: float) -> bool:
        """Whether the sensors send so much faster or slower than in calibration that other vibration aliases into the
        bands. False for NaN, and for a calibration that does not state its sampling rate.
        """
        if self.sensor_rate_seen_hz is None:
            return False
        return is_other_rate(sensor_rate_hz, *self.sensor_rate_seen_hz)

    @property
    def is_of_one_load(self) -> bool:
        """Whether calibration saw a single load, and so no range."""
        low, high = self.payload_seen_kg
        return high - low <= ONE_LOAD_SHARE * self.vehicle.empty_mass_kg

    def payload_believed_kg(self, estimator: str) -> tuple[float, float]:
        """The payloads in which answers are trusted, a quarter of their span added at either end.

        The ratio index is trusted where it was calibrated. The model of the vehicle says itself how its error grows
        beyond: it is trusted in what the vehicle may carry, and half as much again.
        """
        low, high = self.payload_seen_kg
        if estimator == BY_MODEL:
            low = min(low, self.vehicle.payload_range_kg[0])
            high = max(high, OVERLOAD * self.vehicle.largest_payload_kg)
        return _widened(low, high)

    def front_share_believed_pct(self, estimator: str) -> tuple[float, float] | None:
        """The range of front shares that is believed, with the most that the vehicle may carry between the axles. None
        if calibration saw one share only.
        """
        low, high = self.front_share_seen_pct
        if estimator == BY_MODEL:
            vehicle, payload_kg = self.vehicle, self.vehicle.largest_payload_kg
            front_kg, whole_kg = vehicle.empty_front_share * vehicle.empty_mass_kg, vehicle.empty_mass_kg + payload_kg
            low = min(low, 100.0 * front_kg / whole_kg)
            high = max(high, 100.0 * (front_kg + payload_kg) / whole_kg)
        return None if low == high else _widened(low, high)

    def is_out_of_range(
        self, estimator: str, payload95_kg: tuple[float, float], front_share95_pct: tuple[float, float]
    ) -> bool:
        """Whether a 95 % interval lies entirely outside the believed range, or that of the payload is wider than it.

        An interval of NaN is not outside.
        """
        low, high = self.payload_believed_kg(estimator)
        of_share = self.front_share_believed_pct(estimator)
        return (
            payload95_kg[1] - payload95_kg[0] > high - low
            or _is_outside(payload95_kg, (low, high))
            or (of_share is not None and _is_outside(front_share95_pct, of_share))
        )


def _is_outside(interval: tuple[float, float], limits: tuple[float, float]) -> bool:
    return interval[1] < limits[0] or interval[0] > limits[1]


def _widened(low: float, high: float) -> tuple[float, float]:
    margin = RANGE_MARGIN * (high - low)
    return low - margin, high + margin


_shapes = lru_cache(maxsize=8)(shape_hypotheses)
