"""The vehicle as the campaign states it, and its statics."""

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Annotated, Final, NamedTuple

from annotated_types import Interval

from gateway.metadata import STRICT, described

MEASURED_OFFSET_STD_M: Final = 0.02
"""Chosen: a sensor's place measured with a tape, from a wall or sill to its case, and half the vehicle's width."""

UNKNOWN_OFFSET_STD_M: Final = 0.3
"""Of a place nobody stated: behind either end of a dashboard, beside a seat, on a wheel arch are 0.3 to 0.6 m off."""

PAYLOAD_LEFT_STD_M: Final = 0.1
"""Of a payload whose place to the side nobody noted: about the centre line, within 0.2 m of it in 95 of 100 cases.

A choice, not a measurement: a pallet 0.8 m wide has 0.2 m to either side between wheel arches 1.2 m apart.
"""

USEFUL_SHARE: Final = 0.25  # chosen: of the range, half the 95 % interval of a weighing that is of use
LEAST_RANGE_SHARE: Final = 0.33  # chosen: of the empty mass, what any vehicle may carry
PAYLOAD_LEFT_NOTED_STD_M: Final = 0.02
"""Chosen: a noted place of the payload, measured with a tape."""


class Load(NamedTuple):
    """A payload and the resulting front share of the sprung mass.

    The share is in percent, as people state it and files hold it; the half-car's formulas take ``front_share``, 0..1.
    Only the two properties of this module with that name convert between the two.
    """

    payload_kg: float
    front_share_pct: float

    @property
    def front_share(self) -> float:
        """0..1."""
        return self.front_share_pct / 100.0


class Carries(StrEnum):
    """The usual goods, as the fitter states them."""

    PALLETS = "pallets"
    PARCELS = "parcels"
    LONG_GOODS = "long_goods"
    TOOLS = "tools"
    MIXED = "mixed"


Kilograms = Annotated[float, Interval(ge=0.0, le=100_000.0)]
Percent = Annotated[float, Interval(ge=1.0, le=99.0)]
Metres = Annotated[float, Interval(ge=-10.0, le=30.0)]
MetresLeft = Annotated[float, Interval(ge=-2.0, le=2.0)]
WeightKg = Annotated[float, Interval(gt=0.0, le=100_000.0)]


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleFields:
    """The fields that a vehicle shares with the answers about it, each with its description and bounds.

    Campaign file, calibration file, web and pages derive from the metadata, which uses pydantic's constraints. The
    bounds exclude any road vehicle, so that fractions for percent, millimetres or tonnes are rejected at once.
    """

    __pydantic_config__ = STRICT

    name: str = field(
        metadata=described("name of the vehicle; the calibration file and its report show it", min_length=1)
    )
    wheelbase_m: float = field(metadata=described("from axle to axle: l", ge=0.8, le=20.0, examples=[2.75]))
    sensor_position_m: Metres = field(
        metadata=described("the sensor's, behind the front axle; negative: ahead of it", examples=[1.2])
    )
    sensor_position_std_m: float = field(
        default=0.1,
        metadata=described(
            "standard deviation of the sensor's position; the fit may move it accordingly", ge=1e-3, le=10.0
        ),
    )
    sensor_offset_left_m: MetresLeft | None = field(
        default=None,
        metadata=described("of the sensor, left of the centre line, negative: right of it; absent: not known"),
    )
    sensor_offset_left_std_m: float | None = field(
        default=None,
        metadata=described(
            f"standard deviation of that; absent: {MEASURED_OFFSET_STD_M:g} with an offset, by tape, "
            f"{UNKNOWN_OFFSET_STD_M:g} without one",
            ge=1e-3,
            le=2.0,
        ),
    )
    track_width_m: float | None = field(
        default=None,
        metadata=described(
            "between the middles of left and right tyres; weights of single wheels and a roll rate need it",
            ge=0.5,
            le=4.0,
        ),
    )
    empty_cg_left_m: MetresLeft = field(
        default=0.0,
        metadata=described("centre of gravity of the empty vehicle with driver, left of the centre line"),
    )
    unsprung_front_kg: WeightKg | None = field(
        default=None,
        metadata=described("front axle, wheels and brakes; taken as known to 10 %; absent: found by calibration"),
    )
    unsprung_rear_kg: WeightKg | None = field(default=None, metadata=described("the same at the rear"))
    carries: Carries | None = field(
        default=None,
        metadata=described(
            "what it usually carries: `pallets`, `parcels` (all over the floor), `long_goods`, `tools` (in racks) or "
            "`mixed`; absent: anything, often as compact as the known loads, with intervals that allow for it",
            examples=["parcels"],
        ),
    )
    payload_length_m: float | None = field(
        default=None,
        metadata=described(
            "usual length of the load along the floor, if you know it better than `carries` says: 1.2 for a pallet, "
            "the floor's length for parcels",
            ge=0.1,
            le=20.0,
            examples=[2.4],
        ),
    )
    payload_height_m: float | None = field(
        default=None,
        metadata=described("usual height of the load above the floor", ge=0.05, le=5.0, examples=[1.2]),
    )
    loading_area_m: tuple[Metres, Metres] | None = field(
        default=None,
        metadata=described(
            "where its load may lie, from the front end of the loading area to its rear end, behind the front axle, "
            "rising; tells how much more may go in; absent: 0.35 to 1.25 wheelbases",
            examples=[[1.2, 3.1]],
        ),
    )
    roof_rack: bool = field(default=False, metadata=described("part of the load may be on the roof"))
    tow_bar: bool = field(
        default=False, metadata=described("part of the load may be on a tow bar: a carrier, a trailer's tongue")
    )
    front_axle_limit_kg: WeightKg | None = field(default=None, metadata=described("permitted load of the front axle"))
    rear_axle_limit_kg: WeightKg | None = field(default=None, metadata=described("permitted load of the rear axle"))
    gross_limit_kg: WeightKg | None = field(default=None, metadata=described("permitted gross weight"))
    front_wheel_limit_kg: WeightKg | None = field(
        default=None, metadata=described("permitted load of each front wheel or its tyre, both of twin tyres")
    )
    rear_wheel_limit_kg: WeightKg | None = field(default=None, metadata=described("the same at the rear"))


