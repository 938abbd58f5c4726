"""The prior of any road vehicle's suspension before its first drive: weak log-normal priors.

Body bounce near 1.3 Hz, damping near 0.3 of critical, tyres about ten times stiffer than springs,
unsprung mass about 6 % of the sprung per axle, radius of gyration in pitch about 0.46 wheelbase
(T. D. Gillespie, Fundamentals of Vehicle Dynamics, ch. 5). docs/campaign.md compares the unsprung share with measured
cars.
"""

from dataclasses import dataclass
from math import log, pi
from typing import Final, Protocol

import numpy as np

from gateway.calibration.axle_weights import ESTIMATED_UNSPRUNG_STD, UNSPRUNG_SHARE, WEIGHED_STD
from gateway.calibration.inheritance import Usual
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.model.parameters import BEND_SHARES, INDEX, PARAMETERS, ROLL_PARAMETERS
from gateway.core.cross_spectrum.model.usual_roll import usual_roll
from gateway.core.late import linalg
from gateway.core.vehicle import Vehicle
from gateway.records import F64

BOUNCE_HZ: Final = 1.35  # Gillespie, ch. 5
DAMPING_RATIO: Final = 0.3  # Gillespie, ch. 5
TYRE_NPM: Final = 400e3  # chosen: both tyres of an axle; scales with mass
MOUNT_NPM: Final = 500e3  # chosen: both damper mounts of an axle; scales with mass
GYRATION_PER_WHEELBASE: Final = 0.46  # Gillespie, ch. 5
MOST_OFFSET_STD_M: Final = 0.1  # chosen: of the sensor's lateral place; a worse one is not used
REFERENCE_KG: Final = 1250.0  # chosen: the vehicle whose tyres, mounts and springs the figures here refer to
BEND_STD_PER_KN: Final = 0.1
"""Chosen: of each bend. The bend at no added load equals the slope except where a load relieves the axle; their priors
add up.
"""
NOISE_ACCELERATION_M2PS3: Final = 1e-5  # chosen: 300 ug per root hertz
NOISE_RATE_RAD2PS: Final = 1e-8  # chosen: 0.006 deg/s per root hertz; steps of 0.25 deg/s at 100 Hz make 3e-8
NOISE_STD: Final = 2.0  # chosen: of the noises' logarithms

Rows = dict[str, tuple[float, float]]
"""By parameter: mean and standard deviation; of the logarithm for a positive one (model.parameters.is_positive). The
standard deviations are chosen: wide enough for any road vehicle.
"""


@dataclass(frozen=True, slots=True)
class Prior:
    """A Gaussian over the parameter vector: mean (p,) and precision (p, p), the inverse of its covariance.

    Roll parameters are independent of heave and pitch parameters.
    """

    mean: F64
    precision: F64

    @classmethod
    def independent(cls, mean: F64, std: F64) -> "Prior":
        """Of independent parameters: mean and std (p,)."""
        return cls(mean, np.diag(std**-2.0))

    @property
    def covariance(self) -> F64:
        """(p, p)"""
        return np.asarray(np.linalg.inv(self.precision), float)

    @property
    def std(self) -> F64:
        """(p,) of each parameter by itself."""
        std: F64 = np.sqrt(np.diag(self.covariance))
        return std

    @property
    def upright(self) -> "Prior":
        """Of heave and pitch."""
        n = len(PARAMETERS)
        return Prior(self.mean[:n], self.precision[:n, :n])

    @property
    def roll(self) -> "Prior":
        """Of roll; empty if that is not estimated."""
        n = len(PARAMETERS)
        return Prior(self.mean[n:], self.precision[n:, n:])

    def beside(self, roll: "Prior") -> "Prior":
        """Of all parameters: this prior for heave and pitch, ``roll`` for roll."""
        return Prior(np.r_[self.mean, roll.mean], linalg.block_diag(self.precision, roll.precision))

    def start(self, log_springs: float, log_dampers: float) -> F64:
        """The centre, with springs and dampers moved by these logarithms."""
        theta = self.mean.copy()
        for end in ("front", "rear"):
            theta[INDEX[f"spring_{end}_npm"]] += log_springs
            theta[INDEX[f"damper_{end}_nspm"]] += log_dampers
        return theta


def can_roll(vehicle: Vehicle) -> bool:
    """Whether the vehicle's data suffice to use a roll rate: its track, and the sensor's position.

    An unknown lever arm cannot be estimated from the roll itself: suspension mounts and the body bring roll into the
    acceleration that no lever arm of the sensor explains (docs/method.md).
    """
    return vehicle.track_width_m is not None and vehicle.sensor_left_std_m <= MOST_OFFSET_STD_M


def prior_of(vehicle: Vehicle, *, with_roll: bool = False) -> Prior:
    """The prior of a vehicle from its mass, wheelbase, share and sensor position; with roll also from its track."""
    rows = _body(vehicle) | _axle("front", vehicle) | _axle("rear", vehicle)
    names = PARAMETERS
    if with_roll:
        names += ROLL_PARAMETERS
        rows |= _roll(vehicle)
    rows |= {name: (log(0.03), 1.0) for name in names if name.startswith("slack_")}  # chosen: share of unmodelled power
    mean, std = np.array([rows[name] for name in names]).T
    return Prior.independent(mean, std)


