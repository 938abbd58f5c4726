"""The roll rate's sign is told by a sensor or loads well off the centre line, and by nothing else."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support.inspected import driven, kinds, scaled, stated, traits_of_reference

from gateway.calibration.inspection.across_runs import inspect_drives
from gateway.calibration.inspection.facts import InspectedRun, row_facts
from gateway.calibration.inspection.roll import roll_sign_of
from gateway.calibration.stated_drive import known_drive
from gateway.core.batch_settings import BatchSettings
from gateway.core.scheduler import Scheduler
from gateway.core.vehicle import UNKNOWN_OFFSET_STD_M, Vehicle, front_share_pct
from gateway.records import Motion
from gateway.sim.parameters import Load
from gateway.sim.speed_profile import constant
from gateway.sim.vans import PAPER_VAN, VANS

REAR_M = 3.2
SETTINGS = BatchSettings(window_s=120.0)
LOADS = ((0.0, None), (400.0, 0.4), (400.0, -0.4))  # payload, metres left of the centre line
PLACED = replace(stated(PAPER_VAN, REAR_M), sensor_offset_left_m=0.35, sensor_offset_left_std_m=0.02)
SOMEWHERE = replace(PLACED, sensor_offset_left_m=0.0, sensor_offset_left_std_m=UNKNOWN_OFFSET_STD_M)


@cache
def drive(van: str, payload_kg: float, left_m: float | None, sensor_left_m: float) -> Motion:
    load = Load(payload_kg, 0.5 * VANS[van].wheelbase_m, left_m or 0.0) if payload_kg else None
    steady = constant(14.0, 130.0, np.random.default_rng(1))
    return driven(VANS[van], steady, REAR_M, load, left_m=sensor_left_m)


def runs(
    vehicle: Vehicle,
    *loads: tuple[float, float | None],
    sensor_left_m: float = 0.35,
    roll_times: float = 1.0,
    are_places_noted: bool = True,
) -> list[InspectedRun]:
    split = []
    for number, (payload_kg, left_m) in enumerate(loads, 1):
        motion = scaled(drive(vehicle.name, payload_kg, left_m, sensor_left_m), roll_rate=roll_times)
        scheduler = Scheduler(SETTINGS, traits_of_reference())
        batches = (*scheduler.feed(motion), *scheduler.flush())
        share_pct = front_share_pct(vehicle, payload_kg, 0.5 * vehicle.wheelbase_m)
        noted_m = left_m if are_places_noted else None
        run = known_drive(number, f"{number}.log", payload_kg, share_pct, batches, noted_m)
        split.append(InspectedRun(run, facts=row_facts(motion, traits_of_reference())))
    return split


def told(vehicle: Vehicle, split: list[InspectedRun]) -> int:
    found = roll_sign_of([one.identification for one in split], vehicle)
    assert found.why
    return found.sign


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("name", VANS)
@pytest.mark.parametrize("sensor_left_m", [0.35, -0.35])
def test_a_sensor_off_the_centre_line_shows_the_roll_sign(name: str, sensor_left_m: float, sign: int) -> None:
    vehicle = stated(VANS[name], REAR_M)
    placed = replace(vehicle, sensor_offset_left_m=sensor_left_m, sensor_offset_left_std_m=0.02)
    split = runs(placed, (0.0, None), sensor_left_m=sensor_left_m, roll_times=float(sign))
    assert told(placed, split) == sign
    assert told(vehicle, split) == 0


@pytest.mark.parametrize("sign", [1, -1])
def test_lateral_loads_show_the_roll_sign(sign: int) -> None:
    amidships = runs(SOMEWHERE, *LOADS, sensor_left_m=0.0, roll_times=float(sign))
    assert told(SOMEWHERE, amidships) == sign
    assert told(SOMEWHERE, runs(SOMEWHERE, *LOADS, roll_times=float(sign))) == sign


def test_a_place_stated_on_the_wrong_side_contradicts_the_loads() -> None:
    other_side = replace(PLACED, sensor_offset_left_m=-0.35)
    found = roll_sign_of([one.identification for one in runs(PLACED, *LOADS)], other_side)
    assert found.sign == 0
    assert "one of them is stated wrong" in found.why


def test_every_run_reports_a_reversed_roll_sign() -> None:
    inspection = inspect_drives(runs(PLACED, *LOADS[:2], roll_times=-1.0), PLACED, SETTINGS)
    assert [kinds(verdict) for verdict in inspection.runs] == [["fault:roll_rate_sign"]] * 2
    assert "roll_rate_sign_untold" not in [finding.kind for finding in inspection.findings]


def test_an_undetermined_roll_sign_is_one_note_for_all_runs() -> None:
    inspection = inspect_drives(runs(SOMEWHERE, LOADS[0]), SOMEWHERE, SETTINGS)
    assert [kinds(verdict) for verdict in inspection.runs] == [[]]
    assert [f"{one.severity}:{one.kind}" for one in inspection.findings if "roll" in one.kind] == [
        "note:roll_rate_sign_untold"
    ]
    assert "0 ± 0.59 m left of the centre line" in str(inspection.findings)


def test_without_a_roll_rate_there_are_no_roll_findings() -> None:
    (one,) = runs(SOMEWHERE, LOADS[0])
    batches = tuple(replace(batch, roll_rate_radps=None) for batch in one.identification.batches)
    assert roll_sign_of([replace(one.identification, batches=batches)], PLACED) is None
