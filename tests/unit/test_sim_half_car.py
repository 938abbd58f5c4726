"""With its nonlinearities off, the full car is the half-car of the textbooks."""

import math

import numpy as np
import pytest
from support.textbook import half_car, linearised

from gateway.sim.drive import Drive
from gateway.sim.ride import ride
from gateway.sim.road import Road
from gateway.sim.vans import LARGE_VAN, PAPER_VAN
from gateway.sim.vehicle import Load, Vehicle

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
