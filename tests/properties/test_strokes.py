"""How fast each axle's springs move: by Newton's law, in time, and over what is usual."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import StateSpace, lsim
from support.half_car_road import CAR, RATE_HZ, VAN, batch_of, batch_over_road, parameters_of

from gateway.core.cross_spectrum.measured import CrossSpectra, cross_spectra_of
from gateway.core.cross_spectrum.model.half_car import (
    HalfCar,
    added_axle_masses_kg,
    frequency_response,
    strokes,
    suspension_npm,
)
from gateway.core.cross_spectrum.model.parameters import Ground
from gateway.core.cross_spectrum.model.reading import Reading
from gateway.core.cross_spectrum.model.strokes import log_stroke_speeds, with_strokes
from gateway.core.vehicle import Load
from gateway.records import F64, Batch

GROUND = Ground.of(VAN)
READING = Reading(VAN.wheelbase_m, (1.1, 14.0), 256)
EMPTY = Load(0.0, VAN.empty_front_share_pct)
STIFF = replace(CAR, front=replace(CAR.front, damper_mount_npm=1e9), rear=replace(CAR.rear, damper_mount_npm=1e9))


def spectra_of(batch: Batch) -> CrossSpectra:
    found = cross_spectra_of([batch], READING)
    assert found is not None
    return found


def over_all(spectra: CrossSpectra, log_speeds: F64) -> F64:
    """(2,) root mean square speeds of both axles, in m/s, over all segments."""
    return np.sqrt(np.average(np.exp(2.0 * log_speeds), axis=0, weights=spectra.n_segments[:, 0]))


@given(payload_kg=st.floats(0.0, 600.0), front_share_pct=st.floats(42.0, 56.0))
def test_what_the_springs_push_is_what_the_body_weighs_times_its_acceleration(
    payload_kg: float, front_share_pct: float
) -> None:
    """Newton's law, both axles together: a payload that stands firmly, a sensor over the centre of gravity."""
    share = front_share_pct / 100.0
    above = replace(CAR, sensor_position_m=(1.0 - share) * CAR.wheelbase_m, payload_mode_hz=1e4)
    freq_hz = np.array([0.3, 1.2, 3.0, 9.0, 14.0])
    omega = 2.0 * np.pi * freq_hz
    response = frequency_response(above, payload_kg, share, freq_hz)
    moved = (response.acceleration_front, response.acceleration_rear)
    added = added_axle_masses_kg(above, payload_kg, share)
    for acceleration, stretched in zip(moved, strokes(above, payload_kg, share, freq_hz), strict=True):
        push = sum(
            -suspension_npm(axle, added_kg, omega) * stroke
            for axle, added_kg, stroke in zip((above.front, above.rear), added, stretched, strict=True)
        )
        np.testing.assert_allclose(push, (above.empty_mass_kg + payload_kg) * acceleration, rtol=1e-4)


def test_on_a_road_of_long_waves_no_spring_moves() -> None:
    """What stretches them then is the body's inertia, which vanishes with frequency squared."""
    (one, another), _ = (np.abs(path) for path in strokes(CAR, 300.0, 0.48, np.array([0.01, 0.1])))
    assert one[1] < 0.01
    assert one[0] / one[1] == pytest.approx(0.01, rel=0.1)
    assert another[0] / another[1] == pytest.approx(0.01, rel=0.1)


