"""Runs are compared with each other: loads that teach, comparable speeds and roads, labels that agree."""

from dataclasses import replace

import pytest
from support.half_car_road import VAN, batch_over_road
from support.known_runs import LOADS, campaign, known_run

from gateway.calibration.inspection.across_runs import Inspection, inspect_drives, load_findings
from gateway.calibration.inspection.facts import InspectedRun
from gateway.calibration.inspection.finding import Finding, Kind
from gateway.calibration.stated_drive import StatedDrive, known_drive
from gateway.core.batch_settings import BatchSettings

SETTINGS = BatchSettings(window_s=200.0)


def labelled(*loads: tuple[float, float]) -> list[StatedDrive]:
    """Runs with these payloads and shares and nothing driven."""
    return [known_drive(number, "a.log", payload, share, ()) for number, (payload, share) in enumerate(loads, 1)]


@pytest.mark.parametrize(
    ("loads", "expected"),
    [
        ([(0.0, 52.0), (200.0, 48.0), (400.0, 55.0)], []),
        ([(0.0, 52.0), (0.0, 52.0)], [Kind.ONE_LOAD_ONLY]),
        ([(0.0, 52.0), (40.0, 50.0)], [Kind.LOADS_ALIKE]),
        ([(0.0, 52.0), (200.0, 52.3), (400.0, 51.8)], [Kind.SHARES_ALIKE]),
        ([(0.0, 52.0), (200.0, 48.0), (400.0, 44.5)], [Kind.LOAD_AND_SHARE_TOGETHER]),
        ([(0.0, 52.0), (400.0, 44.0)], []),
        ([], []),
    ],
)
def test_loads_that_teach_too_little_are_named(loads: list[tuple[float, float]], expected: list[Kind]) -> None:
    assert [finding.kind for finding in load_findings(labelled(*loads), VAN)] == expected


@pytest.fixture(scope="module")
def runs() -> list[StatedDrive]:
    return [known_run(number, *load, seed=7) for number, load in enumerate(LOADS, 1)]


def inspected(run: StatedDrive) -> InspectedRun:
    return InspectedRun(run)


def test_a_run_at_another_speed_is_noted_and_one_on_a_far_smoother_road_warned_of(runs: list[StatedDrive]) -> None:
    share_pct = runs[0].front_share_pct
    fast = replace(runs[0], number=5, batches=(batch_over_road(0.0, share_pct, 3, 200.0, speed_mps=20.0),))
    (batch,) = runs[0].batches
    quiet = replace(
        batch,
        vertical_acceleration_mps2=batch.vertical_acceleration_mps2 / 6.0,
        pitch_rate_radps=batch.pitch_rate_radps / 6.0,
    )
    smooth = replace(runs[0], number=6, batches=(quiet,))
    found_in = inspect_drives([inspected(run) for run in (*runs, fast, smooth)], VAN, SETTINGS)
    assert found_in.findings == ()
    told = {one.run.number: [finding.kind for finding in one.findings] for one in found_in.runs}
    assert told == {1: [], 2: [], 3: [], 4: [], 5: [Kind.SPEED_DIFFERS], 6: [Kind.SMOOTH_ROAD]}


def test_a_run_sampled_at_another_rate_calibrates_nothing(runs: list[StatedDrive]) -> None:
    at_100_hz = [replace(run, batches=tuple(replace(b, sensor_rate_hz=100.0) for b in run.batches)) for run in runs]
    slower = replace(runs[0], number=5, batches=tuple(replace(b, sensor_rate_hz=50.0) for b in runs[0].batches))
    found = inspect_drives([inspected(run) for run in (*at_100_hz, slower)], VAN, SETTINGS).runs
    assert [one.run.number for one in found if not one.is_usable] == [5]
    assert Kind.RATE_DIFFERS in [finding.kind for finding in found[-1].findings]


def test_runs_of_unknown_load_are_inspected_but_not_compared(runs: list[StatedDrive]) -> None:
    unknown = [StatedDrive(run.name, run.batches, number=run.number, log=run.log) for run in runs[1:]]
    found_in = inspect_drives([inspected(run) for run in (runs[0], *unknown)], VAN, SETTINGS)
    assert ([one.findings for one in found_in.runs], found_in.findings) == ([()] * 4, ())
    faulty = replace(inspected(runs[0]), findings=(FAULT,))
    assert Inspection((faulty, *(inspected(run) for run in unknown))).refusal is None


FAULT = Finding.of(Kind.PITCH_RATE_SIGN, "it is turned")


def test_a_campaign_without_identification_is_reported() -> None:
    split = tuple(replace(one, has_identification=False) for one in campaign())
    assert "identification_fraction" in str(Inspection(split).refusal)
