"""Differences of a vehicle from its calibration, from day to day and from load to load.

The search for a load leaves a few parameters free, near the calibration. One batch cannot distinguish the others, or
larger changes of the free ones, from a change of load: they widen the interval.
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final

import numpy as np

from gateway.core.cross_spectrum.model.parameters import INDEX, PARAMETERS
from gateway.records import F64

HELD_STD: Final = 1e-3  # chosen: of a parameter that the search holds fixed
NOISE_STD: Final = 1.0
"""Chosen: of the logarithm of each sensor's own noise, where it is free. The roads of known loads are too similar to
separate noise from slack; on a smoother road slack falls with the road and noise does not
(benchmarks/accuracy/trials.md).
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
"""Chosen: the free parameters of the search and the standard deviation of each (of the logarithm if it is positive).

Narrower than real drift, because the minutes of a batch repeat one error of the model and so count for less. The
sensors' noise is fixed here; where it is free, NOISE_STD replaces the value.
"""

NATURE_STD: Final[Mapping[str, float]] = MappingProxyType(
    {
        "spring_front_npm": 0.005,  # bushings that age
        "spring_rear_npm": 0.005,
        "tyre_front_npm": 0.015,  # both tyres of an axle, pumped up by a gauge that is read to 2 %
        "tyre_rear_npm": 0.015,
        "damper_front_nspm": 0.03,  # wear
        "damper_rear_nspm": 0.03,
        "damper_friction_front": 0.02,  # seals and bushings: a fifth of a usual share of 0.1
        "damper_friction_rear": 0.02,
        "payload_mode_hz": 0.6,  # on the floor, on pallets, in a rack
    }
)
"""Chosen: real deviations of vehicle and packing from their calibration, for each axle separately."""

NATURE_TOGETHER_STD: Final[Mapping[str, float]] = MappingProxyType(
    {
        "spring": 0.01,  # rubber in parallel with steel, over 10 K
        "tyre": 0.03,  # goes with its pressure, and that with the absolute temperature: 10 K are 3.4 %
        "damper": 0.05,  # the oil's viscosity, as far as valves let it through
        "damper_friction": 0.02,  # stiffer rubber when it is cold
    }
)
"""Chosen: the deviation common to both axles, in addition: the temperature of the day."""

DAMPERS_TOGETHER_STD: Final = 0.03
"""Chosen: the deviation common to both axles' dampers, in addition: their oil has the same temperature."""

WORN_STD: Final = 0.3
"""Chosen: of the logarithm of each axle's dampers, if they may have worn or been replaced."""

DRIFTING: Final = [INDEX[name] for name in DRIFT_STD]
STEADY: Final = [i for i in range(len(PARAMETERS)) if i not in DRIFTING]


def kind_of(name: str) -> str:
    """What a parameter of an axle is, whichever the axle: spring, tyre, damper, damper_friction."""
    return name.partition("_front")[0].partition("_rear")[0]


def _covariance(by_itself: Mapping[str, float], together: Mapping[str, float], names: Sequence[str]) -> F64:
    """(k, k) covariance of ``names``, from the standard deviation of each and the part common to both axles."""
    covariance = np.diag([by_itself.get(name, 0.0) ** 2 for name in names])
    for kind, std in together.items():
        is_of_kind = np.array([kind_of(name) == kind and name in by_itself for name in names], dtype=float)
        covariance += std**2 * np.outer(is_of_kind, is_of_kind)
    return covariance


_BELIEVED: Final = _covariance(DRIFT_STD, {"damper": DAMPERS_TOGETHER_STD}, list(DRIFT_STD))
_OF_NOISE: Final = np.array([name.startswith("noise_") for name in DRIFT_STD])
_NATURE_OF_DRIFTING: Final = _covariance({**DRIFT_STD, **NATURE_STD}, NATURE_TOGETHER_STD, list(DRIFT_STD))
NATURE_OF_STEADY: Final = _covariance(NATURE_STD, NATURE_TOGETHER_STD, [PARAMETERS[i] for i in STEADY])
_PRECISION: Final = np.asarray(np.linalg.inv(_BELIEVED), float)


def drift_precision(*, is_noise_free: bool = False) -> F64:
    """(k, k) prior precision of the DRIFTING parameters in the search."""
    return np.where(np.diag(_OF_NOISE), NOISE_STD**-2, _PRECISION) if is_noise_free else _PRECISION


_DAMPERS: Final = [i for i, name in enumerate(DRIFT_STD) if name.startswith("damper_")]
_DAMPERS_BELIEVED: Final = np.linalg.inv(_BELIEVED[np.ix_(_DAMPERS, _DAMPERS)])


