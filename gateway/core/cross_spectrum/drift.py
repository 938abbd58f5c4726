"""What of a vehicle is not as it was when it was calibrated: from day to day, and from load to load.

The search for a load leaves a few of these free, near the calibration. The others, and what of these lies
further off than the search believes, cannot be told from the load in one batch: they widen the interval.
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final

import numpy as np
from scipy.special import gammaincinv

from gateway.core.cross_spectrum.model.parameters import INDEX, PARAMETERS
from gateway.records import F64

HELD_STD: Final = 1e-3  # of a parameter that the search holds fixed
NOISE_STD: Final = 1.0
"""Of the logarithm of each sensor's own noise, where it is free: known loads are driven on roads too alike to tell it
from slack, and on a smoother road the one stays while the other falls with the road (benchmarks/accuracy/trials.md).
Chosen.
"""

DRIFT_STD: Final[Mapping[str, float]] = MappingProxyType(
    {
        "damper_front_nspm": 0.01,
        "damper_rear_nspm": 0.01,
        "delay_scale": 0.003,
        "payload_mode_hz": 0.3,
        "payload_damping_ratio": 0.5,  # chosen: a peak on soft mounts cannot be fitted with a firm floor's damping
        "gyro_lag_s": 0.001,
        "noise_acceleration_m2ps3": HELD_STD,
        "noise_pitch_rate_rad2ps": HELD_STD,
    }
)
"""What the search leaves free, and how far off, each by itself: standard deviations, of logarithms of what is positive.

Narrower than nature, for the minutes of a batch repeat one error of the model: less evidence than they seem. The
sensors' noise is held here; where it is free, NOISE_STD stands in its place.
"""

NATURE_STD: Final[Mapping[str, float]] = MappingProxyType(
    {
        "spring_front_npm": 0.005,  # bushings that age
        "spring_rear_npm": 0.005,
        "tyre_front_npm": 0.015,  # both tyres of an axle, pumped up by a gauge that is read to 2 %
        "tyre_rear_npm": 0.015,
        "damper_front_nspm": 0.03,  # wear
        "damper_rear_nspm": 0.03,
        "payload_mode_hz": 0.6,  # on the floor, on pallets, in a rack
    }
)
"""How far vehicle and packing really lie from their calibration, each axle by itself; chosen."""

NATURE_TOGETHER_STD: Final[Mapping[str, float]] = MappingProxyType(
    {
        "spring": 0.01,  # rubber in parallel with steel, over 10 K
        "tyre": 0.03,  # goes with its pressure, and that with the absolute temperature: 10 K are 3.4 %
        "damper": 0.05,  # the oil's viscosity, as far as valves let it through
    }
)
"""What both axles have in common beside it: one day's temperature."""

DAMPERS_TOGETHER_STD: Final = 0.03
"""What both axles' dampers have in common beside it: their oil is as warm or cold in front as at the rear."""

WORN_STD: Final = 0.3
"""Of the logarithm of each axle's dampers where they may have worn, or been replaced; chosen."""

DRIFTING: Final = [INDEX[name] for name in DRIFT_STD]
STEADY: Final = [i for i in range(len(PARAMETERS)) if i not in DRIFTING]


def _covariance(by_itself: Mapping[str, float], together: Mapping[str, float], names: Sequence[str]) -> F64:
    """(k, k) of ``names``, from standard deviations of each by itself and of what both axles have in common."""
    covariance = np.diag([by_itself.get(name, 0.0) ** 2 for name in names])
    for kind, std in together.items():
        is_of_kind = np.array([name.startswith(f"{kind}_") and name in by_itself for name in names], dtype=float)
        covariance += std**2 * np.outer(is_of_kind, is_of_kind)
    return covariance


_BELIEVED: Final = _covariance(DRIFT_STD, {"damper": DAMPERS_TOGETHER_STD}, list(DRIFT_STD))
_OF_NOISE: Final = np.array([name.startswith("noise_") for name in DRIFT_STD])
_NATURE_OF_DRIFTING: Final = _covariance({**DRIFT_STD, **NATURE_STD}, NATURE_TOGETHER_STD, list(DRIFT_STD))
NATURE_OF_STEADY: Final = _covariance(NATURE_STD, NATURE_TOGETHER_STD, [PARAMETERS[i] for i in STEADY])
_PRECISION: Final = np.asarray(np.linalg.inv(_BELIEVED), float)


def drift_precision(*, is_noise_free: bool = False) -> F64:
    """(k, k) of the DRIFTING parameters: the inverse of what the search believes."""
    return np.where(np.diag(_OF_NOISE), NOISE_STD**-2, _PRECISION) if is_noise_free else _PRECISION


