"""The parameters of a vehicle as a vector, and the half-car they stand for.

Springs, dampers, masses and the like enter as logarithms, so that they stay positive and a prior's
standard deviation is a share; the rest enters as it is. The vector also holds the slack: the share
of each sensor's power, as a function of frequency, that does not come through the modelled path; the
sensors' own noise as spectral densities; and which share of each spring's and damper's rate is friction
(core.cross_spectrum.model.friction).
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.core.cross_spectrum.model.half_car import Axle, HalfCar
from gateway.core.vehicle import Vehicle
from gateway.records import F64
from gateway.units import STANDARD_GRAVITY_MPS2

SLACK_KNOTS_HZ: Final = np.array([1.0, 1.5, 2.2, 3.3, 5.0, 7.0, 9.0, 11.0, 13.0, 15.0])
BEND_SHARES: Final = (0.0, 0.2, 0.4, 0.6, 0.9, 1.2)  # added axle load over half the empty weight where rates may bend

_SLACK_ACCELERATION: Final = tuple(f"slack_acceleration_{hz:g}hz" for hz in SLACK_KNOTS_HZ)
_SLACK_PITCH_RATE: Final = tuple(f"slack_pitch_rate_{hz:g}hz" for hz in SLACK_KNOTS_HZ)
_POSITIVE: Final = (
    "spring_front_npm",
    "spring_rear_npm",
    "damper_front_nspm",
    "damper_rear_nspm",
    "damper_mount_front_npm",
    "damper_mount_rear_npm",
    "tyre_front_npm",
    "tyre_rear_npm",
    "unsprung_front_kg",
    "unsprung_rear_kg",
    "pitch_inertia_kgm2",
    "payload_gyration_m2",
    "payload_mode_hz",
    "payload_damping_ratio",
    *_SLACK_ACCELERATION,
    *_SLACK_PITCH_RATE,
    "noise_acceleration_m2ps3",
    "noise_pitch_rate_rad2ps",
    "track_offset_m",
)
_SIGNED: Final = (
    "sensor_position_m",
    "spring_slope_front_per_kn",
    "spring_slope_rear_per_kn",
    *(f"spring_bend_front_{i}_per_kn" for i in range(len(BEND_SHARES))),
    *(f"spring_bend_rear_{i}_per_kn" for i in range(len(BEND_SHARES))),
    "damper_friction_front",
    "damper_friction_rear",
    "spring_friction_front",
    "spring_friction_rear",
    "gyro_lag_s",
    "delay_scale",
    "rear_lag_s",
)
PARAMETERS: Final = _POSITIVE + _SIGNED
INDEX: Final = {name: i for i, name in enumerate(PARAMETERS)}
SLACK_ACCELERATION: Final = range(INDEX[_SLACK_ACCELERATION[0]], INDEX[_SLACK_ACCELERATION[-1]] + 1)  # one a knot
SLACK_PITCH_RATE: Final = range(INDEX[_SLACK_PITCH_RATE[0]], INDEX[_SLACK_PITCH_RATE[-1]] + 1)
_NOT_OF_THE_HALF_CAR: Final = ("slack_", "noise_", "track_offset_m", "delay_scale", "rear_lag_s")
HALF_CAR_PARAMETERS: Final = frozenset(i for name, i in INDEX.items() if not name.startswith(_NOT_OF_THE_HALF_CAR))


@dataclass(frozen=True, slots=True)
class Ground:
    """What is known of the vehicle without calibration."""

    empty_mass_kg: float
    empty_front_share: float
    wheelbase_m: float

    @classmethod
    def of(cls, vehicle: Vehicle) -> "Ground":
        """Of a vehicle as its fitter states it."""
        return cls(vehicle.empty_mass_kg, vehicle.empty_front_share, vehicle.wheelbase_m)

    @property
    def half_weight_kn(self) -> float:
        """Half the weight of the empty sprung mass."""
        return 0.5 * self.empty_mass_kg * STANDARD_GRAVITY_MPS2 / 1000.0


def is_positive(name: str) -> bool:
    """True where the vector holds the logarithm of this parameter."""
    return name in _POSITIVE


def half_car(theta: F64, ground: Ground) -> HalfCar:
    """The vehicles of the parameter vectors theta (..., p), broadcasting against frequency."""

    def of(name: str) -> F64:
        column: F64 = theta[..., INDEX[name], None]
        return np.exp(column) if is_positive(name) else column

    def axle(end: str) -> Axle:
        return Axle(
            spring_npm=of(f"spring_{end}_npm"),
            spring_slope_per_kn=of(f"spring_slope_{end}_per_kn"),
            spring_bends_per_kn=tuple(of(f"spring_bend_{end}_{i}_per_kn") for i in range(len(BEND_SHARES))),
            bend_loads_kn=tuple(share * ground.half_weight_kn for share in BEND_SHARES),
            damper_nspm=of(f"damper_{end}_nspm"),
            damper_mount_npm=of(f"damper_mount_{end}_npm"),
            tyre_npm=of(f"tyre_{end}_npm"),
            unsprung_kg=of(f"unsprung_{end}_kg"),
        )

    return HalfCar(
        empty_mass_kg=ground.empty_mass_kg,
        empty_front_share=ground.empty_front_share,
        wheelbase_m=ground.wheelbase_m,
        front=axle("front"),
        rear=axle("rear"),
        pitch_inertia_kgm2=of("pitch_inertia_kgm2"),
        sensor_position_m=of("sensor_position_m"),
        payload_gyration_m2=of("payload_gyration_m2"),
        payload_mode_hz=of("payload_mode_hz"),
        payload_damping_ratio=of("payload_damping_ratio"),
        gyro_lag_s=of("gyro_lag_s"),
    )


def slack_weights(freq_hz: F64) -> F64:
    """(knots, m): how much each knot of the logarithm of slack counts at freq_hz (m,)."""
    knots = np.arange(len(SLACK_KNOTS_HZ))
    between = np.interp(np.log(freq_hz), np.log(SLACK_KNOTS_HZ), knots)
    weights: F64 = np.maximum(0.0, 1.0 - np.abs(between - knots[:, None]))
    return weights
