"""Standard deviations of weights and of the load's place are those of their slopes, found by moving what they hang on.

With x = (payload, front share, lateral place, part of the roll moment) and C the covariance of its errors, the variance
of f(x) is g C g with g the slopes of f, to first order.
"""

import math
from collections.abc import Callable
from dataclasses import astuple, dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray

from gateway.core.vehicle import Vehicle, cg_left_m, front_share_pct
from gateway.core.weights.on_the_road import PayloadPlace, place_of, weights_of
from gateway.estimate import PLACES, Quantity, Weights
from gateway.posterior import Posterior, Source

VAN = Vehicle(
    name="van",
    empty_mass_kg=1240.0,
    wheelbase_m=2.8,
    sensor_position_m=0.0,
    empty_front_share_pct=57.0,
    empty_front_share_std_pct=0.0,
    track_width_m=1.5,
    empty_cg_left_m=0.06,
    unsprung_front_kg=90.0,
    unsprung_rear_kg=110.0,
)
STDS = np.array([9.0, 0.4, 0.006, 0.05])
CORRELATIONS = {(0, 1): -0.5, (0, 2): 0.3, (1, 2): -0.4}


@dataclass(frozen=True)
class State:
    """What is estimated, at a load of 400 kg that lies 0.25 m right of the centre line."""

    payload_kg: float = 400.0
    share_pct: float = front_share_pct(VAN, 400.0, 1.9)
    cg_left_m: float = cg_left_m(VAN, 400.0, -0.25)
    roll_share: float = 0.62


def posterior(state: State) -> Posterior:
    """Half of the covariance own, half from sources; with an error of the empty share, in which place has no part."""
    correlations = np.eye(3)
    for (one, other), shared in CORRELATIONS.items():
        correlations[one, other] = correlations[other, one] = shared
    covariance = correlations * np.outer(STDS[:3], STDS[:3])
    columns = np.sqrt(0.5) * np.linalg.cholesky(covariance).T
    sources = {Source.CALIBRATION: columns[:2], Source.LOAD_LENGTH: columns[2:]}
    return Posterior(np.array([state.payload_kg, state.share_pct, state.cg_left_m]), 0.5 * covariance, sources)


def weights(state: State) -> Weights:
    return weights_of(VAN, posterior(state), Quantity(state.roll_share, STDS[3]))


def place(state: State) -> PayloadPlace:
    found = place_of(VAN, posterior(state).with_source(Source.EMPTY_SHARE, np.array([[0.0, 0.8, 0.0]])))
    assert found is not None
    return found


def errors(of: Callable[[State], tuple[float, ...]]) -> NDArray[np.float64]:
    """Covariance of what ``of`` tells, by central differences."""
    slopes, names = [], list(State.__dataclass_fields__)
    for name, std in zip(names, STDS, strict=True):
        step = 1e-4 * std
        up, down = (replace(State(), **{name: getattr(State(), name) + way * step}) for way in (1.0, -1.0))
        slopes.append((np.array(of(up)) - np.array(of(down))) / (2.0 * step))
    correlations = np.eye(4)
    for (one, other), shared in CORRELATIONS.items():
        correlations[one, other] = correlations[other, one] = shared
    found: NDArray[np.float64] = np.array(slopes).T @ (correlations * np.outer(STDS, STDS)) @ np.array(slopes)
    return found


@pytest.mark.parametrize("name", PLACES)
def test_a_weight_is_as_sure_as_what_it_hangs_on(name: str) -> None:
    [[variance]] = errors(lambda state: (getattr(weights(state), name).kg,))
    assert getattr(weights(State()), name).std_kg == pytest.approx(math.sqrt(variance), rel=1e-6)


def test_a_place_is_as_sure_as_what_it_hangs_on_along_across_and_together() -> None:
    covariance = errors(lambda state: astuple(place(state))[:3:2])
    found = place(State())
    assert (found.std_m, found.left_std_m) == pytest.approx(tuple(np.sqrt(np.diag(covariance))), rel=1e-6)
    assert found.correlation * found.std_m * found.left_std_m == pytest.approx(covariance[0, 1], rel=1e-6)


def test_the_place_is_the_one_that_statics_put_it_at() -> None:
    assert (place(State()).position_m, place(State()).left_m) == pytest.approx((1.9, -0.25))
