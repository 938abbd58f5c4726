"""A few directions of a covariance carry what it leaves open of loads."""

import numpy as np
import pytest

from gateway.calibration.half_car.fit import MOST, SCALES, directions_of


def made(n: int, n_loads: int, seed: int) -> tuple[list[np.ndarray], np.ndarray]:
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((n, n)) * 0.1
    return [rng.standard_normal((3, n)) * SCALES[:, None] for _ in range(n_loads)], root @ root.T


@pytest.mark.parametrize("n_loads", [1, 2])
def test_loads_that_they_were_made_from_have_their_whole_covariance(n_loads: int) -> None:
    """Up to MOST numbers: 3 of one load, 6 of two."""
    moves, covariance = made(30, n_loads, 1)
    directions = directions_of(moves, covariance)
    for one in moves:
        by_directions = one @ directions
        assert by_directions @ by_directions.T == pytest.approx(one @ covariance @ one.T, rel=1e-6, abs=1e-9)


def test_they_never_claim_more_than_the_covariance() -> None:
    moves, covariance = made(30, 12, 2)
    directions = directions_of(moves, covariance)
    assert directions.shape == (30, MOST)
    assert np.linalg.eigvalsh(covariance - directions @ directions.T).min() > -1e-9
    for other in made(30, 5, 3)[0]:
        claimed = other @ directions @ directions.T @ other.T
        assert np.linalg.eigvalsh((other @ covariance @ other.T - claimed) / np.outer(SCALES, SCALES)).min() > -1e-9


def test_what_moves_no_load_is_left_out() -> None:
    moves, covariance = made(30, 2, 4)
    for one in moves:
        one[:, 10:] = 0.0
    diagonal = np.diag(np.diag(covariance))
    assert np.abs(directions_of(moves, diagonal)[10:]).max() < 1e-9


def test_causes_are_independent_and_of_unit_variance() -> None:
    """F = C^(1/2) V with V orthonormal, so that F' C^-1 F is the identity."""
    moves, covariance = made(20, 6, 5)
    directions = directions_of(moves, covariance)
    assert directions.T @ np.linalg.inv(covariance) @ directions == pytest.approx(np.eye(MOST), abs=1e-6)


def test_loads_with_and_without_a_place_may_be_mixed() -> None:
    moves, covariance = made(30, 2, 6)
    directions = directions_of([moves[0], moves[1][:2]], covariance)
    found = moves[1][:2] @ directions
    assert found @ found.T == pytest.approx(moves[1][:2] @ covariance @ moves[1][:2].T, rel=1e-6)
