"""Simulated campaigns: complete, repeatable, and readable by the tools that read recorded ones."""

import csv
import filecmp
import gzip
from pathlib import Path

import numpy as np
import pytest

from gateway.bus.signals import load_signal_map
from gateway.calibration.campaign_file import load_campaign
from gateway.core.batch_settings import BatchSettings
from gateway.core.vehicle import cg_left_m, left_share_pct
from gateway.errors import ConfigurationError
from gateway.offline.campaigns import split_runs
from gateway.records import Signal, Why
from gateway.sim.parameters import payload_kg
from gateway.sim.vans import PAPER_VAN, VANS
from gateway.workbench.simulated_campaigns import PLANS, plan_of
from gateway.workbench.simulated_drives import (
    BETWEEN_DRIVES_S,
    SENSORS_OF_MAP,
    bench_of,
    simulated_frames,
    write_campaign,
)


@pytest.mark.parametrize("vehicle", list(VANS))
@pytest.mark.parametrize("kind", list(PLANS))
def test_every_plan_suits_every_vehicle(kind: str, vehicle: str) -> None:
    van = VANS[vehicle]
    plan = plan_of(kind, van, seed=1)
    for planned in plan.drives:
        assert planned.carried[0].loads == planned.steps[0].loads
        for carried in planned.carried:
            assert 0.0 <= payload_kg(carried.loads) <= van.rated_payload_kg * 1.0001
            assert all(-1e-9 <= load.position_m <= van.wheelbase_m + 1e-9 for load in carried.loads)
            assert 0.0 <= carried.start_s < carried.end_s <= planned.drive.duration_s
    assert len({planned.name for planned in plan.drives}) == len(plan.drives)


@pytest.mark.parametrize("kind", ["test1", "test2", "test3"])
def test_the_papers_tests_change_load_at_rest_and_run_at_50_kmh(kind: str) -> None:
    (planned,) = plan_of(kind, PAPER_VAN, seed=2).drives
    drive = planned.drive
    for step in planned.steps[1:]:
        assert drive.speed_mps[round(step.t_s / drive.step_s)] == 0.0
    for carried in planned.carried:
        moving = drive.part(carried.start_s, carried.end_s).speed_mps
        assert np.mean(moving) == pytest.approx(50.0 / 3.6, rel=0.01)
        assert np.min(moving) > 45.0 / 3.6
        assert (carried.end_s - carried.start_s) % 300.0 < 15.0  # whole batches of five minutes


def test_the_seed_and_nothing_else_decides_the_frames(tmp_path: Path) -> None:
    bench = bench_of("load-sweep", longest_s=4.0, n_unrelated=3)
    one = write_campaign(bench, tmp_path / "one")
    other = write_campaign(bench, tmp_path / "other", workers=2)
    reseeded = write_campaign(bench_of("load-sweep", longest_s=4.0, n_unrelated=3, seed=2), tmp_path / "reseeded")
    logs = sorted(path.relative_to(one.parent) for path in one.parent.rglob("can.log.gz"))
    assert len(logs) == 10
    for name in ("campaign.toml", "truth.csv", "signals.toml"):
        assert filecmp.cmp(one.parent / name, other.parent / name, shallow=False)
    for log in logs:
        first, same, different = (gzip.decompress((path.parent / log).read_bytes()) for path in (one, other, reseeded))
        assert first == same
        assert first != different


def test_a_simulated_campaign_reads_like_a_recorded_one(tmp_path: Path) -> None:
    path = write_campaign(bench_of("test1", longest_s=45.0), tmp_path)
    campaign = load_campaign(path)
    settings = BatchSettings(window_s=20.0)
    runs = split_runs(campaign, settings)
    assert campaign.vehicle.empty_mass_kg == 1240.0
    assert [run.validation.payload_kg for run in runs] == [0.0, 300.0]
    for run in runs:
        batches = run.validation.batches
        assert run.identification.batches == ()
        assert [batch.rejected for batch in batches] == [(), (), (Why.TOO_SHORT,)]
        assert [batch.mean_speed_mps for batch in batches] == pytest.approx([50.0 / 3.6] * 3, abs=1.0)
        assert [batch.gravity_mps2 for batch in batches] == pytest.approx([9.8] * 3, abs=0.5)


@pytest.mark.parametrize("map_name", SENSORS_OF_MAP)
@pytest.mark.parametrize(("kind", "rolls"), [("test1", False), ("experiment", True)])
def test_a_roll_rate_is_mapped_where_the_road_has_two_tracks(
    tmp_path: Path, map_name: str, kind: str, rolls: bool
) -> None:
    campaign = load_campaign(write_campaign(bench_of(kind, map_name=map_name, longest_s=2.0), tmp_path))
    assert (Signal.ROLL_RATE in load_signal_map(campaign.signals).signals) is rolls


def test_loads_and_sensor_stand_beside_the_centre_line_where_asked(tmp_path: Path) -> None:
    bench = bench_of("experiment", longest_s=2.0, sensor_left_m=-0.4, loads_off_m=0.3)
    campaign = load_campaign(write_campaign(bench, tmp_path))
    vehicle = campaign.vehicle
    assert vehicle.sensor_offset_left_m == -0.4
    assert vehicle.track_width_m == 1.5
    with (tmp_path / "truth.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    lefts_m = [run.payload_left_m for run in campaign.runs if run.payload_kg]
    assert all(left_m is not None and abs(left_m) <= 0.3 for left_m in lefts_m)
    assert len(set(lefts_m)) == len(lefts_m) == 9
    for row, run in zip(rows, campaign.runs, strict=True):
        cg_m = cg_left_m(vehicle, run.payload_kg, run.payload_left_m or 0.0)
        assert float(row["cg_left_m"]) == pytest.approx(cg_m, abs=1e-5)
        front, rear = float(row["front_axle_kg"]), float(row["rear_axle_kg"])
        left = float(row["front_left_kg"]) + float(row["rear_left_kg"])
        assert float(row["front_left_kg"]) + float(row["front_right_kg"]) == pytest.approx(front, abs=0.01)
        # moments about the right wheels' line of contact; the body hardly leans
        sprung = vehicle.empty_mass_kg + run.payload_kg
        assert 100.0 * (left - (front + rear - sprung) / 2.0) / sprung == pytest.approx(
            left_share_pct(cg_m, vehicle.track_width_m), abs=0.01
        )


@pytest.mark.parametrize(
    ("names", "complaint"),
    [
        ({"kind": "tset1"}, "no campaign 'tset1': choose ident, "),
        ({"kind": "ident", "vehicle": "lorry"}, "no vehicle 'lorry': choose paper_van, small_van, large_van"),
        ({"kind": "ident", "map_name": "pcan_gps"}, "no signal map to send by 'pcan_gps': choose reference, "),
        ({"kind": "ident", "longest_s": 0.0}, "positive duration"),
    ],
)
def test_an_unknown_name_is_refused_with_the_known_ones(names: dict[str, str], complaint: str) -> None:
    with pytest.raises(ConfigurationError, match=complaint):
        bench_of(**names)


def test_drives_follow_one_another_with_the_vehicle_parked_between() -> None:
    first, second, *_ = simulated_frames(bench_of("speeds", longest_s=3.0))
    parked_s = (second.t_ns[0] - first.t_ns[-1]) / 1e9
    assert parked_s == pytest.approx(BETWEEN_DRIVES_S, abs=0.2)
