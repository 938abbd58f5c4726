"""A fitter's answers: questions about those that are unlikely, and the vehicle of a campaign that follows from them.

    doubts_of(answers, sister) -> questions; doubts_of_vehicle(vehicle, sister) likewise
    vehicle_table(answers, name) -> the vehicle

The questions compare the answers with ordinary road vehicles, and with a sister of its model. They use no drive;
``gateway.calibration.contradicted`` compares the same answers with a drive.
"""

from collections.abc import Iterator
from dataclasses import asdict, fields
from math import inf
from typing import Any, Final

from pydantic import TypeAdapter, ValidationError

from gateway.calibration.axle_weights import sprung_keys
from gateway.core.vehicle import Vehicle
from gateway.errors import CampaignError
from gateway.files.toml_file import describe_faults
from gateway.stated.doubt import Doubt, DoubtKind
from gateway.stated.facts import VehicleAnswers

# Ordinary figures of vehicles with two axles. Chosen so that makers' figures of these lie inside: Smart fortwo 1.87 m
# and 880 kg, Fiat 500, VW Golf 2.62 m and 1300 kg, Land Rover Defender 2.59 m and 2400 kg, VW Caddy, Ford Transit,
# Mercedes Sprinter 4.33 m and 2400 kg, Hummer EV 3.44 m and 4100 kg, trucks of 7.5 t (4.2 m, 4 t) and 18 t (6 m, 8 t),
# coaches.
WHEELBASE_M: Final = (1.6, 7.5)
MASS_PER_WHEELBASE2: Final = (110.0, 380.0)  # kg/m2, empty, driver and tank as in service
FRONT_SHARE_PCT: Final = (36.0, 70.0)  # empty: 38 with the engine behind the rear axle, up to 65 in a van
TRACK_M: Final = (1.15, 2.2)  # a microcar's to a truck's
MOST_AHEAD_M: Final = 1.5  # a sensor ahead of the front axle: a long front overhang
MOST_BEHIND: Final = 1.75  # wheelbases behind the front axle: a long rear overhang
PAYLOAD_SHARE: Final = (0.05, 2.0)  # of the empty vehicle; a truck of 18 t carries 1.3 times its own weight
MOST_LENGTH: Final = 1.6  # wheelbases; the floor of a van with a long overhang has 1.3
MOST_HEIGHT_M: Final = 3.0  # above the floor: 4 m is the legal height
UNSPRUNG_SHARE: Final = (0.025, 0.15)  # of the empty vehicle, one axle's wheels, brakes and half its links
LEAST_SPRUNG: Final = 0.75  # of the empty vehicle

# Figures that vehicles of one model share; shelves and a tail lift account for a tenth. Chosen.
MOST_MASS_OFF: Final = 0.12
MOST_AXLE_OFF: Final = 0.18  # chosen: shelves and a tail lift act mostly on one axle
MOST_TRACK_OFF: Final = 0.05  # chosen: other wheels
GROSS_ROUNDED: Final = 1.005  # papers round; of the sum of the axles' limits, which is the most
MOST_LIMIT: Final = 5.0  # times what is there empty: the rear axle of a truck


def doubts_of(said: VehicleAnswers, sister: Vehicle | None = None) -> tuple[Doubt, ...]:
    """Unlikely answers."""
    return (*_doubts(said), *(_beside(sister, said) if sister else ()))


def doubts_of_vehicle(vehicle: Vehicle, sister: Vehicle | None = None) -> tuple[Doubt, ...]:
    """Unlikely figures of a vehicle whose axle weights are stated; none of another one."""
    if vehicle.kerb_front_axle_kg is None or vehicle.kerb_rear_axle_kg is None:
        return ()
    names = {one.name for one in fields(VehicleAnswers)} - {"division_kg"}
    return doubts_of(VehicleAnswers(**{name: getattr(vehicle, name) for name in names}), sister)