def _body(vehicle: Vehicle) -> Rows:
    inertia = vehicle.empty_mass_kg * (GYRATION_PER_WHEELBASE * vehicle.wheelbase_m) ** 2
    return {
        "pitch_inertia_kgm2": (log(inertia), 0.25),
        "sensor_position_m": (vehicle.sensor_position_m, vehicle.sensor_position_std_m),
        "payload_gyration_m2": (log(0.1), 0.7),  # chosen: a compact load
        "payload_mode_hz": (log(25.0), 0.6),  # chosen: above the estimators' band
        "payload_damping_ratio": (log(0.15), 0.5),  # chosen: packed goods
        "noise_acceleration_m2ps3": (log(NOISE_ACCELERATION_M2PS3), NOISE_STD),
        "noise_pitch_rate_rad2ps": (log(NOISE_RATE_RAD2PS), NOISE_STD),
        "track_offset_m": (log(0.03), 1.0),  # chosen: between the tracks of both axles
        "gyro_lag_s": (0.0, 0.01),  # chosen: one sample at 100 Hz
        "delay_scale": (0.0, 0.003),  # chosen: of the speed, by tyre wear and receiver
        "rear_lag_s": (0.0, 0.005),  # chosen: the rear axle's path to the body
    }


def _axle(end: str, vehicle: Vehicle) -> Rows:
    share = vehicle.empty_front_share
    sprung_kg = vehicle.empty_mass_kg * (share if end == "front" else 1.0 - share)
    spring_npm = sprung_kg * (2.0 * pi * BOUNCE_HZ) ** 2 * 1.15  # in series with the tyre
    damper_nspm = 2.0 * DAMPING_RATIO * (spring_npm * sprung_kg) ** 0.5
    given_kg = vehicle.unsprung_front_kg if end == "front" else vehicle.unsprung_rear_kg
    unsprung_kg = given_kg or UNSPRUNG_SHARE * vehicle.empty_mass_kg
    scale = vehicle.empty_mass_kg / REFERENCE_KG
    return {
        f"spring_{end}_npm": (log(spring_npm), 0.35),
        f"damper_{end}_nspm": (log(damper_nspm), 0.5),
        f"damper_mount_{end}_npm": (log(MOUNT_NPM * scale), 1.0),
        f"tyre_{end}_npm": (log(TYRE_NPM * scale), 0.3),
        f"unsprung_{end}_kg": (log(unsprung_kg), WEIGHED_STD if given_kg else ESTIMATED_UNSPRUNG_STD),
        f"damper_friction_{end}": (0.1, 0.3),  # chosen: share of the rate at the usual amplitude
        f"spring_friction_{end}": (0.03, 0.05),  # chosen: likewise
        f"spring_slope_{end}_per_kn": (0.03 / scale, 0.05 / scale),  # chosen: of the spring rate's logarithm
        **{f"spring_bend_{end}_{i}_per_kn": (0.0, BEND_STD_PER_KN / scale) for i in range(len(BEND_SHARES))},
    }


def _roll(vehicle: Vehicle) -> Rows:
    if vehicle.track_width_m is None:
        raise ValueError("a vehicle that rolls needs the width of its track")
    usual = usual_roll(vehicle.empty_mass_kg, vehicle.track_width_m)
    stds = {
        "roll_inertia_kgm2": 0.3,
        "payload_roll_gyration_m2": 0.7,
        "anti_roll_front_npm": 1.0,
        "anti_roll_rear_npm": 1.0,
        "damper_against_front": 0.3,
        "damper_against_rear": 0.3,
        "tracks_apart_m": 0.5,
        "twist_level": 0.5,
        "gyro_yaw_rad": 0.05,  # 3 degrees
    }
    return {name: (mean, stds[name]) for name, mean in usual.items()} | {
        "noise_roll_rate_rad2ps": (log(NOISE_RATE_RAD2PS), NOISE_STD),
        "sensor_left_m": (vehicle.sensor_left_m, vehicle.sensor_left_std_m),
        "empty_left_m": (vehicle.empty_cg_left_m, 0.02),  # chosen: driver, tank, sliding door
    }


class Inherited(Protocol):
    """The prior from a vehicle of the same model before a fit starts (calibration.sister)."""

    @property
    def usual(self) -> Usual:
        """Its usual movement."""

    def prior_of(self, vehicle: Vehicle, *, with_roll: bool) -> Prior:
        """Of a vehicle of its model that has not been driven yet."""

    def on(self, calibration: CrossSpectrumCalibration, *, is_tested: bool) -> CrossSpectrumCalibration:
        """``calibration`` of a vehicle of its model, valid in its ranges too, with its limits.

        If left-out runs of its own have tested it (``is_tested``), its limits are the wider of both.
        """