_DAMPERS: Final = [i for i, name in enumerate(DRIFT_STD) if name.startswith("damper_")]
_DAMPERS_BELIEVED: Final = np.linalg.inv(_BELIEVED[np.ix_(_DAMPERS, _DAMPERS)])


def with_worn_dampers(precision: F64) -> F64:
    """(k, k) what is believed of drifting parameters where dampers may have worn, ``precision`` where they have not."""
    covariance = np.linalg.inv(precision)
    covariance[np.ix_(_DAMPERS, _DAMPERS)] = np.eye(len(_DAMPERS)) * WORN_STD**2
    return np.asarray(np.linalg.inv(covariance), float)


def dampers_of(drifting: F64) -> F64:
    """(2,) front and rear dampers among the drifting parameters (k,)."""
    return drifting[_DAMPERS]


def strain_of(off: F64) -> float:
    """Chi-squared of two: by how much the search's belief is strained by dampers among what lies ``off`` (k,)."""
    dampers = dampers_of(off)
    return float(dampers @ _DAMPERS_BELIEVED @ dampers)


_OF_THE_VEHICLE: Final = np.array([not name.startswith(("gyro_lag", "noise")) for name in DRIFT_STD], dtype=float)
_NATURAL_PRECISION: Final = np.asarray(np.linalg.inv(_NATURE_OF_DRIFTING), float)
_WORN_PRECISION: Final = with_worn_dampers(_NATURAL_PRECISION)
MOST_TENSION: Final = float(2.0 * gammaincinv(int(_OF_THE_VEHICLE.sum()) / 2.0, 1.0 - 1e-4))  # chi-squared quantile
"""A vehicle that drifts as vehicles do exceeds this once in ten thousand batches."""


def tension_of(off: F64, *, is_worn: bool = False) -> float:
    """How far the drifting parameters lie ``off`` (k,) their calibration: those of the vehicle, squared, chi-squared.

    A load unlike any that calibration saw, or a vehicle that is no longer the same, is fitted at the price of
    parameters that no drift explains. The measure is what is natural (NATURE_STD), not what the search believes:
    dampers that another day changed by 5 % are no reason to refuse. The search holds them near the calibration, so that
    they lie nearer by right. ``is_worn``: of dampers that may have worn.
    """
    off = off * _OF_THE_VEHICLE
    return float(off @ (_WORN_PRECISION if is_worn else _NATURAL_PRECISION) @ off)


def _factor(covariance: F64) -> F64:
    """(k, r) whose columns are independent causes of unit variance, of a positive semi-definite (k, k)."""
    values, vectors = np.linalg.eigh(covariance)
    kept = values > 1e-12 * values.max()
    factor: F64 = vectors[:, kept] * np.sqrt(values[kept])
    return factor


_IS_PACKING: Final = np.array([name.startswith("payload_") for name in DRIFT_STD])
_BEYOND_BELIEVED: Final = _NATURE_OF_DRIFTING - _BELIEVED
_DAY_OF_STEADY: Final = _factor(NATURE_OF_STEADY)
_DAY_OF_DRIFTING: Final = _factor(np.where(np.outer(~_IS_PACKING, ~_IS_PACKING), _BEYOND_BELIEVED, 0.0))
_PACKING_OF_DRIFTING: Final = _factor(np.where(np.outer(_IS_PACKING, _IS_PACKING), _BEYOND_BELIEVED, 0.0))


def day_columns(found: F64, moves: F64, precision: F64) -> F64:
    """(6, k) by how much one day's springs, tyres and dampers move the drifting parameters and the load.

    ``found`` (k, k) is the covariance of these in the search, ``precision`` that of its prior, ``moves`` (k, s) by how
    much they move with each of the STEADY parameters. A parameter that drifts further than the search believed pulls
    the answer by the share that the prior holds of it: found times precision (S. F. Schmidt's consider covariance, Adv.
    Control Syst. 3, 1966).
    """
    return np.concatenate([(moves @ _DAY_OF_STEADY).T, (_pulls(found, precision) @ _DAY_OF_DRIFTING).T])


def packing_columns(found: F64, precision: F64) -> F64:
    """(1, k) likewise of how firmly this load stands on its floor."""
    columns: F64 = (_pulls(found, precision) @ _PACKING_OF_DRIFTING).T
    return columns


def _pulls(found: F64, precision: F64) -> F64:
    pulls: F64 = found[:, : len(DRIFTING)] @ precision
    return pulls
