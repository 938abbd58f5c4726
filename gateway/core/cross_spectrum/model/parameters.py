"""The parameters of a vehicle as a vector, and the half-car, or the car with roll, that they describe.

Springs, dampers, masses and other positive quantities enter as logarithms, so that they stay positive and a prior's
standard deviation is a share; the rest enters as it is. The vector also holds the slack (the share of each sensor's
power, by frequency, that does not come through the modelled path), the sensors' own noise as spectral densities, and
the share of friction in each spring's and damper's rate (core.cross_spectrum.model.friction).
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.core.cross_spectrum.model.half_car import Axle, HalfCar
from gateway.core.cross_spectrum.model.reading import Mount
from gateway.core.cross_spectrum.model.rolling_car import Against, RollingCar
from gateway.core.memoized import memoized
from gateway.core.vehicle import Vehicle
from gateway.records import F64
from gateway.units import STANDARD_GRAVITY_MPS2

SLACK_KNOTS_HZ: Final = np.array([1.0, 1.5, 2.2, 3.3, 5.0, 7.0, 9.0, 11.0, 13.0, 15.0])
BEND_SHARES: Final = (0.0, 0.2, 0.4, 0.6, 0.9, 1.2)
"""Chosen: the added axle load over half the empty weight at which rates may bend."""

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
"""The parameters of every calibration."""

_SLACK_ROLL_RATE: Final = tuple(f"slack_roll_rate_{hz:g}hz" for hz in SLACK_KNOTS_HZ)
_ROLL_POSITIVE: Final = (
    "roll_inertia_kgm2",
    "payload_roll_gyration_m2",
    "anti_roll_front_npm",
    "anti_roll_rear_npm",
    "damper_against_front",
    "damper_against_rear",
    *_SLACK_ROLL_RATE,
    "noise_roll_rate_rad2ps",
    "tracks_apart_m",
    "twist_level",
)
_ROLL_SIGNED: Final = ("sensor_left_m", "gyro_yaw_rad", "empty_left_m")
ROLL_PARAMETERS: Final = _ROLL_POSITIVE + _ROLL_SIGNED
"""The further entries of the vector if the vehicle was calibrated with a roll rate."""

INDEX: Final = {name: i for i, name in enumerate(PARAMETERS + ROLL_PARAMETERS)}
SLACK_KNOTS: Final = tuple(
    range(INDEX[names[0]], INDEX[names[-1]] + 1) for names in (_SLACK_ACCELERATION, _SLACK_PITCH_RATE, _SLACK_ROLL_RATE)
)
"""For each sensor: the entries of its slack's knots in the vector."""
NOISES: Final = ("noise_acceleration_m2ps3", "noise_pitch_rate_rad2ps", "noise_roll_rate_rad2ps")
"""For each sensor: the parameter of its own noise."""
_OF_ROAD_AND_SENSORS: Final = ("slack_", "noise_", "track", "twist_", "delay_scale", "rear_lag_s")
VEHICLE_PARAMETERS: Final = frozenset(i for name, i in INDEX.items() if not name.startswith(_OF_ROAD_AND_SENSORS))


LEAST_SLACK: Final = 0.01
"""Chosen: least share of each sensor's power that comes by no modelled path, such as roll and loose parts."""

LEAST_SLACK_ON_CENTRE_LINE: Final = 0.002
"""The same with roll removed: the coherence of known loads is higher than LEAST_SLACK allows
(benchmarks/accuracy/trials.md).
"""


@dataclass(frozen=True, slots=True)
class Ground:
    """The vehicle as known without calibration, and least_slack, the least share of unmodelled power."""

    empty_mass_kg: float
    empty_front_share: float
    wheelbase_m: float
    track_width_m: float | None = None
    least_slack: float = LEAST_SLACK

    @classmethod
    def of(cls, vehicle: Vehicle, *, with_roll: bool = False) -> "Ground":
        """A vehicle as its fitter states it; ``with_roll`` if its sensors are read as on the centre line."""
        return cls(
            vehicle.empty_mass_kg,
            vehicle.empty_front_share,
            vehicle.wheelbase_m,
            vehicle.track_width_m,
            LEAST_SLACK_ON_CENTRE_LINE if with_roll else LEAST_SLACK,
        )

    @property
    def half_track_m(self) -> float:
        """Half the track's width. Raises ValueError if nobody stated it."""
        if self.track_width_m is None:
            raise ValueError("a vehicle that rolls needs the width of its track")
        return 0.5 * self.track_width_m

    @property
    def half_weight_kn(self) -> float:
        """Half the weight of the empty sprung mass."""
        return 0.5 * self.empty_mass_kg * STANDARD_GRAVITY_MPS2 / 1000.0


