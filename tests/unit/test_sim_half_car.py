"""With its nonlinearities off, the full car is the half-car of the textbooks."""

import math

import numpy as np
import pytest

from gateway.records import C128, F64
from gateway.sim.drive import Drive
from gateway.sim.ride import ride
from gateway.sim.road import Road
from gateway.sim.vans import LARGE_VAN, PAPER_VAN
from gateway.sim.vehicle import Load, Vehicle

PERIOD_S = 10.0
LEAD_S = 12.0
FREQUENCIES_HZ = np.arange(0.5, 12.05, 0.1)


def half_car(vehicle: Vehicle, load: Load, speed_mps: float, freq_hz: F64) -> C128:
    """Heave of the empty body's CoG place and pitch (m, 2) to a road of unit height, the rear axle delayed.

    Lagrange for two rigid bodies on two springs and two wheels; written from the equations, not from the simulator.
    """
    a = vehicle.cog_position_m
    b = vehicle.wheelbase_m - a
    offset = load.position_m - a  # behind the body's CoG: moves by heave + offset * pitch
    total = vehicle.sprung_kg + load.mass_kg
    common_height = (vehicle.sprung_kg * vehicle.cog_height_m + load.mass_kg * load.height_m) / total
    inertia = (
        vehicle.pitch_inertia_kgm2
        + load.mass_kg * (load.length_m**2 + load.tall_m**2) / 12.0
        + vehicle.sprung_kg * (vehicle.cog_height_m - common_height) ** 2
        + load.mass_kg * (load.height_m - common_height) ** 2
        + load.mass_kg * offset**2
    )
    mass = np.zeros((4, 4))
    mass[:2, :2] = [[total, load.mass_kg * offset], [load.mass_kg * offset, inertia]]
    mass[2, 2], mass[3, 3] = 2 * vehicle.front.wheel.unsprung_kg, 2 * vehicle.rear.wheel.unsprung_kg
    answers = np.empty((len(freq_hz), 2), dtype=complex)
    for row, frequency in enumerate(freq_hz):
        s = 2j * math.pi * frequency
        stiffness = np.zeros((4, 4), dtype=complex)
        force = np.zeros(4, dtype=complex)
        for wheel, (axle, lever) in enumerate(((vehicle.front, -a), (vehicle.rear, b))):
            damper = (axle.damper.compression_nspm + axle.damper.rebound_nspm) / 2.0
            suspension = 2 * (axle.spring.rate_npm + damper * s)
            tyre = 2 * (axle.wheel.tyre_npm + axle.wheel.tyre_nspm * s)
            travel = np.zeros(4)
            travel[[0, 1, 2 + wheel]] = 1.0, lever, -1.0
            stiffness += suspension * np.outer(travel, travel)
            stiffness[2 + wheel, 2 + wheel] += tyre
            delay = 0.0 if wheel == 0 else vehicle.wheelbase_m / speed_mps
            force[2 + wheel] = tyre * np.exp(-s * delay)
        answers[row] = np.linalg.solve(mass * s * s + stiffness, force)[:2]
    return answers


@pytest.mark.parametrize("speed_mps", [8.0, 50.0 / 3.6, 28.0])
@pytest.mark.parametrize(
    ("vehicle", "load"),
    [(PAPER_VAN, Load(1e-6, 1.4)), (PAPER_VAN, Load(420.0, 2.6, height_m=1.1)), (LARGE_VAN, Load(700.0, 1.0))],
)
def test_transfer_functions_equal_the_closed_form(vehicle: Vehicle, load: Load, speed_mps: float) -> None:
    linear = vehicle.linear()
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
