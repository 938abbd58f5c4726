"""A table: each fault, what it leaves alone, and what it does from its moment on."""

from collections.abc import Callable

import numpy as np
import pytest
from support.sensor_faults import Fault, with_fault

from gateway.records import F64
from gateway.sim.sensors import Recording

N, M, FROM_NS = 1000, 50, 6_000_000_000


@pytest.fixture
def sound() -> Recording:
    rng = np.random.default_rng(1)
    accel = rng.normal([0.0, 0.0, 9.81], 1.0, (N, 3))
    return Recording(
        imu_t_ns=np.arange(N) * 10_000_000,
        accel_mps2=accel,
        gyro_radps=0.05 * rng.standard_normal((N, 3)),
        gps_t_ns=np.arange(M) * 200_000_000,
        gps_speed_mps=14.0 + rng.standard_normal(M),
        gps_fix=np.ones(M, dtype=np.bool_),
    )


def is_held(samples: F64) -> bool:
    return bool(np.all(samples == samples[0]))


EFFECTS: dict[Fault, Callable[[Recording, Recording], bool]] = {
    Fault.ACCELEROMETER_STUCK: lambda bad, ok: is_held(bad.accel_mps2[599:]),
    Fault.GYRO_STUCK: lambda bad, ok: is_held(bad.gyro_radps[599:]),
    Fault.ACCELEROMETER_SATURATED: lambda bad, ok: bool(np.mean(np.abs(bad.accel_mps2[600:, 2]) == 50.0) > 0.5),
    Fault.GYRO_SATURATED: lambda bad, ok: bool(np.mean(np.abs(bad.gyro_radps[600:]) == 5.0) > 0.5),
    Fault.IMU_UNPLUGGED: lambda bad, ok: len(bad.imu_t_ns) == len(bad.accel_mps2) == len(bad.gyro_radps) == 600,
    Fault.GPS_UNPLUGGED: lambda bad, ok: len(bad.gps_t_ns) == len(bad.gps_speed_mps) == len(bad.gps_fix) == 30,
    Fault.GPS_NO_FIX: lambda bad, ok: not bad.gps_fix[30:].any() and not bad.gps_speed_mps[30:].any(),
    Fault.GPS_FROZEN: lambda bad, ok: is_held(bad.gps_speed_mps[29:]) and bool(bad.gps_fix.all()),
    Fault.AXES_SWAPPED: lambda bad, ok: bool(
        np.array_equal(bad.accel_mps2[600:, 0], ok.accel_mps2[600:, 2])
        and np.array_equal(bad.gyro_radps[600:, 2], ok.gyro_radps[600:, 0])
    ),
    Fault.ACCELERATION_SIGN_FLIPPED: lambda bad, ok: bool(
        np.array_equal(bad.accel_mps2[600:, 2], -ok.accel_mps2[600:, 2])
    ),
    Fault.PITCH_SIGN_FLIPPED: lambda bad, ok: bool(np.array_equal(bad.gyro_radps[600:, 1], -ok.gyro_radps[600:, 1])),
}


@pytest.mark.parametrize("fault", Fault)
def test_a_fault_does_what_its_name_says(fault: Fault, sound: Recording) -> None:
    assert EFFECTS[fault](with_fault(sound, fault, FROM_NS), sound)


@pytest.mark.parametrize("fault", Fault)
def test_before_its_moment_nothing_changes(fault: Fault, sound: Recording) -> None:
    bad = with_fault(sound, fault, FROM_NS)
    for name, before in (("accel_mps2", 600), ("gyro_radps", 600), ("gps_speed_mps", 30), ("gps_fix", 30)):
        assert np.array_equal(getattr(bad, name)[:before], getattr(sound, name)[:before])
    never = with_fault(sound, fault, 10**18)
    assert np.array_equal(never.accel_mps2, sound.accel_mps2)
    assert np.array_equal(never.gps_speed_mps, sound.gps_speed_mps)


@pytest.mark.parametrize("fault", Fault)
def test_the_sound_recording_stays_as_it_was(fault: Fault, sound: Recording) -> None:
    copies = sound.accel_mps2.copy(), sound.gyro_radps.copy(), sound.gps_speed_mps.copy()
    with_fault(sound, fault, FROM_NS)
    assert all(map(np.array_equal, copies, (sound.accel_mps2, sound.gyro_radps, sound.gps_speed_mps)))
