"""What a change of the vehicle since its calibration adds to the interval of a load, held against exact algebra."""

import numpy as np
import pytest

from gateway.core.cross_spectrum.drift import (
    DAMPERS_TOGETHER_STD,
    DRIFT_STD,
    DRIFTING,
    HELD_STD,
    NATURE_STD,
    NATURE_TOGETHER_STD,
    NOISE_STD,
    STEADY,
    day_columns,
    drift_precision,
    packing_columns,
    wear_of,
)
from gateway.core.cross_spectrum.model.parameters import PARAMETERS
from gateway.records import F64

N_FITTED = len(DRIFTING) + 2  # and the load's two
PRECISION = drift_precision()


def natural_covariance(entries: list[int], otherwise: F64) -> F64:
    """Each by itself, and what both axles have in common."""
    names = [PARAMETERS[i] for i in entries]
    covariance = np.diag([NATURE_STD.get(name, usual) ** 2 for name, usual in zip(names, otherwise, strict=True)])
    for i, one in enumerate(names):
        for j, other in enumerate(names):
            kind, kind_of_other = (name.replace("rear", "front").split("_front")[0] for name in (one, other))
            if {one, other} <= {*NATURE_STD} and kind == kind_of_other:
                covariance[i, j] += NATURE_TOGETHER_STD.get(kind, 0.0) ** 2
    return covariance


def drift_covariance(found: F64, moves: F64) -> F64:
    """Of the fitted numbers: what the day's causes and the load's packing add to what the search states."""
    columns = np.vstack([day_columns(found, moves, PRECISION), packing_columns(found, PRECISION)])
    return np.asarray(columns.T @ columns)


@pytest.mark.parametrize("evidence", [1e-2, 1.0, 1e4])
def test_it_is_the_covariance_of_the_error_in_a_linear_world(evidence: float) -> None:
    """A quadratic cost: the fitted err by the noise, by how far they drift, and by what is not fitted."""
    rng = np.random.default_rng(4)
    sensitivity = rng.standard_normal((N_FITTED + len(STEADY), 3 * N_FITTED))
    information = evidence * sensitivity @ sensitivity.T
    of_fitted, across = information[:N_FITTED, :N_FITTED], information[:N_FITTED, N_FITTED:]
    believed = np.array(list(DRIFT_STD.values()))
    prior = np.pad(PRECISION, (0, 2))
    found = np.linalg.inv(of_fitted + prior)
    moves = -found @ across
    drifted = np.pad(natural_covariance(DRIFTING, believed), (0, 2))
    not_fitted = natural_covariance(STEADY, np.zeros(len(STEADY)))
    exact = found @ (of_fitted + prior @ drifted @ prior + across @ not_fitted @ across.T) @ found
    assert np.allclose(found + drift_covariance(found, moves), exact, rtol=1e-6)


def test_nature_scatters_more_than_the_search_believes() -> None:
    assert all(NATURE_STD[name] >= std for name, std in DRIFT_STD.items() if name in NATURE_STD)
    assert NATURE_TOGETHER_STD["damper"] >= DAMPERS_TOGETHER_STD
    assert {*NATURE_STD} <= {*PARAMETERS}


def test_a_day_that_warms_both_axles_hardly_moves_the_share_between_them() -> None:
    """Front and rear pull it to opposite sides: what they have in common widens by less than what each has alone."""
    found = np.zeros((N_FITTED, N_FITTED))
    moves = np.zeros((N_FITTED, len(STEADY)))
    for end, pull in (("front", 0.1), ("rear", -0.1)):
        moves[-1, STEADY.index(PARAMETERS.index(f"tyre_{end}_npm"))] = pull
    alone = 0.1 * NATURE_STD["tyre_front_npm"]
    assert drift_covariance(found, moves)[-1, -1] == pytest.approx(2.0 * alone**2)


def test_dampers_drift_together_more_than_apart() -> None:
    covariance = np.linalg.inv(PRECISION)
    front, rear = (list(DRIFT_STD).index(f"damper_{end}_nspm") for end in ("front", "rear"))
    together, apart = (np.zeros(len(DRIFTING)) for _ in range(2))
    together[[front, rear]], apart[[front, rear]] = (0.5, 0.5), (1.0, -1.0)
    assert together @ covariance @ together == pytest.approx(
        DAMPERS_TOGETHER_STD**2 + DRIFT_STD["damper_front_nspm"] ** 2 / 2
    )
    assert apart @ covariance @ apart == pytest.approx(2.0 * DRIFT_STD["damper_front_nspm"] ** 2)


def test_noise_that_is_free_leaves_the_rest_as_it_is() -> None:
    held, free = (np.linalg.inv(drift_precision(is_noise_free=is_free)) for is_free in (False, True))
    is_noise = np.array([name.startswith("noise_") for name in DRIFT_STD])
    assert np.diag(held)[is_noise] ** 0.5 == pytest.approx(HELD_STD)
    assert np.diag(free)[is_noise] ** 0.5 == pytest.approx(NOISE_STD)
    assert np.allclose(held[~is_noise], free[~is_noise])


def test_wear_is_what_dampers_lie_off_beyond_nature() -> None:
    std = np.hypot(NATURE_STD["damper_front_nspm"], NATURE_TOGETHER_STD["damper"])
    assert wear_of(np.zeros(2)) == wear_of(np.array([std, -std])) == 0.0
    assert wear_of(np.array([3.0 * std, -3.0 * std])) == pytest.approx(np.sqrt(8.0))
    assert wear_of(np.array([0.0, 3.0 * std])) == pytest.approx(np.sqrt(3.5))