_BENDS: Final = {
    end: [INDEX[f"spring_bend_{end}_{i}_per_kn"] for i in range(len(BEND_SHARES))] for end in ("front", "rear")
}


def is_positive(name: str) -> bool:
    """True where the vector holds the logarithm of this parameter."""
    return name in _POSITIVE or name in _ROLL_POSITIVE


def has_roll(theta: F64) -> bool:
    """True if the vector theta (..., p) has roll parameters."""
    return bool(theta.shape[-1] > len(PARAMETERS))


def names_of(theta: F64) -> tuple[str, ...]:
    """The names of the entries of theta (..., p)."""
    return PARAMETERS + ROLL_PARAMETERS if has_roll(theta) else PARAMETERS


def mount_of(theta: F64) -> Mount | None:
    """The sensor's mount by theta (n,); None without roll parameters."""
    if not has_roll(theta):
        return None
    return Mount(*(float(theta[INDEX[name]]) for name in ("sensor_left_m", "gyro_yaw_rad", "gyro_lag_s")))


def level(theta: F64) -> F64:
    """theta (n,) of the same vehicle with roll, its sensor on the centre line and square to it."""
    placed = theta.copy()
    placed[[INDEX["sensor_left_m"], INDEX["gyro_yaw_rad"]]] = 0.0
    return placed


def upright(theta: F64) -> F64:
    """The part of theta (..., n) for heave and pitch."""
    return theta[..., : len(PARAMETERS)]


def value_of(theta: F64, name: str) -> F64:
    """(..., 1) one parameter of theta (..., p), in the unit that ends its name."""
    column: F64 = theta[..., INDEX[name], None]
    return np.exp(column) if is_positive(name) else column


_LOGARITHMS: Final = np.array([is_positive(name) for name in INDEX])


def _natural(theta: F64) -> F64:
    """(..., p) all parameters in the units that end their names."""
    return np.exp(theta, out=theta.copy(), where=_LOGARITHMS[: theta.shape[-1]])


def half_car(theta: F64, ground: Ground) -> HalfCar:
    """The vehicles of the parameter vectors theta (..., p), broadcasting against frequency."""
    return _half_car(theta, _natural(theta), ground)


def _half_car(theta: F64, natural: F64, ground: Ground) -> HalfCar:
    def of(name: str) -> F64:
        return natural[..., INDEX[name], None]

    def axle(end: str) -> Axle:
        return Axle(
            spring_npm=of(f"spring_{end}_npm"),
            spring_slope_per_kn=of(f"spring_slope_{end}_per_kn"),
            spring_bends_per_kn=theta[..., _BENDS[end]],
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


def rolling_car(theta: F64, ground: Ground) -> RollingCar:
    """The same with roll. Raises ValueError if the track's width is unknown."""

    natural = _natural(theta)

    def of(name: str) -> F64:
        return natural[..., INDEX[name], None]

    def against(end: str) -> Against:
        return Against(anti_roll_npm=of(f"anti_roll_{end}_npm"), damper=of(f"damper_against_{end}"))

    return RollingCar(
        half_car=_half_car(theta, natural, ground),
        half_track_m=ground.half_track_m,
        roll_inertia_kgm2=of("roll_inertia_kgm2"),
        payload_roll_gyration_m2=of("payload_roll_gyration_m2"),
        front=against("front"),
        rear=against("rear"),
        sensor_left_m=of("sensor_left_m"),
        gyro_yaw_rad=of("gyro_yaw_rad"),
        empty_left_m=of("empty_left_m"),
    )


@memoized
def slack_weights(freq_hz: F64) -> F64:
    """(knots, m): the weight of each knot of the logarithm of slack at freq_hz (m,)."""
    knots = np.arange(len(SLACK_KNOTS_HZ))
    between = np.interp(np.log(freq_hz), np.log(SLACK_KNOTS_HZ), knots)
    weights: F64 = np.maximum(0.0, 1.0 - np.abs(between - knots[:, None]))
    return weights
