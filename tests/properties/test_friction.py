"""Friction: the law by which an axle stiffens where it moves less, and that it is learnt and allowed for."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.half_car_road import CAR, VAN, batch_over_road, weighed_as_known

from gateway.calibration.half_car.fit import calibrate_cross_spectrum
from gateway.calibration.half_car.prior import prior_of
from gateway.calibration.known_run import KnownRun
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.measured import log_amplitude_of
from gateway.core.cross_spectrum.model.friction import (
    LEAST_LEFT,
    MOST,
    MOST_APART,
    at_levels,
    level_weights,
    levels,
)
from gateway.core.cross_spectrum.model.half_car import Axle, HalfCar
from gateway.core.cross_spectrum.model.parameters import INDEX, PARAMETERS, Ground, half_car, is_positive
from gateway.records import F64, Batch, Why

ROADS_MPS2 = (0.4, 0.8, 1.4)
MOVED_MPS2 = 0.8  # where friction makes up these shares of a rate
DAMPER_SHARE, SPRING_SHARE = 0.35, 0.04
amplitudes, factors = st.floats(-2.0, 2.0), st.floats(-3.0, 3.0)


def in_units(theta: F64, name: str) -> float:
    """One parameter of a vector (p,) in the unit its name ends in."""
    entry = float(theta[INDEX[name]])
    return float(np.exp(entry)) if is_positive(name) else entry


def with_friction(shaken_mps2: float) -> HalfCar:
    """CAR as it acts on a road that shakes it so much, with friction."""

    def axle(smooth: Axle) -> Axle:
        ratio = MOVED_MPS2 / shaken_mps2
        return replace(
            smooth,
            damper_nspm=smooth.damper_nspm * (1.0 - DAMPER_SHARE + DAMPER_SHARE * ratio),
            spring_npm=smooth.spring_npm * (1.0 - SPRING_SHARE + SPRING_SHARE * ratio),
        )

    return replace(CAR, front=axle(CAR.front), rear=axle(CAR.rear))


def drive(payload_kg: float, front_share_pct: float, seed: int, shaken_mps2: float, car: HalfCar) -> Batch:
    return batch_over_road(payload_kg, front_share_pct, seed, shaken_mps2=shaken_mps2, car=car, noise=0.01)


def axles_at_levels(theta: F64) -> tuple[Axle, Axle]:
    car = at_levels(half_car(theta[None], Ground.of(VAN)), theta)
    return car.front, car.rear


def test_where_it_moves_as_usual_nothing_changes() -> None:
    theta = prior_of(VAN).mean
    still = half_car(theta, Ground.of(VAN))
    for one, moved in zip((still.front, still.rear), axles_at_levels(theta), strict=True):
        assert moved.damper_nspm[1] == one.damper_nspm
        assert moved.spring_npm[1] == one.spring_npm


@given(share=st.floats(-0.2, 1.0))
def test_a_rate_goes_with_one_less_p_and_p_over_s(share: float) -> None:
    theta = prior_of(VAN).mean.copy()
    theta[INDEX["damper_rear_nspm"]] = np.log(4000.0)
    theta[INDEX["damper_friction_rear"]] = share
    _, rear_axle = axles_at_levels(theta)
    for (_, rear), damper_nspm in zip(levels(), rear_axle.damper_nspm, strict=True):
        left = max(LEAST_LEFT, 1.0 - share + share / np.exp(rear))
        assert damper_nspm == pytest.approx(4000.0 * left)


@given(front=amplitudes, rear=amplitudes, a=factors, b=factors, c=factors, d=factors, e=factors)
def test_between_levels_parabolas_are_met_exactly(
    front: float, rear: float, a: float, b: float, c: float, d: float, e: float
) -> None:
    """One of what both axles have in common, one of what sets them apart."""

    def value(front: F64, rear: F64) -> F64:
        u = np.clip(0.5 * (front + rear), -MOST, MOST)
        v = np.clip(0.5 * (front - rear), -MOST_APART, MOST_APART)
        return np.asarray(a + b * u + c * u**2 + d * v + e * v**2)

    met = level_weights(np.array([[front, rear]])) @ value(*np.array(levels()).T)
    assert met[0] == pytest.approx(float(value(np.array(front), np.array(rear))), abs=1e-9)


@given(ratio=st.floats(0.1, 10.0))
def test_twice_the_movement_is_one_logarithm_of_two_more(ratio: float) -> None:
    a, g = np.array([0.3, 2.0, 0.1]), np.array([0.01, 0.4, 0.02])
    moved = log_amplitude_of(ratio**2 * a, ratio**2 * g) - log_amplitude_of(a, g)
    assert moved == pytest.approx(np.log(ratio))


def calibrated(car_on: Callable[[float], HalfCar]) -> CrossSpectrumCalibration:
    """From three loads on three roads each; ``car_on`` is the vehicle on a road that shakes it so much (m/s2)."""
    runs = []
    for number, (payload_kg, share_pct) in enumerate([(0.0, 52.0), (200.0, 50.0), (400.0, 44.0)]):
        batches = [
            drive(payload_kg, share_pct, 10 * number + i, shaken_mps2, car_on(shaken_mps2))
            for i, shaken_mps2 in enumerate(ROADS_MPS2)
        ]
        runs.append(KnownRun(number, "", payload_kg, share_pct, tuple(batches)))
    return calibrate_cross_spectrum(runs, VAN)


@pytest.fixture(scope="module")
def calibration() -> CrossSpectrumCalibration:
    return calibrated(with_friction)


def test_where_there_is_no_friction_none_is_found() -> None:
    """By chance one part of a drive moves more than another; that alone must not look like friction."""
    found = calibrated(lambda shaken_mps2: CAR)
    for end in ("front", "rear"):
        assert in_units(found.parameters, f"damper_friction_{end}") == pytest.approx(0.0, abs=0.05)
        assert in_units(found.parameters, f"spring_friction_{end}") == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize("end", ["front", "rear"])
@pytest.mark.parametrize(("kind", "share"), [("damper", DAMPER_SHARE), ("spring", SPRING_SHARE)])
def test_calibration_finds_the_friction_there_is(
    kind: str, share: float, end: str, calibration: CrossSpectrumCalibration
) -> None:
    entry = INDEX[f"{kind}_friction_{end}"]
    std = calibration.covariance[entry, entry] ** 0.5
    assert std < 0.6 * prior_of(VAN).std[entry]
    usually = share * MOVED_MPS2 / np.exp(np.mean(np.log(ROADS_MPS2)))
    assert calibration.parameters[entry] == pytest.approx(usually / (1.0 - share + usually), abs=3.0 * std)


@pytest.mark.parametrize("shaken_mps2", [0.35, 0.6, 1.6])
def test_a_load_reads_the_same_on_smooth_and_on_rough_roads(
    shaken_mps2: float, calibration: CrossSpectrumCalibration
) -> None:
    batch = drive(300.0, 48.0, 77, shaken_mps2, with_friction(shaken_mps2))
    found = weighed_as_known(batch, calibration)
    assert found.payload.number == pytest.approx(300.0, abs=9.0)
    assert found.front_share.number == pytest.approx(48.0, abs=0.2)
    blind = calibration.parameters.copy()
    blind[[i for i, name in enumerate(PARAMETERS) if "_friction_" in name]] = 0.0
    without = weighed_as_known(batch, replace(calibration, parameters=blind))
    is_refused = without.rejected == (Why.MODEL_MISFIT,)  # dampers that no drift explains
    assert is_refused or abs(without.payload.number - 300.0) > 2.0 * abs(found.payload.number - 300.0)
