"""What is assumed before the fit: of a vehicle, and of one of its drives."""

from dataclasses import dataclass, replace
from math import exp, log
from typing import Final

import numpy as np

from gateway.calibration.statements import LoadPrior
from gateway.core.cargo import shape_hypotheses
from gateway.core.vehicle import Vehicle
from gateway.model import fit
from gateway.model.table import (
    BEND_SHARES,
    FRONT,
    INDEX,
    N_OWN,
    OWN,
    REAR,
    ROWS,
    UPRIGHT,
    N,
    covariance_of,
    prior_of,
    scale_of,
)
from gateway.model.vehicle_model import VehicleModel
from gateway.records import F64

SOFTENING_STD: Final = 0.3
"""Chosen: per kN, of the table's vehicle: by how much the logarithm of a spring's rate may fall under load.
Coils, leaves, helper springs, bump stops and air springs become stiffer. A fit of loads far apart found springs between
them nine times as stiff as empty, and three times at the heavier one.
"""
SHARED: Final = 1e-2  # chosen: what is left of the deviations among known loads: one day, one box, one road
GYRATION, MODE = OWN.index(INDEX["payload_gyration_m2"]), OWN.index(INDEX["payload_mode_hz"])
_COMPACT_LOG_S: Final = log(0.1)


@dataclass(frozen=True, slots=True, eq=False)
class Prior:
    """What is assumed of a vehicle before its first drive: mean (n,) and covariance (n, n).

    stiffening (m, N) gives the slope of each spring's rate from bend to bend; a slope below 0 is penalised.
    """

    mean: F64
    covariance: F64
    stiffening: F64
    like: VehicleModel | None = None

    @classmethod
    def of_any(cls, vehicle: Vehicle, *, with_roll: bool) -> "Prior":
        """Of any vehicle of this size, by the table."""
        mean, std = prior_of(ROWS if with_roll else UPRIGHT, vehicle)
        return cls(mean, np.diag(std**2), _stiffening(vehicle))

    def upright(self, n_causes: int) -> fit.Gaussian:
        """Of the half-car (N,), whose springs do not soften under load, and behind it of errors that claims have in
        common, each of unit variance.
        """
        half_car = fit.Gaussian.of(self.mean[:N], self.covariance[:N, :N])
        precision = np.eye(N + n_causes)
        precision[:N, :N] = half_car.precision
        rising = np.pad(self.stiffening, ((0, 0), (0, n_causes)))
        return fit.Rising(np.r_[half_car.mean, np.zeros(n_causes)], precision, rising)

    @classmethod
    def of_sister(cls, sister: VehicleModel, vehicle: Vehicle, *, with_roll: bool) -> "Prior":
        """Of a vehicle of the same line as one that was taught: its posterior, and by how much vehicles differ."""
        any_one = cls.of_any(vehicle, with_roll=with_roll)
        rows = ROWS if with_roll else UPRIGHT
        n = min(len(rows), len(sister.parameters))
        shared = [i for i in range(n) if rows[i].line]
        mean, covariance = any_one.mean.copy(), any_one.covariance.copy()
        scatter = np.diag([rows[i].line ** 2 for i in shared])
        mean[shared] = sister.parameters[shared]
        covariance[np.ix_(shared, shared)] = sister.covariance[np.ix_(shared, shared)] + scatter
        return cls(mean, covariance, any_one.stiffening, sister)


def _stiffening(vehicle: Vehicle) -> F64:
    """(2 b, N) slope of the logarithm of each spring's rate behind each of its b bends, in SOFTENING_STD."""
    n = len(BEND_SHARES)
    rows = np.zeros((2, n, N))
    for at_axle, end in zip(rows, (FRONT, REAR), strict=True):
        at_axle[:, INDEX[f"spring_slope_{end}_per_kn"]] = 1.0
        at_axle[:, [INDEX[f"spring_bend_{end}_{i}_per_kn"] for i in range(n)]] = np.tri(n)
    return np.asarray(rows.reshape(-1, N) * scale_of(vehicle) / SOFTENING_STD)


def own_prior(stated: LoadPrior, vehicle: Vehicle, *, is_said: bool = False) -> fit.Gaussian:
    """The prior of a drive's own vector: how drives deviate from their vehicle, and what is stated of the load.

    It is flat in the payload if the drive's terms say that (``is_said``).
    """
    if stated.carries is not None:
        vehicle = replace(vehicle, carries=stated.carries, payload_length_m=None, payload_height_m=None)
    covariance = np.zeros((N_OWN + 2, N_OWN + 2))
    covariance[:N_OWN, :N_OWN] = covariance_of([UPRIGHT[i] for i in OWN], "day", "load", "batch")
    mean = np.zeros(N_OWN + 2)
    if stated.is_compact:
        covariance[:N_OWN, :N_OWN] *= SHARED**2
    else:
        shapes = shape_hypotheses(vehicle, exp(_COMPACT_LOG_S), 0.7)
        at = np.array([one.log_s - _COMPACT_LOG_S for one in shapes])
        weight = np.array([one.probability for one in shapes])
        mean[GYRATION] = weight @ at
        covariance[GYRATION, GYRATION] = weight @ (
            np.array([one.std for one in shapes]) ** 2 + (at - mean[GYRATION]) ** 2
        )
    covariance[N_OWN, N_OWN], covariance[N_OWN + 1, N_OWN + 1] = stated.payload_std_kg**2, stated.front_share_std**2
    mean[N_OWN:] = stated.payload_kg, stated.front_share
    prior = fit.Gaussian.of(mean, covariance)
    if is_said:
        prior.precision[N_OWN, :] = prior.precision[:, N_OWN] = 0.0
    return prior
