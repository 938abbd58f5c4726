"""Special functions of the estimators, which a service computes without scipy, are scipy's."""

import numpy as np
import pytest
from scipy import special

from gateway.model.tracks import MOST_X, coherence_of, coherence_slope_of

X = np.geomspace(1e-4, MOST_X, 5001).reshape(3, 1667)


def test_the_coherence_of_two_tracks_is_x_k1():
    np.testing.assert_allclose(coherence_of(np.log(X)), X * special.k1(X), rtol=1e-9)


def test_its_slope_is_x2_k0():
    np.testing.assert_allclose(coherence_slope_of(np.log(X)), -(X**2) * special.k0(X), rtol=1e-9)


def test_one_track_is_coherent_with_itself_and_distant_ones_are_not():
    assert coherence_of(np.log([1e-30, 1e6])).tolist() == pytest.approx([1.0, 0.0], abs=1e-7)
    assert coherence_slope_of(np.log([1e-30, 1e6])).tolist() == pytest.approx([0.0, 0.0], abs=1e-6)