def _outside(
    kind: DoubtKind, number: float | None, span: tuple[float, float], unit: str = "", /, **numbers: Any
) -> Iterator[Doubt]:
    """A doubt of a number outside its usual span, whose ends it names if they have a ``unit``."""
    if number is not None and not span[0] <= number <= span[1]:
        ends = {f"low_{unit}": span[0], f"high_{unit}": span[1]} if unit else {}
        yield Doubt.of(kind, **numbers, **ends)


def _doubts(said: VehicleAnswers) -> Iterator[Doubt]:
    """What ordinary vehicles are not like."""
    front_kg, rear_kg, wheelbase_m = said.kerb_front_axle_kg, said.kerb_rear_axle_kg, said.wheelbase_m
    gross_kg, front_pct = front_kg + rear_kg, 100.0 * front_kg / (front_kg + rear_kg)
    low, high = (one * wheelbase_m**2 for one in MASS_PER_WHEELBASE2)
    yield from _outside(DoubtKind.WHEELBASE, wheelbase_m, WHEELBASE_M, "m", wheelbase_m=wheelbase_m)
    yield from _outside(DoubtKind.MASS, gross_kg, (low, high), "kg", gross_kg=gross_kg, wheelbase_m=wheelbase_m)
    yield from _outside(DoubtKind.FRONT_SHARE, front_pct, FRONT_SHARE_PCT, "pct", front_pct=front_pct)

    sensor_m, track_m, left_m = said.sensor_position_m, said.track_width_m, said.sensor_offset_left_m
    along_m, across_m = (-MOST_AHEAD_M, MOST_BEHIND * wheelbase_m), 0.6 * (track_m or TRACK_M[1])
    yield from _outside(DoubtKind.SENSOR_PLACE, sensor_m, along_m, sensor_m=sensor_m, wheelbase_m=wheelbase_m)
    yield from _outside(DoubtKind.TRACK, track_m, TRACK_M, "m", track_m=track_m)
    yield from _outside(DoubtKind.SENSOR_SIDE, left_m, (-across_m, across_m), sensor_m=left_m)

    low, high = (share * gross_kg for share in UNSPRUNG_SHARE)
    for unsprung_kg in (said.unsprung_front_kg, said.unsprung_rear_kg):
        yield from _outside(DoubtKind.UNSPRUNG, unsprung_kg, (low, high), "kg", unsprung_kg=unsprung_kg)
    sprung_kg, limit_kg = said.empty_mass_kg, said.gross_limit_kg
    if sprung_kg is not None and not LEAST_SPRUNG * gross_kg <= sprung_kg < gross_kg:
        yield Doubt.of(DoubtKind.SPRUNG, sprung_kg=sprung_kg, gross_kg=gross_kg)

    payload_kg = said.payload_range_kg[1] if said.payload_range_kg else None
    low, high = (share * gross_kg for share in PAYLOAD_SHARE)
    yield from _outside(DoubtKind.PAYLOAD, payload_kg, (low, high), payload_kg=payload_kg, gross_kg=gross_kg)
    if payload_kg and limit_kg and low <= payload_kg <= high:
        sum_kg, most_kg = gross_kg + payload_kg, GROSS_ROUNDED * limit_kg
        numbers = {"gross_kg": gross_kg, "payload_kg": payload_kg, "sum_kg": sum_kg, "limit_kg": limit_kg}
        yield from _outside(DoubtKind.PAYLOAD_LIMIT, sum_kg, (-inf, most_kg), **numbers)
    length_m, height_m, longest_m = said.payload_length_m, said.payload_height_m, MOST_LENGTH * wheelbase_m
    yield from _outside(DoubtKind.LOAD_LENGTH, length_m, (0.0, longest_m), length_m=length_m, wheelbase_m=wheelbase_m)
    yield from _outside(DoubtKind.LOAD_HEIGHT, height_m, (0.0, MOST_HEIGHT_M), height_m=height_m)

    axles = ((front_kg, said.front_axle_limit_kg), (rear_kg, said.rear_axle_limit_kg))
    for axle_kg, permitted_kg in axles:
        if permitted_kg is not None and not axle_kg < permitted_kg <= MOST_LIMIT * axle_kg:
            yield Doubt.of(DoubtKind.AXLE_LIMIT, limit_kg=permitted_kg, axle_kg=axle_kg)
    most_kg = min(GROSS_ROUNDED * sum(kg or inf for _, kg in axles), MOST_LIMIT * gross_kg)
    if limit_kg is not None and not gross_kg < limit_kg <= most_kg:
        yield Doubt.of(DoubtKind.GROSS_LIMIT, limit_kg=limit_kg, gross_kg=gross_kg)


