"""Drift of a vehicle is told from the seasons of the fleet and from chance; a data set that is broken says how."""

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from support.fleet import row, week, write_table

from gateway.archive import PlaceError, place_of
from gateway.archive.dataset import SCHEMA_VERSION
from gateway.archive.fleet.drift import LEAST_POINTS, LEAST_VEHICLES, Series, common_movement, drifts_of
from gateway.archive.fleet.fleet import fleet_of
from gateway.errors import ConfigurationError
from gateway.records import F64

WEEKS = np.arange(2900, 2952)
YEARS = (WEEKS - WEEKS[0]) / (365.25 / 7.0)
SEASON = 0.05 * np.sin(2.0 * np.pi * YEARS)


def series_of(damper: F64) -> Series:
    nothing = (np.empty(0, dtype=np.int64), np.empty(0))
    names = ("damper_rear_ratio", "delay_scale", "roll_share_front", "misfit", "tension")
    rest = (*names, "sensor_position_score", "sensor_noise_score")
    return {"damper_front_ratio": (WEEKS, damper), **dict.fromkeys(rest, nothing)}


def fleet_with(n_vehicles: int, per_year: float) -> dict[str, Series]:
    """Vehicles that know the seasons; the first drifts besides."""
    rng = np.random.default_rng(5)
    return {
        f"van-{n}": series_of(1.0 + SEASON + rng.normal(0.0, 0.01, len(WEEKS)) + (per_year * YEARS if n == 0 else 0.0))
        for n in range(n_vehicles)
    }


def test_what_one_vehicle_does_alone_is_believed_and_what_all_do_is_not() -> None:
    drifts = drifts_of(fleet_with(LEAST_VEHICLES + 5, per_year=0.05))
    believed = [name for name, found in drifts.items() if found["damper_front_ratio"].is_believed]
    assert believed == ["van-0"]
    beyond = drifts["van-0"]["damper_front_ratio"].beyond
    assert beyond is not None
    assert beyond.low <= 0.05 <= beyond.high
    assert beyond.n == len(WEEKS)


def test_a_small_fleet_has_no_movement_in_common() -> None:
    drifts = drifts_of(fleet_with(LEAST_VEHICLES - 1, per_year=0.05))
    assert all(found["damper_front_ratio"].beyond is None for found in drifts.values())
    assert common_movement([]) == {}


def test_a_parameter_that_nobody_knows_has_no_drift() -> None:
    assert list(drifts_of(fleet_with(2, 0.0))["van-1"]) == ["damper_front_ratio"]
    few = {"van": series_of(np.ones(len(WEEKS)))}
    few["van"] = {**few["van"], "damper_front_ratio": (WEEKS[: LEAST_POINTS - 1], np.ones(LEAST_POINTS - 1))}
    assert drifts_of(few) == {"van": {}}


def test_a_slope_is_since_the_last_calibration(tmp_path: Path) -> None:
    rows: list[dict[str, Any]] = []
    for number in range(24):
        known = {"damper_front_ratio": 1.0 + (0.01 * number if number < 12 else 0.0)}
        rows += week(number, calibration_id="sha256:1" if number < 12 else "sha256:2", **known)
    write_table(tmp_path, "van", rows)
    [vehicle] = fleet_of(place_of(tmp_path)).vehicles
    drift = vehicle.drifts["damper_front_ratio"]
    assert (drift.found.slope, drift.found.n, drift.is_believed) == (0.0, 12, False)
    assert vehicle.calibrations == ("sha256:1", "sha256:2")
    assert vehicle.calibrated_week == vehicle.weeks.number[12]
    assert len(vehicle.weeks.number) == 24


def test_only_receipts_are_believed(tmp_path: Path) -> None:
    slot = write_table(tmp_path, "van", week(0))
    write_table(tmp_path, "other", week(0, 3))
    orphan = write_table(tmp_path, "van", week(1), month="2026-02")
    (tmp_path / orphan.receipt).unlink()
    fleet = fleet_of(place_of(tmp_path))
    assert {vehicle.name: vehicle.n for vehicle in fleet.vehicles} == {"other": 3, "van": 10}
    assert slot.vehicle == "van"


def test_a_receipt_without_its_table_says_so(tmp_path: Path) -> None:
    slot = write_table(tmp_path, "van", week(0))
    (tmp_path / slot.table).unlink()
    with pytest.raises(PlaceError, match=r"is missing, though a receipt vouches for it: remove receipts/vehicle=van"):
        fleet_of(place_of(tmp_path))


def test_a_table_that_is_cut_says_so(tmp_path: Path) -> None:
    slot = write_table(tmp_path, "van", week(0))
    (tmp_path / slot.table).write_bytes((tmp_path / slot.table).read_bytes()[:100])
    with pytest.raises(PlaceError, match=r"is no Parquet file .*: remove it and receipts/"):
        fleet_of(place_of(tmp_path))


@pytest.mark.parametrize(
    ("version", "told"),
    [(str(SCHEMA_VERSION + 1), f"has schema {SCHEMA_VERSION + 1}.*install a newer one"), ("", "is no table of")],
)
def test_a_table_of_another_schema_says_so(tmp_path: Path, version: str, told: str) -> None:
    slot = write_table(tmp_path, "van", week(0))
    table = pq.read_table(tmp_path / slot.table, partitioning=None)
    pq.write_table(table.replace_schema_metadata({"springscale_schema": version}), tmp_path / slot.table)
    with pytest.raises(ConfigurationError, match=told):
        fleet_of(place_of(tmp_path))


def test_a_table_of_somebody_elses_says_so(tmp_path: Path) -> None:
    slot = write_table(tmp_path, "van", week(0))
    pq.write_table(pa.table({"a": [1]}), tmp_path / slot.table)
    with pytest.raises(ConfigurationError, match="names no springscale_schema"):
        fleet_of(place_of(tmp_path))


def test_batches_that_two_receipts_hold_are_not_counted_twice(tmp_path: Path) -> None:
    write_table(tmp_path, "van", week(0))
    write_table(tmp_path, "van", week(0), month="2026-02")
    with pytest.raises(ConfigurationError, match="vouch for the same 10 batches"):
        fleet_of(place_of(tmp_path))


def test_several_jobs_are_one_vehicle(tmp_path: Path) -> None:
    write_table(tmp_path, "van", [row(1_768_000_000.0)])
    write_table(tmp_path, "van", [row(1_767_900_000.0)], month="2026-02")
    [vehicle] = fleet_of(place_of(tmp_path)).vehicles
    assert vehicle.n == 2


def test_nothing_to_report_says_so(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="holds no receipt of `springscale reprocess`"):
        fleet_of(place_of(tmp_path))
    write_table(tmp_path, "van", [])
    with pytest.raises(ConfigurationError, match="hold no batch at all"):
        fleet_of(place_of(tmp_path))
