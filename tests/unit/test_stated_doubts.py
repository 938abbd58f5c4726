"""Answers that are unlikely, or that a drive contradicts: asked about, with what to do."""

from dataclasses import replace
from typing import Any

import pytest
from support.half_car_road import CAR, VAN, taught_by
from support.known_runs import LOADS, SIBLING, known_run
from support.model_road import times

from gateway.calibration.contradicted import contradictions
from gateway.calibration.fitter_answers import doubts_of
from gateway.calibration.stated_drive import StatedDrive, known_drive
from gateway.core.vehicle import Vehicle
from gateway.model.vehicle_model import VehicleModel
from gateway.stated.doubt import Doubt, DoubtKind
from gateway.stated.facts import VehicleAnswers

ANSWERED: dict[str, Any] = {
    "kerb_front_axle_kg": 713.0,
    "kerb_rear_axle_kg": 704.0,
    "wheelbase_m": 2.8,
    "sensor_position_m": 3.2,
    "sensor_offset_left_m": 0.3,
    "track_width_m": 1.5,
    "payload_range_kg": (0.0, 450.0),
    "gross_limit_kg": 1900.0,
}
OF_SISTER = {"empty_mass_kg": 1254.0, "wheelbase_m": 2.8, "track_width_m": 1.5}
SISTER = replace(VAN, kerb_front_axle_kg=700.0, kerb_rear_axle_kg=710.0, **OF_SISTER)


def asked(sister: Vehicle | None, **changes: Any) -> tuple[Doubt, ...]:
    return doubts_of(VehicleAnswers(**ANSWERED | changes), sister)


def axles(front_kg: float, rear_kg: float) -> dict[str, Any]:
    return {"kerb_front_axle_kg": front_kg, "kerb_rear_axle_kg": rear_kg}


UNLIKELY: list[tuple[dict[str, Any], DoubtKind]] = [
    ({"kerb_front_axle_kg": 71.3}, DoubtKind.MASS),
    (axles(1572.0, 1552.0), DoubtKind.MASS),  # in pounds
    (axles(404.0, 1013.0), DoubtKind.FRONT_SHARE),
    ({"wheelbase_m": 9.19}, DoubtKind.WHEELBASE),  # in feet
    ({"sensor_position_m": 12.6}, DoubtKind.SENSOR_PLACE),
    ({"sensor_offset_left_m": 1.4}, DoubtKind.SENSOR_SIDE),
    ({"track_width_m": 0.59}, DoubtKind.TRACK),
    ({"payload_range_kg": (0.0, 4500.0)}, DoubtKind.PAYLOAD),
    ({"payload_range_kg": (0.0, 600.0)}, DoubtKind.PAYLOAD_LIMIT),
    ({"gross_limit_kg": 1.9}, DoubtKind.GROSS_LIMIT),  # in tonnes
    ({"front_axle_limit_kg": 700.0}, DoubtKind.AXLE_LIMIT),
    ({"unsprung_front_kg": 400.0}, DoubtKind.UNSPRUNG),
    ({"empty_mass_kg": 1500.0, "empty_front_share_pct": 50.0}, DoubtKind.SPRUNG),
    ({"payload_length_m": 18.0}, DoubtKind.LOAD_LENGTH),
    ({"payload_height_m": 4.0}, DoubtKind.LOAD_HEIGHT),
]


@pytest.mark.parametrize(("changes", "kind"), UNLIKELY)
def test_unlikely_vehicle_figures_raise_questions(changes: dict[str, Any], kind: DoubtKind) -> None:
    assert kind in {one.kind for one in asked(None, **changes)}


@pytest.mark.parametrize(
    ("changes", "kind"),
    [
        (axles(850.0, 840.0), DoubtKind.SISTER_MASS),
        (axles(570.0, 850.0), DoubtKind.SISTER_AXLES),
        ({"track_width_m": 1.7}, DoubtKind.SISTER_TRACK),
    ],
)
def test_figures_unlike_the_sisters_raise_questions(changes: dict[str, Any], kind: DoubtKind) -> None:
    of_gross = {"gross_limit_kg": None}
    assert [one.kind for one in asked(SISTER, **changes | of_gross)] == [kind]
    assert asked(None, **changes | of_gross) == ()


@pytest.mark.parametrize("sister", [None, SISTER], ids=["no sister", "a sister"])
@pytest.mark.parametrize(
    "changes",
    [{}, {"kerb_front_axle_kg": 740.0}, {"sensor_position_m": -0.6}, {"sensor_offset_left_m": -0.7}],
)
def test_figures_of_a_real_van_raise_no_question(sister: Vehicle | None, changes: dict[str, Any]) -> None:
    assert asked(sister, **changes) == ()