def driven_in_time(car: HalfCar, speed_mps: float, seed: int) -> tuple[Batch, F64]:
    """Newton's equations of an empty half-car over a random road, step by step, and its rms stroke speeds (2,)."""
    m, share, length = car.empty_mass_kg, car.empty_front_share, car.wheelbase_m
    forward = np.array([(1.0 - share) * length, -share * length])  # of front and rear axle
    k, c, tyre, wheel = (
        np.array([getattr(axle, name) for axle in (car.front, car.rear)], float)
        for name in ("spring_npm", "damper_nspm", "tyre_npm", "unsprung_kg")
    )
    over = np.array([[1.0, -forward[0], -1.0, 0.0], [1.0, -forward[1], 0.0, -1.0]])  # strokes by heave, pitch, wheels
    mass = np.diag([m, float(car.pitch_inertia_kgm2), *wheel])
    stiffness = over.T @ np.diag(k) @ over + np.diag([0.0, 0.0, *tyre])
    damping = over.T @ np.diag(c) @ over
    by_road = np.vstack([np.zeros((2, 2)), np.diag(tyre)])
    zero, unit, inverse = np.zeros((4, 4)), np.eye(4), np.linalg.inv(mass)
    state = np.block([[zero, unit], [-inverse @ stiffness, -inverse @ damping]])
    n, fine = int(300.0 * RATE_HZ), 10
    step_s = 1.0 / (RATE_HZ * fine)
    late = round(length / speed_mps / step_s)
    rng = np.random.default_rng(seed)
    road_m = np.cumsum(rng.standard_normal(n * fine + late)) * 2e-4
    road_m -= np.convolve(road_m, np.ones(5000) / 5000, mode="same")  # no hills
    met = np.stack([road_m[late:], road_m[: n * fine]], axis=1)
    system = StateSpace(state, np.vstack([np.zeros((4, 2)), inverse @ by_road]), np.eye(8), np.zeros((8, 2)))
    _, y, _ = lsim(system, met, np.arange(n * fine) * step_s)
    acceleration = (y @ state.T + met @ system.B.T)[:, 4:6]
    place = forward[0] - float(car.sensor_position_m)  # ahead of the centre of gravity
    sensed, pitch_rate = acceleration[:, 0] - place * acceleration[:, 1], y[:, 5]
    spectrum = np.fft.rfft(y[:, 4:] @ over.T, axis=0) / (n * fine)
    freq_hz = np.fft.rfftfreq(n * fine, step_s)
    within = (freq_hz > READING.band_hz[0]) & (freq_hz < READING.band_hz[1])
    speeds = np.sqrt(2.0 * np.sum(np.abs(spectrum[within]) ** 2, axis=0))

    def slowly(signal: F64) -> F64:
        whole = np.fft.rfft(signal)
        whole[freq_hz > 0.45 * RATE_HZ] = 0.0
        return np.asarray(np.fft.irfft(whole, len(signal))[::fine])

    return batch_of(slowly(sensed), slowly(pitch_rate), np.full(n, speed_mps)), speeds


@pytest.mark.parametrize("speed_mps", [7.0, 22.0])
def test_springs_move_as_fast_as_newtons_equations_make_them(speed_mps: float) -> None:
    """Told from the body's sensors alone; no part of the model is in what is compared."""
    batch, speeds_mps = driven_in_time(STIFF, speed_mps, seed=int(speed_mps))
    spectra = spectra_of(batch)
    told = over_all(spectra, log_stroke_speeds(spectra, parameters_of(STIFF), EMPTY, GROUND))
    np.testing.assert_allclose(told, speeds_mps, rtol=0.06)


@given(ratio=st.floats(0.2, 5.0))
def test_twice_the_movement_is_twice_the_stroke(ratio: float) -> None:
    slow, fast = (spectra_of(batch_over_road(0.0, 52.0, 3, 60.0, shaken_mps2=0.6 * one)) for one in (1.0, ratio))
    a, b = (over_all(one, log_stroke_speeds(one, parameters_of(CAR), EMPTY, GROUND)) for one in (slow, fast))
    np.testing.assert_allclose(b / a, ratio, rtol=1e-4)


def test_a_load_that_calms_the_body_makes_no_road_smooth() -> None:
    """Where the sensors show as much movement under a load, the road is rougher and the springs move faster."""
    spectra = spectra_of(batch_over_road(0.0, 52.0, 3, 60.0))
    empty, loaded = (
        over_all(spectra, log_stroke_speeds(spectra, parameters_of(CAR), load, GROUND))
        for load in (EMPTY, Load(400.0, 46.0))
    )
    assert np.all(loaded > 1.1 * empty)


def test_where_it_moves_as_usual_nothing_is_told_of_friction() -> None:
    spectra = spectra_of(batch_over_road(0.0, 52.0, 3, 60.0))
    theta = parameters_of(CAR)
    front_mps, rear_mps = over_all(spectra, log_stroke_speeds(spectra, theta, EMPTY, GROUND)).tolist()
    usual = replace(spectra, reading=replace(spectra.reading, usual_stroke_mps=(front_mps, rear_mps)))
    told = with_strokes(usual, theta, EMPTY, GROUND)
    np.testing.assert_allclose(over_all(told, told.log_movement), 1.0, rtol=1e-9)
    assert with_strokes(spectra, theta, EMPTY, GROUND) is spectra
    np.testing.assert_array_equal(spectra.log_movement, np.repeat(spectra.log_amplitude, 2, axis=1))
