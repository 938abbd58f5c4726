"""How far along the floor a load reaches, which no batch tells: it lies in one place, or from bulkhead to door.

A long load is harder to pitch than a short one of the same weight at the same place. Weighed as short as calibration's
were, it is found too light; a short one, weighed as long, too heavy. The spectra tell the two apart less well than the
half-car errs (docs/method.md), so that the length is not sought: the answer carries it.
"""

from dataclasses import replace
from math import log, sqrt
from typing import Final

import numpy as np

from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.model.parameters import INDEX
from gateway.core.cross_spectrum.unseen_load import unseen_covariance
from gateway.records import F64

FLOOR_PER_WHEELBASE: Final = 0.8
"""Load floors of vans are 0.65 (small ones) to 0.93 (large ones) of their wheelbase long, by their makers' figures."""
PIECES_SCATTER: Final = 0.5
"""Standard deviation of the squared radius of gyration of five like pieces, anywhere on the floor, over its mean: that
of n evenly spread numbers' variance is ((1.8 - (n - 3) / (n - 1)) / n)^(1/2) of it.
"""

_GYRATION: Final = INDEX["payload_gyration_m2"]


def as_carried(calibration: CrossSpectrumCalibration) -> CrossSpectrumCalibration:
    """With loads as long as the vehicle is said to carry them; as the known loads were, where nobody said."""
    if calibration.payload_length_m is None:
        return calibration
    parameters, covariance = calibration.parameters.copy(), calibration.covariance.copy()
    parameters[_GYRATION] = log(_gyration_m2(calibration.payload_length_m))
    covariance[_GYRATION] = covariance[:, _GYRATION] = 0.0
    return replace(calibration, parameters=parameters, covariance=covariance)


def gyration_std_m2(calibration: CrossSpectrumCalibration) -> float:
    """Standard deviation of a load's squared radius of gyration about that by which it is weighed.

    Where nobody said how long loads lie, half of them lie as the known ones, half are pieces anywhere on the floor.
    """
    if calibration.payload_length_m is not None:
        return PIECES_SCATTER * _gyration_m2(calibration.payload_length_m)
    known = float(np.exp(calibration.parameters[_GYRATION]))
    pieces = _gyration_m2(FLOOR_PER_WHEELBASE * calibration.wheelbase_m)
    return sqrt(0.5 * ((pieces - known) ** 2 + (PIECES_SCATTER * pieces) ** 2))


def spread_covariance(moves: F64, payload_kg: float, carried: CrossSpectrumCalibration) -> F64:
    """(2, 2) of payload (kg) and front share (0..1), from a load that is longer or shorter than it was weighed as.

    ``moves`` (2,) is by how much the two move with the logarithm of the payload's squared radius of gyration, of which
    the model is linear; ``carried`` is :func:`as_carried`.
    """
    moved = moves * gyration_std_m2(carried) / float(np.exp(carried.parameters[_GYRATION]))
    return unseen_covariance(moved, payload_kg)


def _gyration_m2(length_m: float) -> float:
    """Of a load of even weight and that length."""
    return length_m**2 / 12.0
