"""The vehicle as calibration knows it, and the statics that follow from it."""

from dataclasses import dataclass
from typing import Final

MEASURED_OFFSET_STD_M: Final = 0.02
"""Of a sensor's place measured with a tape, from a wall or sill to its case and half the vehicle's width."""

UNKNOWN_OFFSET_STD_M: Final = 0.3
"""Of a place nobody stated: behind either end of a dashboard, beside a seat, on a wheel arch are 0.3 to 0.6 m off."""

PAYLOAD_LEFT_STD_M: Final = 0.1
"""Of a payload whose place to the side nobody noted: about the centre line, within 0.2 m of it in 95 of 100 cases.

A choice, not a measurement: a pallet 0.8 m wide has 0.2 m to either side between wheel arches 1.2 m apart.
"""

PAYLOAD_LEFT_NOTED_STD_M: Final = 0.02
"""Of a place that was noted, measured with a tape."""


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

    sensor_position_m is behind the front axle (negative: ahead of it), empty_cg_left_m the empty vehicle's centre of
    gravity left of the centre line, payload_length_m how far along the floor what it carries usually
    reaches; the ``_std`` fields say how sure these figures are. The two ranges only normalise
    errors, equation (12); they never gate.
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
    sensor_offset_left_std_m: float = UNKNOWN_OFFSET_STD_M
    track_width_m: float | None = None
    empty_cg_left_m: float = 0.0
    unsprung_front_kg: float | None = None
    unsprung_rear_kg: float | None = None
    kerb_front_axle_kg: float | None = None
    kerb_rear_axle_kg: float | None = None
    wheel_radius_m: float | None = None
    payload_length_m: float | None = None
    payload_height_m: float | None = None
    carries: str | None = None
    roof_rack: bool = False
    tow_bar: bool = False
    front_axle_limit_kg: float | None = None
    rear_axle_limit_kg: float | None = None
    gross_limit_kg: float | None = None
    front_wheel_limit_kg: float | None = None
    rear_wheel_limit_kg: float | None = None

    @property
    def empty_front_share(self) -> float:
        """0..1."""
        return self.empty_front_share_pct / 100.0


def sensor_offset_left(offset_m: float | None, std_m: float | None = None) -> tuple[float, float]:
    """The sensor's place left of the centre line and its standard deviation, from what was stated of it.

    A place with no word of how sure it is was measured with a tape; without a place it is taken amidships, unsure.
    """
    if std_m is None:
        std_m = UNKNOWN_OFFSET_STD_M if offset_m is None else MEASURED_OFFSET_STD_M
    return offset_m or 0.0, std_m


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


def cg_left_m(vehicle: Vehicle, payload_kg: float, payload_left_m: float) -> float:
    """Centre of gravity of the sprung mass left of the centre line, from where the payload's lies.

    Moments about the vehicle's long axis, with y0 and y of the empty vehicle M and of the payload L:

        y_cg = (M y0 + L y) / (M + L)
    """
    total_kg = vehicle.empty_mass_kg + payload_kg
    return (vehicle.empty_mass_kg * vehicle.empty_cg_left_m + payload_kg * payload_left_m) / total_kg


def left_share_pct(cg_left_m: float, track_width_m: float) -> float:
    """Share of the sprung weight on the left wheels, in percent, of a vehicle that stands on level ground.

    Moments about the right wheels' line of contact, with y the centre of gravity left of the centre line and w the
    track width:  F_left w = (M + L) g (w/2 + y), so that the share is 100 (1/2 + y / w).
    """
    return 50.0 + 100.0 * cg_left_m / track_width_m
