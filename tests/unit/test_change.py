"""The one detector of changes: Bayes factors against brute force, and correlated errors made use of."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.change import EVEN, ROLLING, Rules, change_of, probability
from gateway.core.vehicle import Vehicle
from gateway.posterior import Posterior, Source, difference

RULES = Rules(range_kg=1000.0, mass_kg=2000.0)


def load(kg: float, share_pct: float = 50.0, left_m: float | None = None, correlation: float = 0.0) -> Posterior:
    """Own errors of 8 kg and 0.3 % with this correlation, common ones of 15 kg."""
    mean = np.array([kg, share_pct, *([] if left_m is None else [left_m])])
    own = np.diag(np.square([8.0, 0.3, 0.005])[: len(mean)])
    own[0, 1] = own[1, 0] = correlation * 8.0 * 0.3
    return Posterior(mean, own, {Source.CALIBRATION: np.array([[15.0, 0.2, 0.01][: len(mean)]])})


def test_the_probability_is_bayes_own() -> None:
    """By brute force: changes drawn from the prior, densities averaged."""
    before, after = load(300.0, correlation=0.6), load(328.0, 50.4, correlation=0.6)
    x, unchanged = difference(before, after, is_one_load=True)
    _, changed = difference(before, after, is_one_load=False)
    rng = np.random.default_rng(1)
    d = RULES.spread_kg * rng.standard_normal(400_000)
    covariances = np.repeat(changed[None], len(d), axis=0)
    covariances[:, 1, 1] += (100.0 * 0.3 / RULES.mass_kg * d) ** 2
    off = x - np.stack([d, np.zeros_like(d)], axis=1)
    inverse, determinant = np.linalg.inv(covariances), np.linalg.det(covariances)
    with_change = np.mean(np.exp(-0.5 * np.einsum("ni,nij,nj->n", off, inverse, off)) / np.sqrt(determinant))
    without = np.exp(-0.5 * x @ np.linalg.inv(unchanged) @ x) / np.sqrt(np.linalg.det(unchanged))
    factor = float(with_change / without)
    assert probability(before, after, 0.5, RULES) == pytest.approx(factor / (1.0 + factor), abs=0.01)


@given(st.floats(0.0, 900.0), st.floats(30.0, 70.0), st.floats(-0.9, 0.9), st.sampled_from([None, 0.02]))
def test_equal_loads_are_no_change(kg: float, share_pct: float, correlation: float, left_m: float | None) -> None:
    one = load(kg, share_pct, left_m, correlation)
    assert probability(one, one, 0.5, RULES) < 0.1
    assert probability(one, one, ROLLING, RULES) < 0.001


@given(st.floats(-150.0, 150.0), st.floats(0.001, 0.999))
def test_more_prior_is_more_posterior(change_kg: float, prior: float) -> None:
    pair = load(300.0), load(300.0 + change_kg)
    assert probability(*pair, 0.5 * prior, RULES) <= probability(*pair, prior, RULES)
    assert probability(*pair, 1.0, RULES) == 1.0


def test_further_apart_is_more_probable() -> None:
    found = [probability(load(300.0), load(300.0 + kg), 0.5, RULES) for kg in (30.0, 45.0, 60.0, 120.0, 500.0)]
    assert found == sorted(found)
    assert found[-1] > 0.9999


def test_errors_that_go_together_are_not_taken_for_a_change() -> None:
    """Payload too high and share too high: what these errors usually do together, or never."""
    pair = [(load(300.0, 50.0, correlation=c), load(324.0, 50.9, correlation=c)) for c in (0.8, 0.0, -0.8)]
    usual, apart, never = (probability(*one, 0.5, RULES) for one in pair)
    assert usual < EVEN
    assert usual < apart < never
    assert never > 0.99


def test_a_common_cause_hides_no_change_and_makes_none() -> None:
    vague = load(300.0), load(340.0)
    alone = tuple(one.without(Source.CALIBRATION) for one in vague)
    assert probability(*vague, 0.5, RULES) == pytest.approx(probability(*alone, 0.5, RULES))


def test_a_load_that_was_moved_is_a_change_by_its_place() -> None:
    assert probability(load(300.0, 50.0), load(300.0, 47.0), 0.5, RULES) > 0.9
    assert probability(load(300.0, 50.0, 0.05), load(300.0, 50.0, -0.05), 0.5, RULES) > 0.9
    assert probability(load(300.0, 50.0, 0.05), load(300.0, 50.0), 0.5, RULES) < 0.1  # one does not know the place


def test_a_change_is_stated_with_the_error_of_two_different_loads() -> None:
    found = change_of(load(300.0), load(120.0))
    assert found.number == -180.0
    assert found.std == pytest.approx(np.hypot(8.0, 8.0))
    low, high = found.interval95
    assert (low + high) / 2.0 == pytest.approx(-180.0)


def test_rules_follow_from_the_vehicle() -> None:
    rules = Rules.of(
        Vehicle(name="van", empty_mass_kg=1240.0, wheelbase_m=2.8, sensor_position_m=0.0, payload_range_kg=(0.0, 450.0))
    )
    assert (rules.range_kg, rules.mass_kg, rules.spread_kg) == (450.0, 1465.0, 112.5)
    assert (
        Rules.of(
            Vehicle(
                name="van", empty_mass_kg=1240.0, wheelbase_m=2.8, sensor_position_m=0.0, payload_range_kg=(0.0, 1.0)
            )
        ).range_kg
        == 100.0
    )
