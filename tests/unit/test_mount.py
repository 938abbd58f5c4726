"""A sensor off the centre line and turned: what it reads, brought back to the centre line."""

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from support.half_car_road import CAR
from support.rolling_car import ROLLING_CAR

from gateway.core.cross_spectrum.model.reading import Mount
from gateway.core.cross_spectrum.model.rolling_car import SidewaysLoad, rolling_response
from gateway.records import C128

FREQ_HZ = np.linspace(0.5, 15.0, 30)
OMEGA = 2.0 * np.pi * FREQ_HZ


def process(seed: int) -> tuple[C128, C128, C128]:
    """Heave where the sensor's place along the vehicle is, pitch and roll of a body: random transforms (4, m)."""
    rng = np.random.default_rng(seed)
    heave, pitch, roll = rng.standard_normal((3, 4, len(FREQ_HZ))) + 1j * rng.standard_normal((3, 4, len(FREQ_HZ)))
    return heave, pitch, roll


def sensed(body: tuple[C128, C128, C128], left_m: float, yaw_rad: float, lag_s: float) -> tuple[C128, C128, C128]:
    """A gyro turned to the left by a small angle, late by lag_s; an accelerometer left_m left."""
    heave, pitch, roll = body
    late = 1j * OMEGA * np.exp(-1j * OMEGA * lag_s)
    return -(OMEGA**2) * (heave + left_m * roll), late * (pitch - yaw_rad * roll), late * (roll + yaw_rad * pitch)


@given(
    seed=st.integers(0, 2**31),
    left_m=st.floats(-0.8, 0.8),
    yaw_rad=st.floats(-0.1, 0.1),
    lag_s=st.floats(-0.02, 0.02),
)
def test_what_the_place_put_in_is_taken_out(seed: int, left_m: float, yaw_rad: float, lag_s: float) -> None:
    """Up to yaw^2, by which a small angle turned there and back is longer than it was."""
    body = process(seed)
    back = Mount(left_m, yaw_rad, lag_s).levelled(sensed(body, left_m, yaw_rad, lag_s), FREQ_HZ)
    wanted = sensed(body, 0.0, 0.0, lag_s)
    longer = 1.0 + yaw_rad**2
    np.testing.assert_allclose(back[1], longer * wanted[1], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(back[2], longer * wanted[2], rtol=1e-9, atol=1e-9)
    left_over = -left_m * yaw_rad**2 * -(OMEGA**2) * body[2]
    np.testing.assert_allclose(back[0], wanted[0] + left_over, rtol=1e-9, atol=1e-7)


@given(left_m=st.floats(-0.8, 0.8), yaw_rad=st.floats(-0.05, 0.05), lag_s=st.floats(-0.01, 0.01))
def test_it_undoes_what_the_rolling_car_senses(left_m: float, yaw_rad: float, lag_s: float) -> None:
    """Every path of a car with its sensor anywhere becomes that of the same car with it on the centre line."""
    load = SidewaysLoad(280.0, 0.48, -0.05)
    placed = replace(ROLLING_CAR, half_car=replace(CAR, gyro_lag_s=lag_s), sensor_left_m=left_m, gyro_yaw_rad=yaw_rad)
    square = replace(placed, sensor_left_m=0.0, gyro_yaw_rad=0.0)
    here, wanted = rolling_response(placed, load, FREQ_HZ), rolling_response(square, load, FREQ_HZ)
    for name in ("together_front", "together_rear", "against_front", "against_rear"):
        read, true = getattr(here, name), getattr(wanted, name)
        levelled = np.stack(Mount(left_m, yaw_rad, lag_s).levelled((read[0], read[1], read[2]), FREQ_HZ))
        scale = np.max(np.abs(np.concatenate([read, true])), axis=-1).reshape(2, 3).max(axis=0)[:, None]
        assert np.max(np.abs(levelled - true) / scale) < 1e-9 + 2.0 * yaw_rad**2, name


@given(seed=st.integers(0, 2**31), lag_s=st.floats(-0.02, 0.02))
def test_on_the_centre_line_and_square_nothing_is_moved(seed: int, lag_s: float) -> None:
    read = sensed(process(seed), 0.0, 0.0, lag_s)
    for one, other in zip(Mount(0.0, 0.0, lag_s).levelled(read, FREQ_HZ), read, strict=True):
        np.testing.assert_array_equal(one, other)
