"""End to end in a world that shares no model with the estimator: sensor and loads off the centre line."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.accuracy.calibrated import taught_by
from benchmarks.accuracy.drives import known_run, stated, without_roll_rate
from gateway.bus.signals import Decoder, load_signal_map
from gateway.calibration.stated_drive import StatedDrive
from gateway.core.vehicle import cg_left_m
from gateway.estimates.batch_estimate import Estimate, Quantity
from gateway.model.vehicle_model import VehicleModel
from gateway.records import Batch, Why
from gateway.sim.instruments import REFERENCE
from gateway.sim.obstacles import UnevenRoad
from gateway.sim.parameters import Load
from gateway.sim.road import iso_road
from gateway.sim.scenario import simulate_drive
from gateway.sim.speed_profile import constant
from gateway.sim.vans import PAPER_VAN
from gateway.weighing.calibrated import CalibratedVehicle
from gateway.weighing.estimator import estimate
from gateway.workbench.wiring import Wiring

SENSORS = replace(REFERENCE, mount=replace(REFERENCE.mount, left_m=0.3))
VEHICLE = stated(PAPER_VAN, SENSORS)
ROAD = UnevenRoad(iso_road("B"), stretch_m=600.0, spread=0.25)


def driven(number: int, loads: tuple[Load, ...], seed: int, duration_s: float = 310.0) -> StatedDrive:
    """One batch at about 14 m/s, through sensors, frames and decoder."""
    course = constant(14.0, duration_s, np.random.default_rng([seed, number]), jitter_std_mps=0.4)
    simulated = simulate_drive(PAPER_VAN, loads, ROAD, course, SENSORS, 100 * seed + number)
    rows = Decoder(load_signal_map("springscale:reference")).decode(Wiring("reference").frames_of(simulated.recording))
    return known_run(rows, number, f"drive {number}", PAPER_VAN, loads)


def known_drives() -> list[StatedDrive]:
    """Empty, and three loads about the centre line."""
    loads: list[tuple[Load, ...]] = [(), (Load(150.0, 0.6),), (Load(280.0, 2.6),), (Load(430.0, 1.4),)]
    return [driven(number, load, seed=1) for number, load in enumerate(loads, 1)]


SIDES = ((300.0, 1.2, 0.3), (300.0, 1.2, -0.3), (180.0, 2.3, 0.35), (420.0, 1.8, -0.25))


def weighed(batch: Batch, calibration: VehicleModel) -> Estimate:
    calibrated = CalibratedVehicle("sha256:ab", VEHICLE, (0.0, 420.0), (40.0, 60.0), cross_spectrum=calibration)
    return estimate(batch, calibrated, "cross_spectrum")


def holds(quantity: Quantity, truth: float) -> bool:
    return quantity.interval95[0] <= truth <= quantity.interval95[1]


def width(quantity: Quantity) -> float:
    return quantity.interval95[1] - quantity.interval95[0]


@pytest.fixture(scope="module")
def known() -> list[StatedDrive]:
    return known_drives()


@pytest.fixture(scope="module")
def rolling(known: list[StatedDrive]) -> VehicleModel:
    return taught_by(known, VEHICLE)


@pytest.fixture(scope="module")
def unrolled(known: list[StatedDrive]) -> VehicleModel:
    return taught_by([without_roll_rate(run) for run in known], VEHICLE)


@pytest.fixture(scope="module")
def sideways() -> dict[tuple[float, float, float], StatedDrive]:
    return {
        side: driven(number, (Load(side[0], side[1], left_m=side[2]),), seed=2) for number, side in enumerate(SIDES, 1)
    }


@pytest.mark.parametrize("side", SIDES, ids=str)
def test_a_load_to_the_side_is_weighed_and_found(
    side: tuple[float, float, float], sideways: dict[tuple[float, float, float], StatedDrive], rolling: VehicleModel
) -> None:
    payload_kg, _, left_m = side
    run = sideways[side]
    found = weighed(run.batches[0], rolling)
    assert found.counted
    assert holds(found.payload, payload_kg)
    assert holds(found.front_share, run.front_share_pct)
    true_m = cg_left_m(VEHICLE, payload_kg, left_m)
    assert holds(found.cg_left, true_m)
    assert np.sign(found.cg_left.number) == np.sign(left_m)
    assert found.cg_left.number == pytest.approx(true_m, abs=0.015)


@pytest.mark.parametrize("side", SIDES, ids=str)
def test_without_a_roll_rate_the_interval_is_wider_and_holds(
    side: tuple[float, float, float],
    sideways: dict[tuple[float, float, float], StatedDrive],
    rolling: VehicleModel,
    unrolled: VehicleModel,
) -> None:
    batch = sideways[side].batches[0]
    with_roll, without = weighed(batch, rolling), weighed(replace(batch, roll_rate_radps=None), unrolled)
    assert without.counted
    assert holds(without.payload, side[0])
    assert width(without.payload) > width(with_roll.payload)
    assert not np.isfinite(without.cg_left.number)


def test_an_unseen_sideways_load_costs_surety_and_no_refusal_where_the_load_is_central(
    known: list[StatedDrive], rolling: VehicleModel
) -> None:
    """Tracks that differ shake a sensor off the centre line by themselves: no other sensor, and no other vehicle."""
    found = [weighed(replace(run.batches[0], roll_rate_radps=None), rolling) for run in known]
    assert {why for one in found for why in one.rejected} <= {Why.TOO_UNCERTAIN}
    assert sum(one.counted for one in found) >= len(known) - 1
    assert all(holds(one.payload, run.payload_kg) for one, run in zip(found, known, strict=True) if one.counted)


@pytest.mark.parametrize("turned_deg", [-10.0, 10.0])
def test_roll_that_leaks_into_a_turned_gyro_is_no_noise(
    turned_deg: float, sideways: dict[tuple[float, float, float], StatedDrive], rolling: VehicleModel
) -> None:
    """The noise of a batch is free: without a watch on it, it would hide the roll."""
    batch, by = sideways[SIDES[0]].batches[0], np.deg2rad(turned_deg)
    assert batch.roll_rate_radps is not None
    turned = replace(
        batch,
        pitch_rate_radps=np.cos(by) * batch.pitch_rate_radps - np.sin(by) * batch.roll_rate_radps,
        roll_rate_radps=np.cos(by) * batch.roll_rate_radps + np.sin(by) * batch.pitch_rate_radps,
    )
    assert weighed(turned, rolling).rejected in ((Why.SENSOR_CHANGED,), (Why.MODEL_MISFIT,))
    assert weighed(turned, replace(rolling, misfit_limit=100.0)).rejected == (Why.SENSOR_CHANGED,)  # by the watch alone


def test_a_gyro_that_is_noisy_is_not_taken_for_a_turned_one(
    sideways: dict[tuple[float, float, float], StatedDrive], rolling: VehicleModel
) -> None:
    batch = sideways[SIDES[0]].batches[0]
    noise = 5.0 * SENSORS.imu.gyro.noise_density * (batch.rate_hz / 2.0) ** 0.5
    rng = np.random.default_rng(7)
    noisy = replace(batch, pitch_rate_radps=batch.pitch_rate_radps + rng.normal(0.0, noise, len(batch.speed_mps)))
    found = weighed(noisy, rolling)
    assert found.rejected in ((), (Why.SENSOR_NOISY,))
