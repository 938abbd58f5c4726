"""The full car obeys mechanics: energy, momentum, equilibrium, convergence, and the half-car of the textbooks."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from support.textbook import half_car, linearised

from gateway.records import F64
from gateway.sim import compiled
from gateway.sim.chassis import Chassis, chassis_of
from gateway.sim.integrator import Course, integrate
from gateway.sim.parameters import Axle, Damper, Load, Vehicle, axle_loads_kg
from gateway.sim.ride import ride
from gateway.sim.road import PaperRoad, Road, iso_road
from gateway.sim.speed_profile import Drive, Leg, constant, drive_of
from gateway.sim.vans import LARGE_VAN, PAPER_VAN, SMALL_VAN
from gateway.units import STANDARD_GRAVITY_MPS2

FLAT = Road(0.05, np.zeros(60_000), np.zeros(60_000))


def flat_course(vehicle: Vehicle) -> Course:
    level = np.zeros(2)
    return Course(1.0, level, level, vehicle.wheelbase_m, 1.0, level, level, level, level)


def without_losses(vehicle: Vehicle) -> Vehicle:
    def free(axle: Axle) -> Axle:
        return replace(axle, damper=Damper(0.0, 0.0), wheel=replace(axle.wheel, tyre_nspm=0.0, runout_m=0.0))

    return replace(vehicle, front=free(vehicle.front), rear=free(vehicle.rear))


def energy_j(vehicle: Vehicle, loads: tuple[Load, ...], chassis: Chassis, position: F64, rate: F64) -> float:
    """Kinetic, elastic and potential energy; forces integrated by hand for every spring, stop and tyre."""
    g = STANDARD_GRAVITY_MPS2
    total = 0.5 * rate[:3] @ np.linalg.inv(chassis.inverse_mass) @ rate[:3] - chassis.weight @ position[:3]
    for wheel in range(4):
        axle = vehicle.front if wheel < 2 else vehicle.rear
        forward = vehicle.cog_position_m - (0.0 if wheel < 2 else vehicle.wheelbase_m)
        left = axle.track_m / 2.0 * (1 if wheel % 2 == 0 else -1)
        share = vehicle.empty_front_share_pct / 100.0
        preload = g * vehicle.sprung_kg / 2.0 * (share if wheel < 2 else 1.0 - share)
        unsprung = axle.wheel.unsprung_kg
        lift = position[3 + wheel]
        e = lift - (position[0] - forward * position[1] + left * position[2])
        spring = axle.spring
        total += preload * e + spring.rate_npm * e**2 / 2 + spring.progression_npm2 * max(e, 0.0) ** 3 / 6
        total += spring.stop_npm2 * max(e - spring.bump_clearance_m, 0.0) ** 3 / 3
        total += spring.stop_npm2 * max(-e - spring.rebound_clearance_m, 0.0) ** 3 / 3
        pressed = max(preload + unsprung * g - axle.wheel.tyre_npm * lift, 0.0)
        total += pressed**2 / (2 * axle.wheel.tyre_npm)
        total += 0.5 * unsprung * rate[3 + wheel] ** 2 + unsprung * g * lift
    for axle, first in ((vehicle.front, 3), (vehicle.rear, 5)):
        twist = position[first] - position[first + 1] - axle.track_m * position[2]
        total += 0.5 * axle.anti_roll_npm * twist**2
    for k, load in enumerate(load for load in loads if load.is_elastic):
        forward = vehicle.cog_position_m - load.position_m
        base = load.mass_kg * (2 * math.pi * load.resonance_hz) ** 2
        squeeze = position[0] - forward * position[1] + load.left_m * position[2] - position[7 + k]
        total += load.mass_kg * g * squeeze + 0.5 * base * squeeze**2
        total += 0.5 * load.mass_kg * rate[7 + k] ** 2 + load.mass_kg * g * position[7 + k]
    return float(total)


@pytest.mark.parametrize(("drop_m", "drift"), [(0.003, 1e-8), (0.15, 1e-4)])  # the higher one meets stops and lifts off
def test_without_dampers_energy_is_conserved(drop_m: float, drift: float) -> None:
    vehicle = without_losses(SMALL_VAN)
    loads = (Load(200.0, 2.2, 0.3), Load(100.0, 1.5, -0.2, resonance_hz=9.0, damping_ratio=0.0))
    chassis = chassis_of(vehicle, loads)
    position, rate = np.zeros(8), np.zeros(8)
    position[:] = drop_m
    position[1:3] = 0.1 * drop_m, -0.2 * drop_m
    before = energy_j(vehicle, loads, chassis, position, rate)
    _, tyre_n = integrate(chassis, flat_course(vehicle), position, rate, 2e-4, 5, 10_001)
    swing = energy_j(vehicle, loads, chassis, np.zeros(8), np.zeros(8)) - before
    after = energy_j(vehicle, loads, chassis, position, rate)
    assert (np.min(tyre_n) == 0.0) == (drop_m > 0.1)
    assert after == pytest.approx(before, abs=drift * abs(swing))


def test_halving_the_step_divides_the_error_by_sixteen() -> None:
    """A fourth-order method on a smooth system."""
    vehicle = linearised(PAPER_VAN)
    chassis = chassis_of(vehicle, (Load(300.0, 2.0),))

    def end_state(step_s: float) -> F64:
        position, rate = np.full(7, 0.004), np.zeros(7)
        n_records = round(1.0 / step_s)  # one row a step and the step after the last row
        integrate(chassis, flat_course(vehicle), position, rate, step_s, 1, n_records)
        return np.concatenate((position, rate))

    exact = end_state(1.25e-4)
    coarse, fine = (np.max(np.abs(end_state(step) - exact)) for step in (4e-3, 2e-3))
    assert 12.0 < coarse / fine < 20.0


def test_the_default_step_is_fine_enough_on_a_rough_road() -> None:
    rng = np.random.default_rng(1)
    drive = constant(20.0, 20.0, rng)
    road = iso_road("C").lay(500.0, rng)
    coarse = ride(LARGE_VAN, (Load(500.0, 2.5),), road, drive)
    fine = ride(LARGE_VAN, (Load(500.0, 2.5),), road, drive, step_s=1.25e-4, record_every=16)
    assert len(coarse) == len(fine)
    error = np.std(coarse.acceleration - fine.acceleration, axis=0) / np.std(fine.acceleration, axis=0)
    assert np.all(error < 0.01)


@pytest.mark.parametrize("loads", [(), (Load(300.0, 2.6, 0.3),), (Load(250.0, 0.4, resonance_hz=12.0),)])
def test_a_vehicle_at_rest_stays_at_rest(loads: tuple[Load, ...]) -> None:
    still = ride(PAPER_VAN, loads, FLAT, Drive(np.zeros(101), np.zeros(101)))
    assert np.max(np.abs(still.acceleration)) < 1e-9
    assert np.ptp(still.position, axis=0) == pytest.approx(np.zeros(3), abs=1e-12)
    scales = still.tyre_n[-1].reshape(2, 2).sum(axis=1) / STANDARD_GRAVITY_MPS2
    assert scales == pytest.approx(axle_loads_kg(PAPER_VAN, loads), rel=1e-12)


def test_braking_moves_load_to_the_front() -> None:
    """m a h / l in the steady state; a nose that goes down."""
    loads = (Load(200.0, 2.0, height_m=1.0),)
    braking = drive_of([Leg(30.0, 4.0, 3.0), Leg(0.0, 3.0, 3.0)])
    driven = ride(PAPER_VAN, loads, FLAT, braking)
    steady = (driven.longitudinal_mps2 < -2.99) & (driven.t_s > 18.0) & (driven.t_s < 22.0)
    shifted = driven.tyre_n[steady][:, :2].sum(axis=1).mean() - driven.tyre_n[0, :2].sum()
    height_moment = 1240.0 * 0.70 + 200.0 * 1.0
    assert steady.sum() > 1000
    assert shifted == pytest.approx(3.0 * height_moment / 2.8, rel=0.005)
    assert driven.position[steady, 1].min() > driven.position[0, 1]


def test_a_left_turn_presses_the_right_wheels() -> None:
    n = 401
    lateral = np.minimum(np.arange(n) * 0.05, 2.0)
    driven = ride(PAPER_VAN, (), FLAT, Drive(np.full(n, 20.0), lateral))
    front_left, front_right, rear_left, rear_right = driven.tyre_n[-5000:].mean(axis=0)  # wheels are not quite round
    moment = (front_right - front_left + rear_right - rear_left) * 0.75
    assert moment == pytest.approx(1240.0 * 0.70 * 2.0, rel=0.01)
    assert driven.position[-1, 2] > 0.0


def test_friction_passes_more_of_a_smooth_road_on_to_the_body() -> None:
    """Below its friction a suspension hardly moves, so a smooth road reaches the body by the tyres alone."""
    rng = np.random.default_rng(5)
    drive, road = constant(14.0, 60.0, rng, jitter_std_mps=0.0), PaperRoad().lay(1000.0, rng)
    smooth = Road(road.step_m, 0.02 * road.left_m, 0.02 * road.right_m)
    textbook = linearised(PAPER_VAN)

    def gain(friction_n: float) -> float:
        def rubbing(axle: Axle) -> Axle:
            return replace(axle, damper=replace(axle.damper, friction_n=friction_n))

        vehicle = replace(textbook, front=rubbing(textbook.front), rear=rubbing(textbook.rear))
        rough_std, calm_std = (np.std(ride(vehicle, (), r, drive).acceleration[:, 0]) for r in (road, smooth))
        return float(calm_std / (0.02 * rough_std))

    assert gain(0.0) == pytest.approx(1.0, rel=1e-3)
    assert gain(40.0) > 1.2


def test_imbalance_shakes_at_the_wheels_frequency() -> None:
    speed_mps = 25.0
    driven = ride(PAPER_VAN, (), FLAT, Drive(np.full(801, speed_mps), np.zeros(801)))
    shaking = driven.acceleration[len(driven) // 2 :, 0]
    spectrum = np.abs(np.fft.rfft(shaking * np.hanning(len(shaking))))
    peak_hz = np.fft.rfftfreq(len(shaking), driven.step_s)[np.argmax(spectrum)]
    assert peak_hz == pytest.approx(speed_mps / (2 * math.pi * 0.30), abs=0.1)


def test_a_road_that_ends_too_early_is_refused() -> None:
    with pytest.raises(ValueError, match="needs 203 m of road, this one has 100 m"):
        ride(PAPER_VAN, (), PaperRoad().lay(100.0, np.random.default_rng(1)), Drive(np.full(401, 10.0), np.zeros(401)))


PERIOD_S = 10.0
LEAD_S = 12.0
FREQUENCIES_HZ = np.arange(0.5, 12.05, 0.1)


@pytest.mark.parametrize("speed_mps", [8.0, 50.0 / 3.6, 28.0])
@pytest.mark.parametrize(
    ("vehicle", "load"),
    [(PAPER_VAN, Load(1e-6, 1.4)), (PAPER_VAN, Load(420.0, 2.6, height_m=1.1)), (LARGE_VAN, Load(700.0, 1.0))],
)
def test_transfer_functions_equal_the_closed_form(vehicle: Vehicle, load: Load, speed_mps: float) -> None:
    linear = linearised(vehicle)
    level = np.random.default_rng(0).uniform(0.0, 2.0 * math.pi, len(FREQUENCIES_HZ))
    heights = 1e-4 * np.exp(1j * level)
    step_m = 0.01
    way_m = np.arange(round((speed_mps * (LEAD_S + PERIOD_S) + vehicle.wheelbase_m + 10.0) / step_m)) * step_m
    when_s = (way_m - vehicle.wheelbase_m) / speed_mps
    profile = np.zeros(len(way_m))
    for frequency, height in zip(FREQUENCIES_HZ, heights, strict=True):
        profile += (height * np.exp(2j * math.pi * frequency * when_s)).real
    quiet = Drive(
        np.full(round((LEAD_S + PERIOD_S) / 0.05) + 1, speed_mps), np.zeros(round((LEAD_S + PERIOD_S) / 0.05) + 1)
    )
    driven = ride(linear, (load,), Road(step_m, profile, profile), quiet)

    begin, n = round(LEAD_S / driven.step_s), round(PERIOD_S / driven.step_s)
    bins = np.rint(FREQUENCIES_HZ * PERIOD_S).astype(int)
    turn_back = np.exp(-2j * math.pi * FREQUENCIES_HZ * LEAD_S)
    expected = half_car(linear, load, speed_mps, FREQUENCIES_HZ)
    sensor_behind_cog_m = 3.2 - vehicle.cog_position_m
    s = 2j * math.pi * FREQUENCIES_HZ
    for measured, closed_form in (
        (driven.acceleration[:, 0] + sensor_behind_cog_m * driven.acceleration[:, 1],
         s * s * (expected[:, 0] + sensor_behind_cog_m * expected[:, 1])),
        (driven.rate[:, 1], s * expected[:, 1]),
    ):  # fmt: skip
        transfer = np.fft.rfft(measured[begin : begin + n])[bins] * 2.0 / n * turn_back / heights
        error = np.abs(transfer - closed_form)
        assert np.max(error / np.maximum(np.abs(closed_form), 0.05 * np.max(np.abs(closed_form)))) < 0.01


def test_the_integrator_compiles_without_a_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def njit_in_a_read_only_place(**options: object) -> Callable[[Callable[..., int]], Callable[..., int]]:
        asked.append(options.get("cache", False))
        if options.get("cache"):
            raise RuntimeError("cannot cache function: no locator available")
        return lambda function: function

    monkeypatch.setattr(compiled, "njit", njit_in_a_read_only_place)
    assert compiled.compiled(lambda x: x + 1)(2) == 3
    assert asked == [True, False]
