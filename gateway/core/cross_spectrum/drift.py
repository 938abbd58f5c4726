"""What of a vehicle is not as it was when it was calibrated: from day to day, and from load to load.

The search for a load leaves a few of these free, near the calibration. The others, and what of these lies
further off than the search believes, cannot be told from the load in one batch: they widen the interval.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

import numpy as np
from scipy.special import gammaincinv

from gateway.core.cross_spectrum.model.parameters import INDEX, PARAMETERS
from gateway.records import F64

DRIFT_STD: Final[Mapping[str, float]] = MappingProxyType(
    {
        "damper_front_nspm": 0.01,
        "damper_rear_nspm": 0.01,
        "delay_scale": 0.003,
        "payload_mode_hz": 0.3,
        "payload_damping_ratio": 0.5,  # chosen: a peak on soft mounts cannot be fitted with a firm floor's damping
        "gyro_lag_s": 0.001,
    }
)
"""What the search leaves free, and how far off, each by itself: standard deviations, of logarithms of what is positive.

Narrower than nature, for the minutes of a batch repeat one error of the model: less evidence than they seem.
"""

NATURE_STD: Final[Mapping[str, float]] = MappingProxyType(
    {
        "spring_front_npm": 0.01,  # rubber in parallel with steel, over 10 K
        "spring_rear_npm": 0.01,
        "tyre_front_npm": 0.03,  # goes with its pressure, and that with the absolute temperature: 10 K are 3.4 %
        "tyre_rear_npm": 0.03,
        "damper_front_nspm": 0.05,  # wear, and the oil's viscosity as far as valves let it through
        "damper_rear_nspm": 0.05,
        "payload_mode_hz": 0.6,  # on the floor, on pallets, in a rack
    }
)
"""How far vehicle and packing really lie from their calibration; each axle its own."""

DAMPERS_TOGETHER_STD: Final = 0.03
"""What both axles' dampers have in common beside it: their oil is as warm or cold in front as at the rear."""

DRIFTING: Final = [INDEX[name] for name in DRIFT_STD]
STEADY: Final = [i for i in range(len(PARAMETERS)) if i not in DRIFTING]


_OWN_VAR: Final = np.array(list(DRIFT_STD.values())) ** 2


def _believed_covariance() -> F64:
    is_damper = np.array([name.startswith("damper_") for name in DRIFT_STD], dtype=float)
    together: F64 = DAMPERS_TOGETHER_STD**2 * np.outer(is_damper, is_damper)
    return together + np.diag(_OWN_VAR)


DRIFT_PRECISION: Final = np.linalg.inv(_believed_covariance())
"""(k, k) of the DRIFTING parameters: the inverse of what the search believes of them."""


_OF_THE_VEHICLE: Final = np.array([name != "gyro_lag_s" for name in DRIFT_STD], dtype=float)  # a lag is the computer's
_NATURAL_VAR: Final = np.maximum([NATURE_STD.get(name, 0.0) ** 2 for name in DRIFT_STD], _OWN_VAR)
_NATURAL_PRECISION: Final = np.linalg.inv(_believed_covariance() + np.diag(_NATURAL_VAR - _OWN_VAR))
MOST_TENSION: Final = float(2.0 * gammaincinv(int(_OF_THE_VEHICLE.sum()) / 2.0, 1.0 - 1e-4))  # chi-squared quantile
"""A vehicle that drifts as vehicles do exceeds this once in ten thousand batches."""


def tension_of(off: F64) -> float:
    """How far the drifting parameters lie ``off`` (k,) their calibration: those of the vehicle, squared, chi-squared.

    A load unlike any that calibration saw, or a vehicle that is no longer the same, is fitted at the price of
    parameters that no drift explains. The measure is what is natural (NATURE_STD), not what the search believes:
    dampers that another day changed by 5 % are no reason to refuse. The search holds them near the calibration, so that
    they lie nearer by right.
    """
    off = off * _OF_THE_VEHICLE
    return float(off @ _NATURAL_PRECISION @ off)


def drift_covariance(found: F64, moves: F64) -> F64:
    """What nature adds to the covariance ``found`` (k, k) of the drifting parameters and the load: (k, k) again.

    ``moves`` (k, s) is by how much these move with each of the STEADY parameters. A parameter that drifts
    further than the search believed pulls the answer by the share that the prior holds of it: found times precision
    (S. F. Schmidt's consider covariance, Adv. Control Syst. 3, 1966).
    """
    pulls = found[:, : len(DRIFTING)] @ DRIFT_PRECISION
    more_var = np.maximum(0.0, _nature_var(DRIFTING) - _OWN_VAR)
    added: F64 = (moves * _nature_var(STEADY)) @ moves.T + (pulls * more_var) @ pulls.T
    return added


def _nature_var(entries: list[int]) -> F64:
    return np.array([NATURE_STD.get(PARAMETERS[i], 0.0) ** 2 for i in entries])