@pytest.mark.parametrize(
    ("front_kg", "rear_kg", "wheelbase_m"),
    [
        (380.0, 500.0, 1.87),  # a city car, its engine behind
        (800.0, 500.0, 2.62),
        (1250.0, 1150.0, 2.59),
        (1350.0, 1050.0, 4.33),
        (1950.0, 2150.0, 3.44),
        (2400.0, 1600.0, 4.2),
        (4600.0, 3400.0, 6.0),
    ],
)
def test_cars_vans_and_trucks_pass(front_kg: float, rear_kg: float, wheelbase_m: float) -> None:
    said = axles(front_kg, rear_kg) | {"wheelbase_m": wheelbase_m, "sensor_position_m": 1.0}
    assert doubts_of(VehicleAnswers(**said)) == ()


def test_a_doubt_says_what_is_usual_and_what_to_do() -> None:
    (first, *_) = asked(None, kerb_front_axle_kg=71.3)
    assert first.text == "775 kg empty on a wheelbase of 2.8 m: such vehicles weigh 862 to 2979 kg"
    assert first.sentence.endswith(": read the ticket of the scales again, axle by axle, in kilograms")


OTHER_MODEL = times(CAR, spring_front_npm=0.7, damper_front_nspm=0.8, spring_rear_npm=1.4, tyre_rear_npm=0.8)


@pytest.fixture(scope="module")
def sister() -> VehicleModel:
    return taught_by([known_run(i, *load, seed=1) for i, load in enumerate(LOADS)], VAN)


@pytest.fixture(scope="module")
def empty() -> StatedDrive:
    return known_run(1, 0.0, None, seed=7, car=SIBLING)


def doubted(run: StatedDrive, sister: VehicleModel | None, **false: Any) -> tuple[Doubt, ...]:
    """What contradicts these facts after a drive that is said to be empty."""
    vehicle = replace(VAN, **false)
    claimed = known_drive(1, "1.log", 0.0, vehicle.empty_front_share_pct, run.batches)
    return contradictions([claimed], vehicle, taught_by([claimed], vehicle, sister), sister)


def test_true_facts_are_not_doubted(sister: VehicleModel, empty: StatedDrive) -> None:
    assert doubted(empty, sister) == ()
    assert doubted(empty, None) == ()


def test_a_load_aboard_is_weighed_by_the_sister(sister: VehicleModel) -> None:
    (doubt,) = doubted(known_run(1, 300.0, 2.0, seed=8, car=SIBLING), sister)
    assert doubt.kind is DoubtKind.DRIVEN_WEIGHT
    gross_kg = doubt.numbers["front_kg"] + doubt.numbers["rear_kg"]
    assert gross_kg == pytest.approx(VAN.empty_mass_kg + 300.0, abs=90.0)


NEAR_WHEELBASE = pytest.approx(VAN.wheelbase_m, abs=0.06)
NEAR_SENSOR = pytest.approx(VAN.sensor_position_m, abs=0.1)


@pytest.mark.parametrize(
    ("false", "kind", "found_m", "has_sister"),
    [
        ({"empty_front_share_pct": 40.0}, DoubtKind.DRIVEN_WEIGHT, None, True),
        ({"empty_mass_kg": 1000.0}, DoubtKind.DRIVEN_WEIGHT, None, True),
        ({"wheelbase_m": 0.93 * VAN.wheelbase_m}, DoubtKind.DRIVEN_WHEELBASE, NEAR_WHEELBASE, True),
        ({"wheelbase_m": 1.07 * VAN.wheelbase_m}, DoubtKind.DRIVEN_WHEELBASE, NEAR_WHEELBASE, True),
        ({"sensor_position_m": 2.4}, DoubtKind.DRIVEN_SENSOR, NEAR_SENSOR, True),
        ({"sensor_position_m": 2.4}, DoubtKind.DRIVEN_SENSOR, NEAR_SENSOR, False),
    ],
)
def test_false_facts_are_doubted_and_places_measured(
    sister: VehicleModel, empty: StatedDrive, false: dict[str, float], kind: DoubtKind, found_m: Any, has_sister: bool
) -> None:
    found = {one.kind: one for one in doubted(empty, sister if has_sister else None, **false)}
    assert found[kind].numbers.get("found_m") == found_m
    assert list(found) == [kind] or kind is DoubtKind.DRIVEN_WHEELBASE  # a wrong wheelbase bends much else


def test_another_model_is_distinguished_from_a_sister(sister: VehicleModel) -> None:
    found = {one.kind for one in doubted(known_run(1, 0.0, None, seed=9, car=OTHER_MODEL), sister)}
    assert found & {DoubtKind.DRIVEN_SISTER, DoubtKind.DRIVEN_WEIGHT}