@dataclass(frozen=True, slots=True, kw_only=True)
class Vehicle(VehicleFields):
    """A vehicle as its campaign file states it. Masses and shares are of the sprung mass.

    The two ranges only normalise errors, equation (12); they never gate.
    """

    empty_mass_kg: float = field(
        metadata=described("sprung mass of the empty vehicle, driver and tank as in service: M", ge=100.0, le=100_000.0)
    )
    empty_front_share_pct: Percent = field(
        default=50.0, metadata=described("share of `empty_mass_kg` that rests on the front axle")
    )
    empty_front_share_std_pct: float = field(
        default=0.5,
        metadata=described(
            "standard deviation of the front share, in percentage points; front shares and axle loads are no more "
            "precise",
            gt=0.0,
            le=50.0,
        ),
    )
    payload_range_kg: tuple[Kilograms, Kilograms] = field(
        default=(0.0, 450.0),
        metadata=described(
            "payloads the vehicle may carry, rising; scales percentages, never clips; absent: up to `gross_limit_kg`, "
            "if it and the axle weights are stated"
        ),
    )
    front_share_range_pct: tuple[Percent, Percent] = field(
        default=(40.0, 60.0),
        metadata=described("front shares it may have, rising; scales percentages, never clips"),
    )
    kerb_front_axle_kg: WeightKg | None = field(
        default=None,
        metadata=described("scale reading under the empty vehicle's front axle, for weights on the road"),
    )
    kerb_rear_axle_kg: WeightKg | None = field(default=None, metadata=described("the same at the rear"))
    wheel_radius_m: float | None = field(
        default=None, metadata=described("kept in the calibration file, not used", gt=0.0)
    )

    def __post_init__(self) -> None:
        for name in ("payload_range_kg", "front_share_range_pct"):
            low, high = getattr(self, name)
            if low >= high:
                raise ValueError(f"{name} must rise: [low, high]")
        if self.loading_area_m is not None and self.loading_area_m[0] >= self.loading_area_m[1]:
            raise ValueError("loading_area_m must rise: [front end, rear end]")

    @property
    def empty_front_share(self) -> float:
        """0..1."""
        return self.empty_front_share_pct / 100.0

    @property
    def largest_payload_kg(self) -> float:
        """The payload it may carry: the end of its range, but no less than any vehicle can."""
        return max(self.payload_range_kg[1], LEAST_RANGE_SHARE * self.empty_mass_kg)

    @property
    def useful_half_width_kg(self) -> float:
        """Half the 95 % interval from which on a weighing is of use."""
        return USEFUL_SHARE * (self.payload_range_kg[1] - self.payload_range_kg[0])

    @property
    def sensor_left_m(self) -> float:
        """The sensor's place left of the centre line; 0 if nobody stated it."""
        return self.sensor_offset_left_m or 0.0

    @property
    def sensor_left_std_m(self) -> float:
        """Standard deviation of that place: as stated, else that of a tape measure, else that of an unknown place."""
        if self.sensor_offset_left_std_m is not None:
            return self.sensor_offset_left_std_m
        return UNKNOWN_OFFSET_STD_M if self.sensor_offset_left_m is None else MEASURED_OFFSET_STD_M


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
    """d that gives ``share_pct`` with ``payload_kg`` on board: the inverse of :func:`front_share_pct`.

    Raises ZeroDivisionError without payload, where the share determines no position.
    """
    total_kg = vehicle.empty_mass_kg + payload_kg
    front_kg = share_pct / 100.0 * total_kg - vehicle.empty_front_share * vehicle.empty_mass_kg
    return vehicle.wheelbase_m * (1.0 - front_kg / payload_kg)


def cg_left_m(vehicle: Vehicle, payload_kg: float, payload_left_m: float) -> float:
    """Centre of gravity of the sprung mass, metres left of the centre line, from that of the payload.

    Moments about the vehicle's long axis, with y0 and y of the empty vehicle M and of the payload L:

        y_cg = (M y0 + L y) / (M + L)
    """
    total_kg = vehicle.empty_mass_kg + payload_kg
    return (vehicle.empty_mass_kg * vehicle.empty_cg_left_m + payload_kg * payload_left_m) / total_kg


def left_share_pct(cg_left_m: float, track_width_m: float) -> float:
    """Share of the sprung weight on the left wheels, in percent, for a vehicle on level ground.

    Moments about the right wheels' contact line, with y the centre of gravity left of the centre line and w the track
    width: F_left w = (M + L) g (w/2 + y), so the share is 100 (1/2 + y / w).
    """
    return 50.0 + 100.0 * cg_left_m / track_width_m
