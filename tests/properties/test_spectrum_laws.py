"""Laws of the segment spectra, and whitening of two and of three sensors against numpy's linear algebra."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from gateway.core.cross_spectrum import likelihood
from gateway.core.cross_spectrum.model.matrix import PAIRS, SpectralMatrix, Whitener
from gateway.core.spectrum import frequencies_hz, segment_starts, segment_transforms
from gateway.records import C128, Bool

RATE_HZ = 50.0

masks = hnp.arrays(bool, st.integers(0, 300), elements=st.integers(0, 9).map(bool))


@settings(derandomize=True)
@given(usable=masks, n_segment=st.integers(2, 40), step=st.integers(1, 40))
def test_segments_lie_wholly_in_the_mask_and_fill_every_run(usable: Bool, n_segment: int, step: int) -> None:
    starts = segment_starts(usable, n_segment, step)
    assert all(usable[s : s + n_segment].all() and s + n_segment <= len(usable) for s in starts)
    free = np.concatenate([[False], usable, [False]])
    run_starts, run_ends = (np.flatnonzero(np.diff(free.astype(int)) == way) for way in (1, -1))
    fitting = [max(0, (b - a - n_segment) // step + 1) for a, b in zip(run_starts, run_ends, strict=True)]
    assert len(starts) == sum(fitting)
    assert set(run_starts[np.array(fitting, int) > 0]) <= set(starts)


def test_a_signal_shorter_than_a_segment_has_no_spectrum() -> None:
    none = segment_starts(np.ones(30, bool), 32, 16)
    assert segment_transforms(np.zeros(30), none, 32, RATE_HZ).shape == (0, 17)


@settings(max_examples=30, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), n_segment=st.integers(8, 257), scale=st.floats(1e-3, 1e3))
def test_parseval(seed: int, n_segment: int, scale: float) -> None:
    x = scale * np.random.default_rng(seed).standard_normal(n_segment)
    (power,) = np.abs(segment_transforms(x, np.array([0]), n_segment, RATE_HZ)) ** 2
    k = np.arange(n_segment)
    tapered = (x - np.polyval(np.polyfit(k, x, 1), k)) * np.sin(np.pi * k / n_segment) ** 2
    weight = np.sum(np.sin(np.pi * k / n_segment) ** 4)
    assert np.sum(power) * RATE_HZ / n_segment == pytest.approx(np.sum(tapered**2) / weight, rel=1e-9)


@settings(max_examples=30, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), offset=st.floats(-1e3, 1e3), slope=st.floats(-10.0, 10.0))
def test_a_straight_line_changes_nothing(seed: int, offset: float, slope: float) -> None:
    x = np.random.default_rng(seed).standard_normal(600)
    starts = np.array([0, 100, 344])
    plain = segment_transforms(x, starts, 256, RATE_HZ)
    drifting = segment_transforms(x + offset + slope * np.arange(600) / RATE_HZ, starts, 256, RATE_HZ)
    np.testing.assert_allclose(drifting, plain, atol=1e-9)


def test_white_noise_has_its_variance_spread_evenly() -> None:
    x = 3.0 * np.random.default_rng(5).standard_normal(200_000)
    starts = segment_starts(np.ones(len(x), bool), 256, 128)
    density = np.mean(np.abs(segment_transforms(x, starts, 256, RATE_HZ)) ** 2, axis=0)
    np.testing.assert_allclose(density[3:-3], 9.0 / (RATE_HZ / 2.0), rtol=0.15)
    assert np.sum(density) * RATE_HZ / 256 == pytest.approx(9.0, rel=0.02)


def test_a_sine_holds_half_its_squared_amplitude_about_its_frequency() -> None:
    x = 2.0 * np.sin(2 * np.pi * 5.0 * np.arange(5000) / RATE_HZ)
    starts = segment_starts(np.ones(5000, bool), 500, 250)
    power = np.mean(np.abs(segment_transforms(x, starts, 500, RATE_HZ)) ** 2, axis=0)
    freq_hz = frequencies_hz(500, RATE_HZ)
    near = np.abs(freq_hz - 5.0) < 0.35
    assert np.sum(power[near]) * RATE_HZ / 500 == pytest.approx(2.0, rel=1e-3)
    assert freq_hz[np.argmax(power)] == pytest.approx(5.0)
    assert freq_hz[-1] == RATE_HZ / 2.0


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
