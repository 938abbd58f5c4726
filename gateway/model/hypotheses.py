"""What may be true of a batch's load and dampers beside one Gaussian: priors of the half-car's parameters.

A load is compact or spread out, on a firm or a soft mount, and dampers are sound or worn: each of these is a
hypothesis, with a prior of its own. What is known of the parameters before a batch is what calibration left open and
what differs from day to day, from load to load and from batch to batch (gateway.model.table).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway.core.cargo import ShapeHypothesis
from gateway.model import fit
from gateway.model.table import INDEX, UPRIGHT, N, covariance_of
from gateway.model.vehicle_model import VehicleModel
from gateway.records import F64

SOFT_HZ: Final = 10.5  # chosen: middle of the resonances of loads on soft mounts
SOFT_COST: Final = 3.0  # chosen: minus the logarithm of the share of loads on soft mounts
WORN_STD: Final = 0.3  # chosen: of the logarithm of each axle's dampers, if they may have worn or been replaced
WORN_COST: Final = 3.0
"""Minus the logarithm of the share of batches with worn dampers. Chosen on four simulated vans that serve nothing else:
with 4, of 24 batches on worn dampers five were ambiguous and the payloads of the others 6.4 % off; with 3 two, and
3.1 %.
"""
HELD_STD: Final = 1e-3  # chosen: of the noise without a roll rate: roll leaks into the sensors and looks like noise

_GYRATION, _MODE, _GAIN = (INDEX[name] for name in ("payload_gyration_m2", "payload_mode_hz", "accelerometer_gain"))
DAMPERS: Final = [INDEX["damper_front_nspm"], INDEX["damper_rear_nspm"]]
_NOISES: Final = [INDEX["noise_acceleration_m2ps3"], INDEX["noise_pitch_rate_rad2ps"]]


def _of_column(*columns: str) -> F64:
    covariance = covariance_of(UPRIGHT, *columns)
    covariance[_GAIN] = covariance[:, _GAIN] = 0.0  # the sensor's: each batch has its own
    return covariance


DAY, LOAD, BATCH = (_of_column(name) for name in ("day", "load", "batch"))


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """A prior of the parameters: mean (N,) and covariance (N, N), of which of_load (N, N) is the load's part.

    cost is minus the logarithm of its probability. shape names what it says of the load.
    """

    name: str
    mean: F64
    covariance: F64
    of_load: F64
    cost: float = 0.0
    is_soft: bool = False
    is_worn: bool = False

    @property
    def prior(self) -> fit.Gaussian:
        """The prior of parameters, payload and front share; flat in the load."""
        precision = np.zeros((N + 2, N + 2))
        precision[:N, :N] = np.linalg.inv(self.covariance)
        return fit.Gaussian(np.r_[self.mean, 0.0, 0.0], precision)

    def soft(self) -> "Hypothesis":
        """The load as if it stood on a soft mount."""
        mean = self.mean.copy()
        mean[_MODE] = math.log(SOFT_HZ)
        return replace(self, name=f"{self.name}, soft", mean=mean, cost=self.cost + SOFT_COST, is_soft=True)

    def worn(self) -> "Hypothesis":
        """The load as if the dampers had worn or been replaced."""
        covariance = self.covariance.copy()
        covariance[DAMPERS, DAMPERS] += WORN_STD**2
        return replace(self, name=f"{self.name}, worn", covariance=covariance, cost=self.cost + WORN_COST, is_worn=True)


def hypotheses_of(
    model: VehicleModel, shapes: Sequence[ShapeHypothesis], gain: tuple[float, float], *, with_roll: bool
) -> list[Hypothesis]:
    """One hypothesis for each shape of the load, firm and sound.

    ``gain`` is the logarithm of the accelerometer's gain and its standard deviation. ``with_roll``: each batch
    determines its sensors' noise.
    """
    of_batch = BATCH.copy()
    if not with_roll:
        of_batch[_NOISES, _NOISES] = HELD_STD**2
    found = []
    for shape in shapes:
        mean, of_load = model.parameters[:N].copy(), LOAD.copy()
        known = model.covariance[:N, :N].copy()
        known[_GYRATION] = known[:, _GYRATION] = 0.0
        mean[_GYRATION], of_load[_GYRATION, _GYRATION] = shape.log_s, shape.std**2
        of_batch[_GAIN, _GAIN], mean[_GAIN] = gain[1] ** 2, gain[0]
        covariance = known + DAY + of_load + of_batch
        found.append(Hypothesis(shape.name, mean, covariance, of_load, -math.log(shape.probability)))
    return found
