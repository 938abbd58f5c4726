"""The car that rolls against statics, symmetry, the half-car and a single oscillator."""

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.half_car_road import CAR
from support.rolling_car import HALF_TRACK_M, ROLLING_CAR

from gateway.core.cross_spectrum.model.half_car import frequency_response
from gateway.core.cross_spectrum.model.rolling_car import (
    RollingCar,
    RollingResponse,
    SidewaysLoad,
    rolling_response,
)
from gateway.records import C128

FREQ_HZ = np.array([0.7, 1.4, 2.1, 3.3, 5.0, 9.0, 13.0])
OMEGA = 2.0 * np.pi * FREQ_HZ
LEFT = SidewaysLoad(300.0, 0.47, 0.06)
STIFF = 1e13


def square(car: RollingCar) -> RollingCar:
    """Its gyro square to the vehicle and in time, so that its rows are pitch and roll."""
    return replace(car, gyro_yaw_rad=0.0, half_car=replace(car.half_car, gyro_lag_s=0.0))


def paths(response: RollingResponse) -> dict[str, C128]:
    return {field.name: getattr(response, field.name) for field in fields(response)}


@pytest.mark.parametrize("load", [SidewaysLoad(0.0, 0.52, 0.0), LEFT], ids=["empty", "loaded on the left"])
@pytest.mark.parametrize(("left_m", "right_m"), [(1.0, 1.0), (1.0, 0.0), (0.3, -0.5)])
def test_slowly_the_body_follows_both_tracks(load: SidewaysLoad, left_m: float, right_m: float) -> None:
    """Heave is the tracks' mean and roll their difference over the width, whatever lies where on uneven springs."""
    slow_hz = np.array([1e-3])
    omega = 2.0 * np.pi * slow_hz
    stiffening = replace(CAR, rear=replace(CAR.rear, spring_slope_per_kn=0.2))
    r = rolling_response(square(replace(ROLLING_CAR, half_car=stiffening)), load, slow_hz)
    mean, half_difference = (left_m + right_m) / 2.0, (left_m - right_m) / 2.0
    acceleration, pitch_rate, roll_rate = (
        mean * (r.together_front + r.together_rear) + half_difference * (r.against_front + r.against_rear)
    )[:, 0]
    roll = (left_m - right_m) / (2.0 * HALF_TRACK_M)
    assert acceleration / -(omega[0] ** 2) == pytest.approx(mean + ROLLING_CAR.sensor_left_m * roll, abs=1e-4)
    assert pitch_rate / (1j * omega[0]) == pytest.approx(0.0, abs=1e-4)
    assert roll_rate / (1j * omega[0]) == pytest.approx(roll, abs=1e-4)


@given(
    cg_left_m=st.floats(-0.15, 0.15),
    payload_kg=st.floats(0.0, 600.0),
    front_share=st.floats(0.35, 0.6),
    sensor_left_m=st.floats(-0.6, 0.6),
    yaw_rad=st.floats(-0.1, 0.1),
    slope=st.floats(-0.1, 0.3),
)
def test_in_the_mirror_left_is_right(
    cg_left_m: float, payload_kg: float, front_share: float, sensor_left_m: float, yaw_rad: float, slope: float
) -> None:
    """Mirrored, roll turns over where both tracks are alike; where one is against the other, all but roll does."""
    body = replace(CAR, rear=replace(CAR.rear, spring_slope_per_kn=slope))
    car = replace(ROLLING_CAR, half_car=body, sensor_left_m=sensor_left_m, gyro_yaw_rad=yaw_rad)
    mirrored = replace(car, sensor_left_m=-sensor_left_m, gyro_yaw_rad=-yaw_rad, empty_left_m=-ROLLING_CAR.empty_left_m)
    one = rolling_response(car, SidewaysLoad(payload_kg, front_share, cg_left_m), FREQ_HZ)
    other = rolling_response(mirrored, SidewaysLoad(payload_kg, front_share, -cg_left_m), FREQ_HZ)
    turned = np.array([1.0, 1.0, -1.0])[:, None]
    for name, path in paths(one).items():
        sign = 1.0 if name.startswith("together") else -1.0
        np.testing.assert_allclose(paths(other)[name], sign * turned * path, rtol=1e-9, atol=1e-12, err_msg=name)


@pytest.mark.parametrize(("payload_kg", "front_share"), [(0.0, 0.52), (150.0, 0.5), (450.0, 0.42)])
def test_on_the_centre_line_it_is_the_half_car_and_roll_stands_apart(payload_kg: float, front_share: float) -> None:
    car = replace(ROLLING_CAR, sensor_left_m=0.0, gyro_yaw_rad=0.0, empty_left_m=0.0)
    rolling = rolling_response(car, SidewaysLoad(payload_kg, front_share, 0.0), FREQ_HZ)
    flat = frequency_response(CAR, payload_kg, front_share, FREQ_HZ)
    for together, expected in (
        (rolling.together_front, (flat.acceleration_front, flat.pitch_rate_front)),
        (rolling.together_rear, (flat.acceleration_rear, flat.pitch_rate_rear)),
    ):
        np.testing.assert_allclose(together[:2], np.stack(expected), rtol=1e-12)
        np.testing.assert_array_equal(together[2], 0.0)
    for against in (rolling.against_front, rolling.against_rear):
        np.testing.assert_array_equal(against[:2], 0.0)
        assert np.all(np.abs(against[2]) > 0.0)


@given(further_left_m=st.floats(-1.0, 1.0))
def test_a_sensor_further_left_reads_so_much_more_of_the_roll_acceleration(further_left_m: float) -> None:
    car = square(ROLLING_CAR)
    moved = replace(car, sensor_left_m=ROLLING_CAR.sensor_left_m + further_left_m)
    before, after = (paths(rolling_response(one, LEFT, FREQ_HZ)) for one in (car, moved))
    for name, path in before.items():
        roll = path[2] / (1j * OMEGA)
        lever = -(OMEGA**2) * further_left_m * roll
        np.testing.assert_allclose(after[name][0], path[0] + lever, rtol=1e-9, atol=1e-9, err_msg=name)
        np.testing.assert_array_equal(after[name][1:], path[1:])


def test_the_side_that_carries_more_moves_more() -> None:
    """Below its resonances a body overshoots the road, and the more so the heavier it is."""
    one_hz = np.array([1.0])
    car = square(replace(ROLLING_CAR, sensor_left_m=0.0, empty_left_m=0.0))
    left, right = (rolling_response(car, SidewaysLoad(300.0, 0.47, y), one_hz) for y in (0.06, -0.06))
    lifted, other = (r.together_front + r.together_rear for r in (left, right))
    np.testing.assert_allclose(lifted[2], -other[2])
    roll_per_heave = (lifted[2] / (1j * 2.0 * np.pi)) / (lifted[0] / -((2.0 * np.pi) ** 2))
    assert roll_per_heave[0].real > 0.0
