"""Drift of a vehicle is told from the seasons of the fleet and from chance, by Theil-Sen slopes."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.fleet import row, week, write_table

from gateway.archive import PlaceError, place_of
from gateway.archive.dataset import SCHEMA_VERSION
from gateway.archive.fleet.drift import (
    LEAST_POINTS,
    LEAST_VEHICLES,
    believed,
    drifts_of,
    trend_of,
)
from gateway.archive.fleet.fleet import fleet_of
from gateway.errors import ConfigurationError
from gateway.records import F64

WEEKS = np.arange(2900, 2952)
YEARS = (WEEKS - WEEKS[0]) / (365.25 / 7.0)
SEASON = 0.05 * np.sin(2.0 * np.pi * YEARS)


def medians_with(n_vehicles: int, per_year: float) -> pl.DataFrame:
    """Vehicles that know the seasons; the first drifts besides."""
    rng = np.random.default_rng(5)
    vans = [
        pl.DataFrame({"week": WEEKS, "median": 1.0 + SEASON + rng.normal(0.0, 0.01, len(WEEKS))}).with_columns(
            pl.lit(f"van-{n}").alias("vehicle"), pl.lit("damper_front_ratio").alias("name")
        )
        for n in range(n_vehicles)
    ]
    vans[0] = vans[0].with_columns(pl.col("median") + per_year * YEARS)
    return pl.concat(vans)


def test_a_drift_of_one_vehicle_is_believed_and_a_common_one_is_not() -> None:
    drifts = drifts_of(medians_with(LEAST_VEHICLES + 5, per_year=0.05))
    assert [vehicle for (vehicle, _), found in drifts.items() if found.is_believed] == ["van-0"]
    beyond = drifts["van-0", "damper_front_ratio"].beyond
    assert beyond.low <= 0.05 <= beyond.high
    assert beyond.n == len(WEEKS)


def test_a_small_fleet_has_no_movement_in_common() -> None:
    drifts = drifts_of(medians_with(LEAST_VEHICLES - 1, per_year=0.05))
    assert all(found.beyond is None for found in drifts.values())


def test_a_parameter_known_for_too_few_weeks_has_no_drift() -> None:
    medians = medians_with(1, 0.0)
    assert list(drifts_of(medians)) == [("van-0", "damper_front_ratio")]
    assert drifts_of(medians.head(LEAST_POINTS - 1)) == drifts_of(medians.clear()) == {}


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
    assert vehicle.calibrated_week == vehicle.weeks["week"][12]
    assert len(vehicle.weeks) == 24


def with_schema(path: Path, version: str) -> None:
    pl.read_parquet(path, hive_partitioning=False).write_parquet(path, metadata={"springscale_schema": version})


@pytest.mark.parametrize(
    ("spoil", "error", "told"),
    [
        (Path.unlink, PlaceError, r"is missing, though a receipt vouches for it: remove receipts/vehicle=van"),
        (lambda path: path.write_bytes(path.read_bytes()[:100]), PlaceError, r"is no Parquet file .*: remove it and"),
        (lambda path: with_schema(path, str(SCHEMA_VERSION + 1)), ConfigurationError, "has schema .*install a newer"),
        (lambda path: with_schema(path, ""), ConfigurationError, "is no table of"),
        (
            lambda path: write_table(path.parents[3], "van", week(0), month="2026-02"),
            ConfigurationError,
            "vouch for the same 10 batches",
        ),
    ],
)
def test_a_faulty_table_is_reported(
    tmp_path: Path, spoil: Callable[[Path], object], error: type[Exception], told: str
) -> None:
    spoil(tmp_path / write_table(tmp_path, "van", week(0)).table)
    with pytest.raises(error, match=told):
        fleet_of(place_of(tmp_path))


@pytest.mark.parametrize(("is_there", "told"), [(False, "holds no receipt of"), (True, "hold no batch at all")])
def test_an_empty_data_set_is_reported(tmp_path: Path, is_there: bool, told: str) -> None:
    if is_there:
        write_table(tmp_path, "van", [])
    with pytest.raises(ConfigurationError, match=told):
        fleet_of(place_of(tmp_path))


def test_several_jobs_are_one_vehicle(tmp_path: Path) -> None:
    write_table(tmp_path, "van", [row(1_768_000_000.0)])
    write_table(tmp_path, "van", [row(1_767_900_000.0)], month="2026-02")
    [vehicle] = fleet_of(place_of(tmp_path)).vehicles
    assert vehicle.n == 2


X = np.arange(52.0) / 52.0


def repeating(alike: float, n_series: int, seed: int) -> list[F64]:
    """Series without a trend that follow themselves from point to point."""
    rng = np.random.default_rng(seed)
    noise = rng.normal(size=(n_series, len(X) + 50))
    for k in range(1, noise.shape[1]):
        noise[:, k] += alike * noise[:, k - 1]
    return list(noise[:, 50:])


@given(st.integers(0, 99), st.floats(-5.0, 5.0), st.floats(-50.0, 50.0), st.floats(0.1, 10.0))
def test_a_ramp_a_shift_and_another_unit_do_what_they_must(seed: int, ramp: float, shift: float, unit: float) -> None:
    y, x = np.random.default_rng(seed).normal(size=20), np.arange(20.0)
    plain, moved = trend_of(x, y), trend_of(x / unit, y + shift + ramp * x)
    assert plain is not None
    assert moved is not None
    for name in ("slope", "low", "high"):
        assert getattr(moved, name) == pytest.approx(unit * (getattr(plain, name) + ramp), abs=1e-6)


def test_too_few_points_have_no_slope_and_equal_ones_have_zero() -> None:
    assert trend_of(X[: LEAST_POINTS - 1], X[: LEAST_POINTS - 1]) is None
    level = trend_of(X, np.zeros(len(X)))
    assert (level.slope, level.low, level.high, level.p) == (0.0, 0.0, 0.0, 1.0)


def test_one_wild_week_moves_the_slope_little() -> None:
    y = 0.2 * X
    y[7] = 1e6
    trend = trend_of(X, y)
    assert trend.slope == pytest.approx(0.2)


@pytest.mark.parametrize("alike", [0.0, 0.3, 0.6])
def test_the_interval_covers_a_zero_slope_at_its_nominal_rate(alike: float) -> None:
    trends = [trend_of(X, y) for y in repeating(alike, 400, seed=3)]
    held = np.mean([trend is not None and trend.low <= 0.0 <= trend.high for trend in trends])
    assert 0.90 <= held <= 0.985


@pytest.mark.parametrize("alike", [0.0, 0.5])
def test_of_a_thousand_vehicles_without_drift_hardly_any_is_flagged(alike: float) -> None:
    chances = [trend.p for y in repeating(alike, 1000, seed=4) if (trend := trend_of(X, y)) is not None]
    assert sum(chance < 0.05 for chance in chances) > 20  # what judging each by itself would flag
    assert believed(chances).sum() <= 2
