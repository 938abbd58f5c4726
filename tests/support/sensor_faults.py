"""Sensor faults, each a change to a recording from one moment on."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from enum import StrEnum
from types import MappingProxyType
from typing import Final

import numpy as np

from gateway.records import F64, Bool
from gateway.sim.sensors import Recording


class Fault(StrEnum):
    """What can go wrong with a sensor, or with the hands that mount it."""

    ACCELEROMETER_STUCK = "accelerometer_stuck"
    GYRO_STUCK = "gyro_stuck"
    ACCELEROMETER_SATURATED = "accelerometer_saturated"
    GYRO_SATURATED = "gyro_saturated"
    IMU_UNPLUGGED = "imu_unplugged"
    GPS_UNPLUGGED = "gps_unplugged"
    GPS_NO_FIX = "gps_no_fix"
    GPS_FROZEN = "gps_frozen"
    AXES_SWAPPED = "axes_swapped"
    ACCELERATION_SIGN_FLIPPED = "acceleration_sign_flipped"
    PITCH_SIGN_FLIPPED = "pitch_sign_flipped"


_RATTLE: Final = 300.0  # a unit on a loose bracket shakes this much harder than the body
_ACCELERATION_RANGE_MPS2: Final = 50.0
_RATE_RANGE_RADPS: Final = 5.0


def with_fault(recording: Recording, fault: Fault, from_ns: int) -> Recording:
    """The recording as it would have been had the fault begun at from_ns (of the stamps)."""
    return _FAULTS[fault](recording, recording.imu_t_ns >= from_ns, recording.gps_t_ns >= from_ns)


def _accelerometer_stuck(recording: Recording, imu: Bool, gps: Bool) -> Recording:
    return replace(recording, accel_mps2=_held(recording.accel_mps2, imu))


def _gyro_stuck(recording: Recording, imu: Bool, gps: Bool) -> Recording:
    return replace(recording, gyro_radps=_held(recording.gyro_radps, imu))


def _accelerometer_saturated(recording: Recording, imu: Bool, gps: Bool) -> Recording:
    return replace(recording, accel_mps2=_rattling(recording.accel_mps2, imu, _ACCELERATION_RANGE_MPS2))


def _gyro_saturated(recording: Recording, imu: Bool, gps: Bool) -> Recording:
    return replace(recording, gyro_radps=_rattling(recording.gyro_radps, imu, _RATE_RANGE_RADPS))


def _imu_unplugged(recording: Recording, imu: Bool, gps: Bool) -> Recording:
    return replace(
        recording,
        imu_t_ns=recording.imu_t_ns[~imu],
        accel_mps2=recording.accel_mps2[~imu],
        gyro_radps=recording.gyro_radps[~imu],
    )


def _gps_unplugged(recording: Recording, imu: Bool, gps: Bool) -> Recording:
    return replace(
        recording,
        gps_t_ns=recording.gps_t_ns[~gps],
        gps_speed_mps=recording.gps_speed_mps[~gps],
        gps_fix=recording.gps_fix[~gps],
    )


def _gps_no_fix(recording: Recording, imu: Bool, gps: Bool) -> Recording:
    speed = np.where(gps, 0.0, recording.gps_speed_mps)
    return replace(recording, gps_speed_mps=speed, gps_fix=recording.gps_fix & ~gps)


def _gps_frozen(recording: Recording, imu: Bool, gps: Bool) -> Recording:
    return replace(recording, gps_speed_mps=_held(recording.gps_speed_mps, gps))


def _axes_swapped(recording: Recording, imu: Bool, gps: Bool) -> Recording:
    """The unit stands on its edge: x and z are exchanged."""
    accel, gyro = recording.accel_mps2.copy(), recording.gyro_radps.copy()
    accel[imu], gyro[imu] = accel[imu][:, ::-1], gyro[imu][:, ::-1]
    return replace(recording, accel_mps2=accel, gyro_radps=gyro)


def _acceleration_sign_flipped(recording: Recording, imu: Bool, gps: Bool) -> Recording:
    accel = recording.accel_mps2.copy()
    accel[imu, 2] *= -1.0
    return replace(recording, accel_mps2=accel)


def _pitch_sign_flipped(recording: Recording, imu: Bool, gps: Bool) -> Recording:
    gyro = recording.gyro_radps.copy()
    gyro[imu, 1] *= -1.0
    return replace(recording, gyro_radps=gyro)


def _rattling(samples: F64, is_faulty: Bool, limit: float) -> F64:
    """Motion about its mean enlarged until it runs into the ends of the range."""
    middle = samples.mean(axis=0)
    shaken = np.clip(middle + _RATTLE * (samples - middle), -limit, limit)
    return np.where(is_faulty[:, None], shaken, samples)


def _held(samples: F64, is_faulty: Bool) -> F64:
    """The last sound sample again and again (the first one if none was sound)."""
    held = samples.copy()
    if is_faulty.any():
        first = int(np.argmax(is_faulty))
        held[is_faulty] = samples[max(first - 1, 0)]
    return held


_FAULTS: Final[Mapping[Fault, Callable[[Recording, Bool, Bool], Recording]]] = MappingProxyType(
    {
        Fault.ACCELEROMETER_STUCK: _accelerometer_stuck,
        Fault.GYRO_STUCK: _gyro_stuck,
        Fault.ACCELEROMETER_SATURATED: _accelerometer_saturated,
        Fault.GYRO_SATURATED: _gyro_saturated,
        Fault.IMU_UNPLUGGED: _imu_unplugged,
        Fault.GPS_UNPLUGGED: _gps_unplugged,
        Fault.GPS_NO_FIX: _gps_no_fix,
        Fault.GPS_FROZEN: _gps_frozen,
        Fault.AXES_SWAPPED: _axes_swapped,
        Fault.ACCELERATION_SIGN_FLIPPED: _acceleration_sign_flipped,
        Fault.PITCH_SIGN_FLIPPED: _pitch_sign_flipped,
    }
)