def with_worn_dampers(precision: F64) -> F64:
    """(k, k) precision of the drifting parameters if dampers may have worn; ``precision`` is that of healthy
    dampers.
    """
    covariance = np.linalg.inv(precision)
    covariance[np.ix_(_DAMPERS, _DAMPERS)] = np.eye(len(_DAMPERS)) * WORN_STD**2
    return np.asarray(np.linalg.inv(covariance), float)


def dampers_of(drifting: F64) -> F64:
    """(2,) front and rear dampers among the drifting parameters (k,)."""
    return drifting[_DAMPERS]


def strain_of(off: F64) -> float:
    """Chi-squared (2 degrees of freedom) of the dampers in the deviations ``off`` (k,) under the search's prior."""
    dampers = dampers_of(off)
    return float(dampers @ _DAMPERS_BELIEVED @ dampers)


def wear_of(freed: F64) -> float:
    """How far the dampers of both axles lie off their calibration (2,), beyond what is natural, in natural standard
    deviations of one: the root of their mean square less one, or 0.
    """
    return float(np.sqrt(max(float(np.mean(freed**2)) / _DAMPER_STD**2 - 1.0, 0.0)))


_OF_THE_VEHICLE: Final = np.array([not name.startswith(("gyro_lag", "noise")) for name in DRIFT_STD], dtype=float)
_DAMPER_STD: Final = float(np.hypot(NATURE_STD["damper_front_nspm"], NATURE_TOGETHER_STD["damper"]))
_NATURAL_PRECISION: Final = np.asarray(np.linalg.inv(_NATURE_OF_DRIFTING), float)
_WORN_PRECISION: Final = with_worn_dampers(_NATURAL_PRECISION)
MOST_TENSION: Final = 25.74483195905612
"""The 99.99 % point of chi-squared of five, the vehicle's drifting parameters: a vehicle that drifts as vehicles do
exceeds it once in ten thousand batches.
"""


def tension_of(off: F64, *, is_worn: bool = False) -> float:
    """Chi-squared of the vehicle's drifting parameters, from their deviations ``off`` (k,) from the calibration.

    An unusual load or a changed vehicle is fitted with parameters that no drift explains. The measure is real drift
    (NATURE_STD), not the prior of the search: dampers that change by 5 % with temperature are no reason to refuse. As
    the search keeps them near the calibration, the measure is conservative. ``is_worn``: for dampers that may have
    worn.
    """
    off = off * _OF_THE_VEHICLE
    return float(off @ (_WORN_PRECISION if is_worn else _NATURAL_PRECISION) @ off)


def _factor(covariance: F64) -> F64:
    """(k, r) factor of a positive semi-definite (k, k); its columns are independent causes of unit variance."""
    values, vectors = np.linalg.eigh(covariance)
    kept = values > 1e-12 * values.max()
    factor: F64 = vectors[:, kept] * np.sqrt(values[kept])
    return factor


_IS_PACKING: Final = np.array([name.startswith("payload_") for name in DRIFT_STD])
_BEYOND_BELIEVED: Final = _NATURE_OF_DRIFTING - _BELIEVED
DAY_OF_STEADY: Final = _factor(NATURE_OF_STEADY)
"""(s, c) change of the STEADY parameters with each of the day's first c causes."""
_DAY_OF_DRIFTING: Final = _factor(np.where(np.outer(~_IS_PACKING, ~_IS_PACKING), _BEYOND_BELIEVED, 0.0))
_PACKING_OF_DRIFTING: Final = _factor(np.where(np.outer(_IS_PACKING, _IS_PACKING), _BEYOND_BELIEVED, 0.0))


def day_columns(found: F64, moves: F64, precision: F64) -> F64:
    """(8, k) change of drifting parameters and load by the day's springs, tyres, dampers and their friction.

    ``found`` (k, k) is their covariance, ``precision`` that of the search's prior, ``moves`` (k, s) their change with
    each of the STEADY parameters. A parameter that drifts further than the prior allows shifts the answer by the part
    that the prior determines: found times precision (S. F. Schmidt's consider covariance, Adv. Control Syst. 3, 1966).
    STEADY parameters that follow the batch also follow such a drift, which moves the answer further; so ``found`` has
    them free.
    """
    return np.concatenate([(moves @ DAY_OF_STEADY).T, (_pulls(found, precision) @ _DAY_OF_DRIFTING).T])


def packing_columns(found: F64, precision: F64) -> F64:
    """(1, k) the same for the stiffness of the load's packing."""
    columns: F64 = (_pulls(found, precision) @ _PACKING_OF_DRIFTING).T
    return columns


def _pulls(found: F64, precision: F64) -> F64:
    pulls: F64 = found[:, : len(DRIFTING)] @ precision
    return pulls
