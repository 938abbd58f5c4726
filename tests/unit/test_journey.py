"""The way of a batch: distance, standstills, what door and ignition did, places as far as they may be kept."""

import math
from dataclasses import replace

import numpy as np
import pytest
from support.drives import T0_NS, drive, joined, later, without_rows

from gateway.core.batch_settings import BatchSettings
from gateway.core.scheduler import Scheduler
from gateway.estimates.batch_estimate import Place, Watched, Way
from gateway.records import Motion, SensorTraits, Signal

JOURNEY = (Signal.LATITUDE, Signal.LONGITUDE, Signal.ODOMETER, Signal.DOOR, Signal.IGNITION)


def seconds(t_ns: int) -> float:
    return (t_ns - T0_NS) / 1e9


def beside(motion: Motion, until_s: float, door=lambda t_s: 0.0 * t_s, every_s: float = 1.0) -> Motion:
    """Frames of the journey between the rows: going north at 15 m/s, the door as told."""
    t_s = np.arange(0.0, until_s, every_s)
    told = np.column_stack([47.0 + t_s / 1e4, 8.0 + 0.0 * t_s, 1000.0 + 15.0 * t_s, door(t_s), 1.0 + 0.0 * t_s])
    columns = np.full((len(motion) + len(t_s), len(motion.signals) + len(JOURNEY)), np.nan)
    columns[: len(motion), : len(motion.signals)] = motion.columns
    columns[len(motion) :, len(motion.signals) :] = told
    t_ns = np.r_[motion.t_ns, T0_NS + np.rint(t_s * 1e9).astype(np.int64)]
    order = np.argsort(t_ns, kind="stable")
    aside = np.arange(len(t_ns)) >= len(motion)
    return Motion((*motion.signals, *JOURNEY), t_ns[order], columns[order], aside=aside[order])


def ways(motion: Motion, decimals: int | None = None, traits=None, window_s: float = 60.0) -> list[Way]:
    settings = BatchSettings(window_s=window_s, standstill_s=30.0, position_decimals=decimals)
    scheduler = Scheduler(settings, traits or {})
    return [scheduler.way_of_last for source in (scheduler.feed(motion), scheduler.flush()) for _ in source]


def test_distance_is_the_integral_of_the_speed():
    first, second = ways(drive(119.0))
    assert first.distance_m == pytest.approx(15.0 * 60.0, rel=0.01)
    assert (first.known_s, first.moving_s) == (pytest.approx(60.0, abs=0.2), pytest.approx(60.0, abs=0.2))
    assert second.distance_m == pytest.approx(15.0 * 59.0, rel=0.01)
    assert first.stops == ()


def test_time_without_a_speed_counts_no_distance():
    rows = drive(60.5)
    gone = rows.columns.copy()
    t_s = (rows.t_ns - T0_NS) / 1e9
    gone[(t_s > 20.0) & (t_s < 40.0), rows.signals.index(Signal.SPEED)] = np.nan
    way = ways(replace(rows, columns=gone))[0]
    assert way.known_s == pytest.approx(40.0, abs=0.5)
    assert way.distance_m == pytest.approx(600.0, rel=0.02)


def test_a_stop_has_its_time_and_its_door():
    rows = drive(60.5, lambda t_s: np.where((t_s > 20.0) & (t_s < 35.0), 0.0, 15.0))
    opened = ways(beside(rows, 60.0, lambda t_s: ((t_s > 25.0) & (t_s < 30.0)) * 1.0))[0]
    (stop,) = opened.stops
    assert (seconds(stop.t_start_ns), seconds(stop.t_end_ns)) == (
        pytest.approx(20, abs=0.3),
        pytest.approx(35, abs=0.3),
    )
    assert stop.watched == Watched(True, False)
    assert ways(beside(rows, 60.0))[0].stops[0].watched == Watched(False, False)
    assert ways(rows)[0].stops[0].watched == Watched(None, None)


@pytest.mark.parametrize(("stood_s", "n_stops"), [(9.0, 0), (11.0, 1)])
def test_only_a_long_enough_stop_is_listed(stood_s: float, n_stops: int):
    short = drive(60.5, lambda t_s: np.where((t_s > 20.0) & (t_s < 20.0 + stood_s), 0.0, 15.0))
    assert len(ways(short)[0].stops) == n_stops


def test_a_door_opened_while_parked_is_reported_by_the_next_drive():
    rows = drive(150.0, lambda t_s: np.where((t_s > 20.0) & (t_s < 90.0), 0.0, 15.0))
    seen = ways(beside(rows, 150.0, lambda t_s: ((t_s > 70.0) & (t_s < 75.0)) * 1.0))
    assert [way.before.door_opened for way in seen] == [None, True]
    assert seen[0].stops[0].watched.door_opened is False
    assert [way.before for way in ways(rows)] == [Watched()] * 2


def test_a_door_opened_while_the_sensors_sleep_is_reported():
    rows = without_rows(drive(120.0), 50.0, 80.0)
    seen = ways(beside(rows, 120.0, lambda t_s: ((t_s > 60.0) & (t_s < 65.0)) * 1.0))
    assert [way.before.door_opened for way in seen] == [None, True]


def test_no_position_is_kept_unless_asked_for():
    rows = beside(drive(61.0), 61.0)
    assert ways(rows)[0].start == ways(rows)[0].end == Place()
    assert ways(rows, decimals=5)[0].start == Place(47.0, 8.0)
    assert ways(rows, decimals=5)[0].end.latitude_deg == pytest.approx(47.006, abs=1.1e-4)
    assert ways(rows, decimals=1)[0].end == Place(47.0, 8.0)


def test_an_old_position_is_not_used():
    rows = drive(120.5)
    told = beside(rows, 30.0)
    first, second = ways(told, decimals=5)[:2]
    assert first.start.is_known
    assert not first.end.is_known
    assert not second.start.is_known


@pytest.mark.parametrize(("until_s", "is_known"), [(50.0, False), (52.0, True)])
def test_a_position_is_of_the_ten_seconds_about_its_moment(until_s: float, is_known: bool):
    """Told every second, the last a second before ``until_s``; the window ends at 60."""
    assert ways(beside(drive(120.5), until_s), decimals=5)[0].end.is_known is is_known


def test_a_coarse_odometer_is_passed_over():
    rows = beside(drive(61.0), 61.0)
    way = ways(rows, traits={Signal.ODOMETER: SensorTraits(resolution=5.0)})[0]
    assert (way.odometer_start_m, way.odometer_end_m) == (1000.0, pytest.approx(1885.0))
    assert math.isnan(ways(rows, traits={Signal.ODOMETER: SensorTraits(resolution=1000.0)})[0].odometer_end_m)


def test_a_clock_that_steps_back_starts_a_new_journey():
    rows = joined(drive(50.0), later(drive(50.0, seed=2), 20.0))
    assert len(ways(rows)) == 2
