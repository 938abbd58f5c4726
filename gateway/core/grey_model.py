"""From a vector of parameters to the spectral matrix the two sensors should show.

Springs, dampers, masses and the like enter as logarithms, so that they stay positive and a prior's
standard deviation is a share; the rest enters as it is. The vector also holds the slack: the share
of each sensor's power, as a function of frequency, that does not come through the modelled path.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.core.cross_spectra import CrossSpectra
from gateway.core.halfcar import Axle, HalfCar, frequency_response
from gateway.records import C128, F64
from gateway.units import STANDARD_GRAVITY_MPS2

SLACK_KNOTS_HZ: Final = np.array([1.0, 1.5, 2.2, 3.3, 5.0, 7.0, 9.0, 11.0, 13.0, 15.0])
BEND_SHARES: Final = (0.0, 0.2, 0.4, 0.6, 0.9, 1.2)  # added axle load over half the empty weight where rates may bend
SLACK_FLOOR: Final = 0.01
ROAD_EXPONENT: Final = -2.0  # displacement density of a road falls about as frequency squared (ISO 8608)

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
    *(f"slack_acceleration_{hz:g}hz" for hz in SLACK_KNOTS_HZ),
    *(f"slack_pitch_rate_{hz:g}hz" for hz in SLACK_KNOTS_HZ),
)
_SIGNED: Final = (
    "sensor_position_m",
    "spring_slope_front_per_kn",
    "spring_slope_rear_per_kn",
    *(f"spring_bend_front_{i}_per_kn" for i in range(len(BEND_SHARES))),
    *(f"spring_bend_rear_{i}_per_kn" for i in range(len(BEND_SHARES))),
    "gyro_lag_s",
    "delay_scale",
    "rear_lag_s",
)
PARAMETERS: Final = _POSITIVE + _SIGNED
INDEX: Final = {name: i for i, name in enumerate(PARAMETERS)}


@dataclass(frozen=True, slots=True)
class Ground:
    """What is known of the vehicle without calibration."""

    empty_mass_kg: float
    empty_front_share: float
    wheelbase_m: float

    @property
    def half_weight_kn(self) -> float:
        """Half the weight of the empty sprung mass."""
        return 0.5 * self.empty_mass_kg * STANDARD_GRAVITY_MPS2 / 1000.0


@dataclass(frozen=True, slots=True)
class SpectralModel:
    """The matrix of outputs per unit road density, still open in the delay phase c of the rear axle.

    Each spectrum is ``still + c * moving + conj(c * moving_back)``; arrays (..., m), one row a
    parameter vector. Slack is already inside ``still``; the
    delay is longer by the share delay_scale (..., 1) and by rear_lag_s (..., 1).
    """

    freq_hz: F64
    still_acceleration: F64
    still_pitch_rate: F64
    still_cross: C128
    moving_acceleration: C128
    moving_pitch_rate: C128
    moving_cross: C128
    moving_cross_back: C128
    delay_scale: F64
    rear_lag_s: F64


def is_positive(name: str) -> bool:
    """True where the vector holds the logarithm of this parameter."""
    return name in _POSITIVE


def in_units(theta: F64, name: str) -> float:
    """One parameter of a vector (p,) in the unit its name ends in."""
    entry = float(theta[INDEX[name]])
    return float(np.exp(entry)) if is_positive(name) else entry


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


def spectral_model(theta: F64, payload_kg: F64, front_share: F64, ground: Ground, freq_hz: F64) -> SpectralModel:
    """Spectra for parameter vectors theta (..., p) and loads (...,) at freq_hz (m,).

    S = |front|^2 + |rear|^2 + c rear conj(front) + its conjugate, per element of the 2x2 matrix.
    """
    car = half_car(theta, ground)
    r = frequency_response(car, np.asarray(payload_kg)[..., None], np.asarray(front_share)[..., None], freq_hz)
    auto_a = np.abs(r.acceleration_front) ** 2 + np.abs(r.acceleration_rear) ** 2
    auto_g = np.abs(r.pitch_rate_front) ** 2 + np.abs(r.pitch_rate_rear) ** 2
    return SpectralModel(
        freq_hz=freq_hz,
        still_acceleration=auto_a * (1.0 + _slack(theta, "acceleration", freq_hz)),
        still_pitch_rate=auto_g * (1.0 + _slack(theta, "pitch_rate", freq_hz)),
        still_cross=r.pitch_rate_front * np.conj(r.acceleration_front)
        + r.pitch_rate_rear * np.conj(r.acceleration_rear),
        moving_acceleration=r.acceleration_rear * np.conj(r.acceleration_front),
        moving_pitch_rate=r.pitch_rate_rear * np.conj(r.pitch_rate_front),
        moving_cross=r.pitch_rate_rear * np.conj(r.acceleration_front),
        moving_cross_back=r.acceleration_rear * np.conj(r.pitch_rate_front),
        delay_scale=theta[..., INDEX["delay_scale"], None],
        rear_lag_s=theta[..., INDEX["rear_lag_s"], None],
    )


def expected_spectra(model: SpectralModel, spectra: CrossSpectra) -> tuple[F64, F64, C128]:
    """Acceleration, pitch rate and cross-spectrum (..., b, m) for the speeds of ``spectra``, up to the road's level.

    A Hann taper mixes neighbouring frequencies, weighing them 1:4:1; the road's slope is in.
    """
    later_s = spectra.delay_s * model.delay_scale[..., None, :] + model.rear_lag_s[..., None, :]
    phase = spectra.delay_phase * np.exp(-2j * np.pi * spectra.freq_hz * later_s)
    road = spectra.freq_hz**ROAD_EXPONENT

    def at(spectrum: F64 | C128) -> F64 | C128:
        return spectrum[..., None, :]

    auto_a = at(model.still_acceleration) + 2.0 * np.real(phase * at(model.moving_acceleration))
    auto_g = at(model.still_pitch_rate) + 2.0 * np.real(phase * at(model.moving_pitch_rate))
    cross = at(model.still_cross) + phase * at(model.moving_cross) + np.conj(phase * at(model.moving_cross_back))
    return np.real(_tapered(auto_a * road)), np.real(_tapered(auto_g * road)), _tapered(cross * road)


def _tapered(spectrum: C128 | F64) -> C128:
    mixed = (spectrum[..., :-2] + 4.0 * spectrum[..., 1:-1] + spectrum[..., 2:]) / 6.0
    return np.asarray(mixed, np.complex128)


def _slack(theta: F64, sensor: str, freq_hz: F64) -> F64:
    """Slack (..., m) of one sensor: log-linear between its knots, above a floor."""
    first = INDEX[f"slack_{sensor}_{SLACK_KNOTS_HZ[0]:g}hz"]
    knots = theta[..., first : first + len(SLACK_KNOTS_HZ)]
    log_knots_hz = np.log(SLACK_KNOTS_HZ)
    weights = np.stack([np.interp(np.log(freq_hz), log_knots_hz, unit) for unit in np.eye(len(SLACK_KNOTS_HZ))])
    slack: F64 = SLACK_FLOOR + np.exp(knots @ weights)
    return slack
