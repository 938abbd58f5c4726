"""Whitening of two and of three sensors, and the parts of a likelihood, against numpy's linear algebra."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.cross_spectrum import likelihood
from gateway.core.cross_spectrum.model.matrix import PAIRS, SpectralMatrix, Whitener
from gateway.records import C128

SHAPE = (2, 3)  # groups, frequencies
Seed = st.integers(0, 2**31)
SENSORS = pytest.mark.parametrize("p", [2, 3])


def hermitian(p: int, seed: int, *, shape: tuple[int, ...] = SHAPE) -> C128:
    """(*shape, p, p), any; positive definite ones are its square and a little of the unit matrix."""
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((*shape, p, p)) + 1j * rng.standard_normal((*shape, p, p))
    return np.asarray(root + np.conj(np.swapaxes(root, -1, -2)), np.complex128)


def positive(p: int, seed: int) -> C128:
    """Sensors of very different units."""
    own = hermitian(p, seed)
    unit = np.diag(10.0 ** np.random.default_rng(seed).uniform(-3.0, 3.0, p))
    return np.asarray(unit @ (own @ own + 0.05 * np.eye(p)) @ unit, np.complex128)


def packed(whole: C128) -> SpectralMatrix:
    p = whole.shape[-1]
    pairs = PAIRS[: p * (p - 1) // 2]
    return SpectralMatrix(
        np.stack([whole[..., i, i].real for i in range(p)]), np.stack([whole[..., i, j] for i, j in pairs])
    )


def unpacked(matrix: SpectralMatrix) -> C128:
    p = len(matrix.auto)
    whole = np.zeros((*matrix.auto.shape[1:], p, p), np.complex128)
    for i in range(p):
        whole[..., i, i] = matrix.auto[i]
    for (i, j), one in zip(matrix.pairs, matrix.cross, strict=True):
        whole[..., i, j], whole[..., j, i] = one, np.conj(one)
    return whole


@SENSORS
@given(seed=Seed)
def test_its_roots_are_those_of_cholesky(p: int, seed: int) -> None:
    whole = positive(p, seed)
    by, lower = Whitener.of(packed(whole)), np.linalg.cholesky(whole)
    for i in range(p):
        np.testing.assert_allclose(by.roots[i], lower[..., i, i].real, rtol=1e-6)
    for (i, j), one in zip(PAIRS, by.below, strict=False):
        np.testing.assert_allclose(one * by.roots[j], lower[..., i, j], rtol=1e-6, atol=1e-6 * np.abs(lower).max())


@SENSORS
@given(seed=Seed)
def test_whitening_is_both_triangular_inverses(p: int, seed: int) -> None:
    whole, other = positive(p, seed), positive(p, seed + 1)
    inverse = np.linalg.inv(np.linalg.cholesky(whole))
    wanted = inverse @ other @ np.conj(np.swapaxes(inverse, -1, -2))
    found = unpacked(Whitener.of(packed(whole))(packed(other)))
    assert np.max(np.abs(found - wanted)) < 1e-6 * np.max(np.abs(wanted))


@SENSORS
@given(seed=Seed)
def test_a_matrix_whitens_itself_and_many_at_once(p: int, seed: int) -> None:
    """Slopes come as (p, k, groups, frequencies)."""
    whole, others = positive(p, seed), hermitian(p, seed + 2, shape=(4, *SHAPE))
    by = Whitener.of(packed(whole))
    np.testing.assert_allclose(unpacked(by(packed(whole))), np.broadcast_to(np.eye(p), whole.shape), atol=1e-6)
    together = by(packed(others))
    for k in range(4):
        one = by(packed(others[k]))
        np.testing.assert_array_equal(together.auto[:, k], one.auto)
        np.testing.assert_array_equal(together.cross[:, k], one.cross)


@SENSORS
@given(seed=Seed)
def test_determinants_are_numpys(p: int, seed: int) -> None:
    whole = hermitian(p, seed)
    scale = np.max(np.abs(whole)) ** p
    np.testing.assert_allclose(
        likelihood._determinant(packed(whole)), np.linalg.det(whole).real, rtol=1e-9, atol=1e-12 * scale
    )


@SENSORS
@given(seed=Seed)
def test_traceless_parts_keep_the_inner_product(p: int, seed: int) -> None:
    """tr(X Y) of matrices less their traces, as a product of p^2 - 1 real numbers."""
    one, other = hermitian(p, seed), hermitian(p, seed + 3)
    parts, beside = likelihood._traceless(packed(one)), likelihood._traceless(packed(other))
    assert len(parts) == p * p - 1

    def without_trace(whole: C128) -> C128:
        trace = np.trace(whole, axis1=-2, axis2=-1)[..., None, None]
        return np.asarray(whole - trace * np.eye(p) / p, np.complex128)

    wanted = np.trace(without_trace(one) @ without_trace(other), axis1=-2, axis2=-1).real
    np.testing.assert_allclose(np.sum(parts * beside, axis=0), wanted, rtol=1e-9, atol=1e-9)


def test_a_pivot_lost_to_rounding_does_not_break_the_logarithm() -> None:
    """Two sensors that read one thing, and a third that adds nothing to them."""
    auto = np.ones((3, 1, 1))
    cross = np.ones((3, 1, 1), np.complex128)
    assert np.all(Whitener.of(SpectralMatrix(auto, cross)).roots > 0.0)
