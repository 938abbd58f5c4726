"""What a change of the vehicle since its calibration adds to the interval of a load, held against exact algebra."""

import numpy as np
import pytest

from gateway.core.cross_spectrum.drift import (
    DAMPERS_TOGETHER_STD,
    DRIFT_PRECISION,
    DRIFT_STD,
    DRIFTING,
    NATURE_STD,
    STEADY,
    drift_covariance,
)
from gateway.core.cross_spectrum.model.parameters import PARAMETERS
from gateway.records import F64

N_FITTED = len(DRIFTING) + 2  # and the load's two


def natural_std(entries: list[int], otherwise: F64) -> F64:
    return np.array([NATURE_STD.get(PARAMETERS[i], usual) for i, usual in zip(entries, otherwise, strict=True)])


@pytest.mark.parametrize("evidence", [1e-2, 1.0, 1e4])
def test_it_is_the_covariance_of_the_error_in_a_linear_world(evidence: float) -> None:
    """A quadratic cost: the fitted err by the noise, by how far they drift, and by what is not fitted."""
    rng = np.random.default_rng(4)
    sensitivity = rng.standard_normal((N_FITTED + len(STEADY), 3 * N_FITTED))
    information = evidence * sensitivity @ sensitivity.T
    of_fitted, across = information[:N_FITTED, :N_FITTED], information[:N_FITTED, N_FITTED:]
    believed = np.array(list(DRIFT_STD.values()))
    prior = np.pad(DRIFT_PRECISION, (0, 2))
    found = np.linalg.inv(of_fitted + prior)
    moves = -found @ across
    in_common = np.linalg.inv(DRIFT_PRECISION) - np.diag(believed**2)
    drifted = np.pad(in_common + np.diag(natural_std(DRIFTING, believed) ** 2), (0, 2))
    not_fitted = np.diag(natural_std(STEADY, np.zeros(len(STEADY))) ** 2)
    exact = found @ (of_fitted + prior @ drifted @ prior + across @ not_fitted @ across.T) @ found
    assert np.allclose(found + drift_covariance(found, moves), exact, rtol=1e-6)


def test_nature_scatters_more_than_the_search_believes() -> None:
    assert all(NATURE_STD[name] >= std for name, std in DRIFT_STD.items() if name in NATURE_STD)
    assert {*NATURE_STD} <= {*PARAMETERS}


def test_dampers_drift_together_more_than_apart() -> None:
    covariance = np.linalg.inv(DRIFT_PRECISION)
    front, rear = (list(DRIFT_STD).index(f"damper_{end}_nspm") for end in ("front", "rear"))
    together, apart = (np.zeros(len(DRIFTING)) for _ in range(2))
    together[[front, rear]], apart[[front, rear]] = (0.5, 0.5), (1.0, -1.0)
    assert together @ covariance @ together == pytest.approx(
        DAMPERS_TOGETHER_STD**2 + DRIFT_STD["damper_front_nspm"] ** 2 / 2
    )
    assert apart @ covariance @ apart == pytest.approx(2.0 * DRIFT_STD["damper_front_nspm"] ** 2)
