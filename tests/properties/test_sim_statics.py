"""Statics hold for every vehicle and load; whatever its legs, a drive is smooth and covers the way its speed says."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.textbook import linearised, static_axle_loads_kg

from gateway.sim.parameters import Load, axle_loads_kg, cg_left_m, front_share_pct, load_for_share, payload_kg
from gateway.sim.ride import ride, wheel_loads_kg
from gateway.sim.road import PaperRoad
from gateway.sim.speed_profile import JERK_MPS3, STEP_S, Leg, constant, drive_of
from gateway.sim.vans import PAPER_VAN, VANS

vehicles = st.sampled_from(list(VANS.values()))
loads = st.lists(
    st.builds(
        Load,
        mass_kg=st.floats(5.0, 300.0),
        position_m=st.floats(0.2, 3.4),
        left_m=st.floats(-0.5, 0.5),
        height_m=st.floats(0.4, 1.6),
        resonance_hz=st.sampled_from([float("inf"), 11.0]),
    ),
    max_size=3,
).map(tuple)


@given(vehicle=vehicles, load=loads)
def test_the_models_equilibrium_is_the_lever_rule(vehicle, load):
    """Moments about the axles: independent of springs, progression, stops and tyres."""
    assert static_axle_loads_kg(vehicle, load) == pytest.approx(axle_loads_kg(vehicle, load), rel=1e-9)


@given(vehicle=vehicles, load=loads)
def test_axle_loads_add_up_to_the_weight(vehicle, load):
    unsprung = 2 * (vehicle.front.wheel.unsprung_kg + vehicle.rear.wheel.unsprung_kg)
    assert sum(axle_loads_kg(vehicle, load)) == pytest.approx(vehicle.sprung_kg + unsprung + payload_kg(load))


@given(mass_kg=st.floats(100.0, 450.0), share_pct=st.floats(46.0, 53.0))
def test_a_load_can_be_placed_for_a_share(mass_kg, share_pct):
    assert front_share_pct(PAPER_VAN, (load_for_share(PAPER_VAN, mass_kg, share_pct),)) == pytest.approx(share_pct)


@given(mass_kg=st.floats(0.0, 450.0), position_m=st.floats(0.0, 2.8))
def test_the_papers_van_follows_equation_3(mass_kg, position_m):
    expected = 100.0 * (1240.0 / 2.0 + (1.0 - position_m / 2.8) * mass_kg) / (1240.0 + mass_kg)
    assert front_share_pct(PAPER_VAN, (Load(mass_kg, position_m),)) == pytest.approx(expected)


@given(share_pct=st.sampled_from([20.0, 40.0, 80.0]))
def test_a_share_out_of_reach_is_refused(share_pct):
    with pytest.raises(ValueError, match="behind the front axle"):
        load_for_share(PAPER_VAN, 50.0, share_pct)


@given(seed=st.integers(0, 2**31), gain=st.floats(0.2, 3.0))
def test_the_textbook_car_is_linear(seed, gain):
    """Twice the road, twice the motion."""
    rng = np.random.default_rng(seed)
    drive, road = constant(12.0, 2.0, rng, jitter_std_mps=0.0), PaperRoad(sigma_m=1e-4).lay(60.0, rng)
    higher = type(road)(road.step_m, gain * road.left_m, gain * road.right_m)
    one, other = (ride(linearised(PAPER_VAN), (), r, drive).acceleration for r in (road, higher))
    assert np.allclose(other, gain * one, atol=1e-7 * np.max(np.abs(one)) + 1e-9)


@given(vehicle=vehicles, load=loads)
def test_left_wheel_loads_follow_from_moments_about_the_right(vehicle, load):
    """Neither springs nor anti-roll bars move weight across the vehicle, only to and fro between its axles."""
    even = replace(vehicle, rear=replace(vehicle.rear, track_m=vehicle.front.track_m))
    front_left, front_right, rear_left, rear_right = wheel_loads_kg(even, load)
    sprung_kg = vehicle.sprung_kg + payload_kg(load)
    assert (front_left + rear_left) - (front_right + rear_right) == pytest.approx(
        2.0 * sprung_kg * cg_left_m(vehicle, load) / even.front.track_m, abs=1e-6
    )


speeds = st.one_of(st.just(0.0), st.floats(3.0, 36.0))
legs = st.lists(st.builds(Leg, speeds, st.floats(0.0, 60.0), st.floats(0.4, 3.0)), min_size=1, max_size=6)


@given(legs=legs, start_mps=speeds)
def test_acceleration_and_jerk_stay_bounded(legs, start_mps):
    drive = drive_of(legs, start_mps)
    acceleration = np.diff(drive.speed_mps) / STEP_S
    sharpest = max(leg.acceleration_mps2 for leg in legs)
    assert np.max(np.abs(acceleration), initial=0.0) <= sharpest + 1e-6
    assert np.max(np.abs(np.diff(acceleration)), initial=0.0) / STEP_S <= 1.001 * JERK_MPS3 + 1e-6


@given(legs=legs, start_mps=speeds)
def test_it_begins_and_ends_at_the_speeds_asked(legs, start_mps):
    drive = drive_of(legs, start_mps)
    assert drive.speed_mps[0] == pytest.approx(start_mps, abs=1e-9)
    assert drive.speed_mps[-1] == pytest.approx(legs[-1].speed_mps, abs=1e-6)
    low, high = (bound([start_mps, *(leg.speed_mps for leg in legs)]) for bound in (min, max))
    assert low - 1e-9 <= np.min(drive.speed_mps)
    assert np.max(drive.speed_mps) <= high + 1e-9


@given(legs=legs, start_mps=speeds, cut=st.floats(0.0, 1.0))
def test_the_way_adds_up_over_any_cut(legs, start_mps, cut):
    drive = drive_of(legs, start_mps)
    middle_s = round(cut * drive.duration_s / STEP_S) * STEP_S
    first, second = drive.part(0.0, middle_s), drive.part(middle_s, drive.duration_s)
    assert first.travelled_m[-1] + second.travelled_m[-1] == pytest.approx(drive.travelled_m[-1], abs=1e-6)
    assert np.all(np.diff(drive.travelled_m) >= 0.0)
