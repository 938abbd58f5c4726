"""Which directions of a calibration's covariance move loads: a few carry nearly all of what it leaves open.

A calibration has some ninety parameters, and most of what is uncertain about them moves no load. Estimates carry one
column for each of these directions, so that the same cause is recognised in each of them.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np

from gateway.records import F64

MOST: Final = 8  # they carry 98 % and more of the variance of payload; the rest counts as the model's
SCALES: Final = np.array([10.0, 0.2, 0.005])  # kg, %, m: what counts as equally much


def directions_of(moves: Sequence[F64], covariance: F64) -> F64:
    """(n, k) with independent causes of unit variance as columns, from ``moves``: (d, n) each, by how much payload
    (kg), front share (%) and lateral place (m) of some load move with each of the n parameters.
    """
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    rows = np.concatenate([one / SCALES[: len(one), None] for one in moves])
    _, _, directions = np.linalg.svd(rows @ root, full_matrices=False)
    found: F64 = root @ directions[:MOST].T
    return found
