"""Drives are smooth, within their speeds, and honest about distance."""

from collections.abc import Callable

import numpy as np
import pytest

from gateway.sim.drive import JERK_MPS3, STEP_S, Drive, Leg, constant, drive_of, motorway, rural, standstill, urban

RANDOM = {"urban": (urban, 0.0, 52.0), "rural": (rural, 0.0, 100.0), "motorway": (motorway, 0.0, 131.0)}


@pytest.mark.parametrize("kind", RANDOM)
def test_random_drives_keep_to_their_speeds_and_stop_at_the_end(kind: str) -> None:
    make, low_kmh, high_kmh = RANDOM[kind]
    drive = make(900.0, np.random.default_rng(1))
    assert np.min(drive.speed_mps) * 3.6 >= low_kmh
    assert 0.75 * high_kmh < np.max(drive.speed_mps) * 3.6 <= high_kmh
    assert drive.speed_mps[0] == drive.speed_mps[-1] == 0.0
    assert drive.duration_s == pytest.approx(900.0, abs=300.0)


@pytest.mark.parametrize("make", [urban, rural, motorway])
def test_the_seed_is_all_that_decides(make: Callable[[float, np.random.Generator], Drive]) -> None:
    one, same, other = (make(600.0, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert np.array_equal(one.speed_mps, same.speed_mps)
    assert np.array_equal(one.lateral_mps2, same.lateral_mps2)
    assert len(one.speed_mps) != len(other.speed_mps) or not np.allclose(one.speed_mps, other.speed_mps)


def test_jerk_and_acceleration_stay_bounded() -> None:
    drive = drive_of([Leg(20.0, 5.0, 2.0), Leg(0.0, 0.0, 2.0), Leg(15.0, 5.0, 1.0), Leg(0.0, 5.0, 2.0)])
    acceleration = np.diff(drive.speed_mps) / STEP_S
    assert np.max(np.abs(acceleration)) <= 2.0 + 1e-9
    assert np.max(np.abs(np.diff(acceleration))) / STEP_S <= JERK_MPS3 * 1.001


def test_urban_driving_stops_and_motorway_driving_does_not() -> None:
    stops = [
        np.count_nonzero(np.diff((make(1800.0, np.random.default_rng(3)).speed_mps == 0.0).astype(int)) == 1)
        for make in (urban, rural, motorway)
    ]
    assert stops[0] >= 10
    assert 1 <= stops[1] < stops[0]
    assert stops[2] == 1  # the end


def test_the_distance_is_the_speed_integrated() -> None:
    drive = drive_of([Leg(10.0, 20.0)], start_mps=10.0)
    assert drive.travelled_m == pytest.approx(10.0 * np.arange(len(drive.speed_mps)) * STEP_S)


def test_a_constant_drive_wanders_as_much_as_asked() -> None:
    drive = constant(13.9, 3600.0, np.random.default_rng(2), jitter_std_mps=0.3)
    assert np.std(drive.speed_mps) == pytest.approx(0.3, rel=0.15)
    assert np.mean(drive.speed_mps) == pytest.approx(13.9, abs=0.05)
    assert np.max(np.abs(drive.longitudinal_mps2)) < 0.2
    assert np.ptp(constant(13.9, 60.0, np.random.default_rng(2), jitter_std_mps=0.0).speed_mps) == 0.0


def test_curves_are_driven_only_in_motion() -> None:
    drive = urban(900.0, np.random.default_rng(4))
    assert np.std(drive.lateral_mps2) > 0.1
    assert not drive.lateral_mps2[drive.speed_mps == 0.0].any()


def test_drives_join_where_their_speeds_meet() -> None:
    stop, go = standstill(10.0), drive_of([Leg(10.0, 5.0), Leg(0.0, 2.0)])
    whole = go.then(stop).then(go)
    assert whole.duration_s == pytest.approx(2 * go.duration_s + 10.0)
    assert whole.part(go.duration_s, go.duration_s + 10.0).speed_mps.max() == 0.0
    with pytest.raises(ValueError, match=r"ends at 0\.0 m/s cannot go on at 12\.0 m/s"):
        stop.then(constant(12.0, 5.0, np.random.default_rng(1), 0.0))
