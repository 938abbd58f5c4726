"""A drive tells what was stated falsely: a load aboard, axle weights, the wheelbase, the line, the sensor's place."""

from dataclasses import replace
from typing import Any

import pytest
from support.half_car_road import CAR, VAN
from support.known_runs import SIBLING, calibrated_on_loads, known_run

from gateway.calibration.contradicted import contradictions
from gateway.calibration.half_car.fit import fit_cross_spectrum
from gateway.calibration.known_run import KnownRun
from gateway.calibration.line.line import Line, Sister, line_of
from gateway.core.vehicle import Vehicle
from gateway.stated.doubt import Doubt, DoubtKind

OTHER_MODEL = replace(
    CAR,
    front=replace(CAR.front, spring_npm=0.7 * CAR.front.spring_npm, damper_nspm=0.8 * CAR.front.damper_nspm),
    rear=replace(CAR.rear, spring_npm=1.4 * CAR.rear.spring_npm, tyre_npm=0.8 * CAR.rear.tyre_npm),
)


@pytest.fixture(scope="module")
def line() -> Line:
    return line_of([Sister("a", VAN, calibrated_on_loads(seed=1))])


@pytest.fixture(scope="module")
def empty() -> KnownRun:
    return known_run(1, 0.0, None, seed=7, car=SIBLING)


def said_empty(run: KnownRun, vehicle: Vehicle) -> KnownRun:
    return replace(run, payload_kg=0.0, front_share_pct=vehicle.empty_front_share_pct)


def doubted(run: KnownRun, line: Line | None, **false: Any) -> tuple[Doubt, ...]:
    vehicle = replace(VAN, **false)
    claimed = said_empty(run, vehicle)
    known = None if line is None else replace(line, wheelbase_m=vehicle.wheelbase_m)
    return contradictions(
        [claimed], vehicle, fit_cross_spectrum([claimed], vehicle, inherited=known).calibration, known
    )


def kinds(doubts: tuple[Doubt, ...]) -> list[DoubtKind]:
    return [one.kind for one in doubts]


def test_true_facts_are_not_doubted(line: Line, empty: KnownRun) -> None:
    assert doubted(empty, line) == ()
    assert doubted(empty, None) == ()


def test_a_load_aboard_is_weighed_by_the_line(line: Line) -> None:
    (doubt,) = doubted(known_run(1, 300.0, 2.0, seed=8, car=SIBLING), line)
    assert doubt.kind is DoubtKind.DRIVEN_WEIGHT
    gross_kg = doubt.numbers["front_kg"] + doubt.numbers["rear_kg"]
    assert gross_kg == pytest.approx(VAN.empty_mass_kg + 300.0, abs=90.0)


def test_weights_of_another_vehicle_are_doubted(line: Line, empty: KnownRun) -> None:
    assert kinds(doubted(empty, line, empty_front_share_pct=40.0)) == [DoubtKind.DRIVEN_WEIGHT]
    assert kinds(doubted(empty, line, empty_mass_kg=1000.0)) == [DoubtKind.DRIVEN_WEIGHT]


@pytest.mark.parametrize("factor", [0.93, 1.07])
def test_a_wrong_wheelbase_is_measured(line: Line, empty: KnownRun, factor: float) -> None:
    found = {one.kind: one for one in doubted(empty, line, wheelbase_m=factor * VAN.wheelbase_m)}
    measured = found[DoubtKind.DRIVEN_WHEELBASE].numbers
    assert measured["found_m"] == pytest.approx(VAN.wheelbase_m, abs=0.06)


def test_a_sensor_elsewhere_is_found(line: Line, empty: KnownRun) -> None:
    for known in (line, None):
        (doubt,) = doubted(empty, known, sensor_position_m=2.4)
        assert doubt.kind is DoubtKind.DRIVEN_SENSOR
        assert doubt.numbers["found_m"] == pytest.approx(VAN.sensor_position_m, abs=0.1)


def test_another_model_is_not_of_the_line(line: Line) -> None:
    found = kinds(doubted(known_run(1, 0.0, None, seed=9, car=OTHER_MODEL), line))
    assert set(found) & {DoubtKind.DRIVEN_LINE, DoubtKind.DRIVEN_WEIGHT}
