"""The vehicle as calibration knows it, and the statics that follow from it."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Load:
    """A payload and the front share that it gives the sprung mass.

    The share is in percent, as people state it and files hold it; the half-car's formulas take ``front_share``,
    0..1. The two properties of this module by that name are where one becomes the other.
    """

    payload_kg: float
    front_share_pct: float

    @property
    def front_share(self) -> float:
        """0..1."""
        return self.front_share_pct / 100.0


@dataclass(frozen=True, slots=True)
class Vehicle:
    """What a fitter states of a vehicle. Masses and shares are of the sprung mass.

    sensor_position_m is behind the front axle (negative: ahead of it); the ``_std`` fields say how
    sure these figures are. The two ranges only normalise errors, equation (12); they never gate.
    """

    name: str
    empty_mass_kg: float
    wheelbase_m: float
    empty_front_share_pct: float = 50.0
    sensor_position_m: float = 0.0
    payload_range_kg: tuple[float, float] = (0.0, 450.0)
    front_share_range_pct: tuple[float, float] = (40.0, 60.0)
    sensor_position_std_m: float = 0.1
    empty_front_share_std_pct: float = 0.5
    sensor_offset_left_m: float = 0.0
    unsprung_front_kg: float | None = None
    unsprung_rear_kg: float | None = None
    kerb_front_axle_kg: float | None = None
    kerb_rear_axle_kg: float | None = None
    wheel_radius_m: float | None = None
    front_axle_limit_kg: float | None = None
    rear_axle_limit_kg: float | None = None
    gross_limit_kg: float | None = None

    @property
    def empty_front_share(self) -> float:
        """0..1."""
        return self.empty_front_share_pct / 100.0


def front_share_pct(vehicle: Vehicle, payload_kg: float, position_m: float | None) -> float:
    """Share of the sprung mass M + L on the front axle, in percent.

    D = 100 (s M + (1 - d/l) L) / (M + L), with s the empty front share: the general form of
    equation (3) of Bottelli et al., which is the case s = 1/2. ``position_m`` is d, the payload's
    centre of gravity behind the front axle; it does not matter, and may be None, without payload.
    """
    if payload_kg == 0.0 or position_m is None:
        return vehicle.empty_front_share_pct
    empty_front_kg = vehicle.empty_front_share * vehicle.empty_mass_kg
    front_kg = empty_front_kg + (1.0 - position_m / vehicle.wheelbase_m) * payload_kg
    return 100.0 * front_kg / (vehicle.empty_mass_kg + payload_kg)


def payload_position_m(vehicle: Vehicle, payload_kg: float, share_pct: float) -> float:
    """d that gives ``share_pct`` with ``payload_kg`` aboard: the inverse of :func:`front_share_pct`.

    Raises ZeroDivisionError without payload, where no position follows from the share.
    """
    total_kg = vehicle.empty_mass_kg + payload_kg
    front_kg = share_pct / 100.0 * total_kg - vehicle.empty_front_share * vehicle.empty_mass_kg
    return vehicle.wheelbase_m * (1.0 - front_kg / payload_kg)