def _beside(sister: Vehicle, said: VehicleAnswers) -> Iterator[Doubt]:
    """What its sister is not like."""
    front_kg, rear_kg, her_kg = said.kerb_front_axle_kg, said.kerb_rear_axle_kg, sister.empty_mass_kg
    gross_kg, sprung_kg = front_kg + rear_kg, said.empty_mass_kg
    if sprung_kg is None:
        try:
            sprung_kg = sprung_keys(*_axle_weights(said))["empty_mass_kg"]
        except CampaignError:  # the axle weights leave no body, which ``vehicle_table`` refuses
            sprung_kg = her_kg
    her_front_kg, her_rear_kg = sister.kerb_front_axle_kg, sister.kerb_rear_axle_kg
    if abs(sprung_kg - her_kg) > MOST_MASS_OFF * her_kg:
        yield Doubt.of(DoubtKind.SISTER_MASS, gross_kg=gross_kg, sister_kg=gross_kg * her_kg / sprung_kg)
    elif her_front_kg and her_rear_kg:
        off = max(abs(front_kg / her_front_kg - 1.0), abs(rear_kg / her_rear_kg - 1.0))
        numbers = {"front_kg": front_kg, "rear_kg": rear_kg}
        numbers |= {"sister_front_kg": her_front_kg, "sister_rear_kg": her_rear_kg}
        yield from _outside(DoubtKind.SISTER_AXLES, off, (0.0, MOST_AXLE_OFF), **numbers)
    if said.track_width_m and sister.track_width_m:
        off = abs(said.track_width_m / sister.track_width_m - 1.0)
        numbers = {"track_m": said.track_width_m, "sister_m": sister.track_width_m}
        yield from _outside(DoubtKind.SISTER_TRACK, off, (0.0, MOST_TRACK_OFF), **numbers)


_SHARED: Final = (
    "loading_area_m",
    "track_width_m",
    "payload_range_kg",
    "front_share_range_pct",
    "gross_limit_kg",
    "front_axle_limit_kg",
    "rear_axle_limit_kg",
    "front_wheel_limit_kg",
    "rear_wheel_limit_kg",
)
"""Figures that vehicles of one model share: a sister's are used unless others are stated."""

_VEHICLE: Final = TypeAdapter(Vehicle)


def vehicle_table(said: VehicleAnswers, name: str, sister: Vehicle | None = None) -> Vehicle:
    """[vehicle] of a campaign; ``name`` if none was typed. Raises CampaignError in words for people."""
    if (said.empty_mass_kg is None) != (said.empty_front_share_pct is None):
        raise CampaignError("empty_mass_kg and empty_front_share_pct belong together: give both or neither")
    typed = {name: answer for name, answer in asdict(said).items() if answer is not None and name != "division_kg"}
    try:
        sprung = sprung_keys(*_axle_weights(said), said.division_kg)
        shared = {key: known for key in _SHARED if sister and (known := getattr(sister, key)) is not None}
        named = {"name": said.name.strip() or name}
        return _VEHICLE.validate_python(sprung | shared | typed | named)
    except ValidationError as fault:
        raise CampaignError(describe_faults("the vehicle that follows", fault, Vehicle)) from None


def _axle_weights(said: VehicleAnswers) -> tuple[float, float, float | None, float | None]:
    return (said.kerb_front_axle_kg, said.kerb_rear_axle_kg, said.unsprung_front_kg, said.unsprung_rear_kg)
