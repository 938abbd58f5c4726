"""Friction that goes by how fast each axle's own springs move: learnt beside roll, and allowed for."""

from dataclasses import replace

import numpy as np
import pytest
from support.half_car_road import CAR, weighed_as_known
from support.rolling_car import ROLLING_CAR
from support.rolling_road import WIDE_VAN, batch_over_two_tracks

from gateway.calibration.half_car.fit import calibrate_cross_spectrum
from gateway.calibration.known_run import KnownRun
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.model.half_car import HalfCar, frequency_response, strokes
from gateway.core.cross_spectrum.model.parameters import INDEX
from gateway.core.vehicle import Load
from gateway.records import F64, Batch

SPEED_MPS = 14.0
SHARE = 0.35  # of each damper's rate, where its springs move as fast as MOVED_MPS
MOVED_MPS = (0.06, 0.06)
LOADS = (Load(0.0, 52.0), Load(220.0, 50.0), Load(420.0, 44.0))
ROADS_MPS2 = (0.5, 1.0)


def stroke_speeds_mps(car: HalfCar, load: Load, shaken_mps2: float) -> F64:
    """(2,) root mean square from 1.1 to 14 Hz where the acceleration from 0.5 to 22 Hz is so much."""
    freq_hz = np.arange(0.5, 22.0, 0.02)
    omega, later = 2.0 * np.pi * freq_hz, np.exp(-2j * np.pi * freq_hz * car.wheelbase_m / SPEED_MPS)
    response = frequency_response(car, load.payload_kg, load.front_share, freq_hz)
    sensed = np.abs((response.acceleration_front + later * response.acceleration_rear) / freq_hz) ** 2
    by_front, by_rear = strokes(car, load.payload_kg, load.front_share, freq_hz)
    speed = np.abs(omega * (by_front + later * by_rear) / freq_hz) ** 2
    within = (freq_hz > 1.1) & (freq_hz < 14.0)
    return np.asarray(shaken_mps2 * np.sqrt(np.sum(speed[:, within], axis=1) / np.sum(sensed)))


def with_friction(load: Load, shaken_mps2: float) -> HalfCar:
    """CAR as it acts under that load on a road that shakes it so much."""
    car = CAR
    for _ in range(20):
        rates = 1.0 - SHARE + SHARE * np.array(MOVED_MPS) / stroke_speeds_mps(car, load, shaken_mps2)
        front, rear = (CAR.front.damper_nspm, CAR.rear.damper_nspm) * rates
        car = replace(CAR, front=replace(CAR.front, damper_nspm=front), rear=replace(CAR.rear, damper_nspm=rear))
    return car


def drive(load: Load, seed: int, shaken_mps2: float) -> Batch:
    car = replace(ROLLING_CAR, half_car=with_friction(load, shaken_mps2))
    return batch_over_two_tracks(
        load.payload_kg, load.front_share_pct, 0.01, seed, 200.0, SPEED_MPS, 0.01, car, shaken_mps2
    )


@pytest.fixture(scope="module")
def calibration() -> CrossSpectrumCalibration:
    runs = [
        KnownRun(
            number,
            "",
            load.payload_kg,
            load.front_share_pct,
            tuple(drive(load, 10 * number + i, shaken) for i, shaken in enumerate(ROADS_MPS2)),
        )
        for number, load in enumerate(LOADS)
    ]
    return calibrate_cross_spectrum(runs, WIDE_VAN)


def test_how_fast_springs_usually_move_is_found(calibration: CrossSpectrumCalibration) -> None:
    logs = [
        [np.log(stroke_speeds_mps(with_friction(load, shaken), load, shaken)) for shaken in ROADS_MPS2]
        for load in LOADS
    ]
    usual_mps = np.exp(np.median(np.mean(logs, axis=1), axis=0))
    assert calibration.usual_stroke_mps == pytest.approx(tuple(usual_mps), rel=0.06)


@pytest.mark.parametrize(("axle", "end"), [(0, "front"), (1, "rear")])
def test_the_friction_of_each_axle_is_found(axle: int, end: str, calibration: CrossSpectrumCalibration) -> None:
    entry = INDEX[f"damper_friction_{end}"]
    std = calibration.covariance[entry, entry] ** 0.5
    usually = SHARE * MOVED_MPS[axle] / calibration.usual_stroke_mps[axle]
    assert std < 0.15
    assert calibration.parameters[entry] == pytest.approx(usually / (1.0 - SHARE + usually), abs=3.0 * std)


@pytest.mark.parametrize("shaken_mps2", [0.4, 1.2])
def test_a_load_reads_the_same_on_smooth_and_on_rough_roads(
    shaken_mps2: float, calibration: CrossSpectrumCalibration
) -> None:
    load = Load(330.0, 46.0)
    found = weighed_as_known(drive(load, 77, shaken_mps2), calibration)
    assert found.payload.number == pytest.approx(load.payload_kg, abs=12.0)
    assert found.front_share.number == pytest.approx(load.front_share_pct, abs=0.25)
