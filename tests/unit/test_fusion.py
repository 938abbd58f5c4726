"""Load epochs: fused while the load is the same; the detector of changes held against brute force."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.change import EVEN, ROLLING, Rules, probability
from gateway.core.fusion import LoadEpoch, fused_epoch
from gateway.estimates.batch_estimate import Estimate, Quantity
from gateway.estimates.posterior import PAYLOAD, Posterior, Source, difference
from gateway.records import Why

RULES = Rules(range_kg=1000.0, mass_kg=2000.0)
SHARED_KG = 12.0


def batch(
    payload_kg: float, share_pct: float = 50.0, own_kg: float = 8.0, n: int = 0, left_m: float | None = None
) -> Estimate:
    mean = [payload_kg, share_pct, *([] if left_m is None else [left_m])]
    own = np.diag(np.square([own_kg, 0.3, 0.004])[: len(mean)])
    shared = np.zeros((1, len(mean)))
    shared[0, PAYLOAD] = SHARED_KG
    posterior = Posterior(np.array(mean), own, {Source.CALIBRATION: shared})
    return Estimate(n, n + 1, "cross_spectrum").answered(posterior)


def together(*batches: Estimate) -> LoadEpoch:
    epoch = None
    for one in batches:
        epoch = fused_epoch(epoch, one, RULES)
    assert epoch is not None
    return epoch


def test_a_change_is_detected_not_averaged() -> None:
    epoch = together(batch(100.0), batch(104.0), batch(300.0, n=7))
    assert (epoch.is_change, epoch.t_start_ns, epoch.posterior.mean[PAYLOAD]) == (True, 7, 300.0)


def test_a_shared_error_hides_no_change() -> None:
    """60 kg are 2.5 standard deviations of two batches, and 5 of what is their own."""
    assert together(batch(200.0), batch(260.0)).is_change
    assert not together(batch(200.0), batch(260.0, own_kg=24.0)).is_change


def test_a_moved_load_is_a_change_too() -> None:
    assert together(batch(200.0, 50.0), batch(200.0, 46.0)).is_change
    assert together(batch(270.0, left_m=0.05), batch(270.0, left_m=-0.05)).is_change
    assert not together(batch(270.0, left_m=0.05), batch(270.0)).is_change  # one does not know the place


def test_a_stop_opens_a_new_epoch_whatever_the_numbers() -> None:
    epoch = fused_epoch(together(batch(100.0)), batch(100.0, n=5), RULES, could_have_changed=True)
    assert (epoch.n_batches, epoch.t_start_ns, epoch.is_change) == (1, 5, False)


@pytest.mark.parametrize(
    "silent",
    [
        Estimate(0, 1, "cross_spectrum", rejected=(Why.GAP,)),
        Estimate(0, 1, "cross_spectrum", payload=Quantity(5.0, 1.0)),
        Estimate(0, 1, "cross_spectrum").answered(Posterior(np.array([5.0]), np.eye(1))),
        replace(batch(5.0), is_provisional=True),
    ],
    ids=["rejected", "no posterior", "payload alone", "early look"],
)
def test_a_batch_without_an_answer_keeps_the_epoch_unless_the_load_could_have_changed(silent: Estimate) -> None:
    epoch = together(batch(100.0))
    assert fused_epoch(epoch, silent, RULES) is epoch
    assert fused_epoch(epoch, silent, RULES, could_have_changed=True) is None


def test_batches_of_one_load_hardly_ever_look_like_two() -> None:
    """A change without a stop is believed to happen once in a thousand pairs of batches; chance invents fewer."""
    rng = np.random.default_rng(5)
    drawn = rng.standard_normal((4000, 2, 3)) * [8.0, 0.3, 0.004] + [270.0, 50.0, 0.0]
    for size in (2, 3):
        changes = 0
        for pair in drawn:
            one, other = (batch(kg, pct, left_m=left_m if size == 3 else None) for kg, pct, left_m in pair)
            changes += together(one, other).is_change
        assert changes <= 4


def load(kg: float, share_pct: float = 50.0, left_m: float | None = None, correlation: float = 0.0) -> Posterior:
    """Own errors of 8 kg and 0.3 % with this correlation, common ones of 15 kg."""
    mean = np.array([kg, share_pct, *([] if left_m is None else [left_m])])
    own = np.diag(np.square([8.0, 0.3, 0.005])[: len(mean)])
    own[0, 1] = own[1, 0] = correlation * 8.0 * 0.3
    return Posterior(mean, own, {Source.CALIBRATION: np.array([[15.0, 0.2, 0.01][: len(mean)]])})


def test_the_probability_of_a_change_follows_bayes_theorem() -> None:
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
    for prior in (0.0, 0.05, 0.5, 0.95, 1.0):
        expected = prior * factor / (prior * factor + 1.0 - prior)
        assert probability(before, after, prior, RULES) == pytest.approx(expected, abs=0.01)
    assert (probability(before, after, 0.0, RULES), probability(before, before, 1.0, RULES)) == (0.0, 1.0)


@given(st.floats(0.0, 900.0), st.floats(30.0, 70.0), st.floats(-0.9, 0.9), st.sampled_from([None, 0.02]))
def test_equal_loads_are_no_change(kg: float, share_pct: float, correlation: float, left_m: float | None) -> None:
    one = load(kg, share_pct, left_m, correlation)
    assert probability(one, one, 0.5, RULES) < 0.1
    assert probability(one, one, ROLLING, RULES) < 0.001


def test_errors_that_go_together_are_not_taken_for_a_change() -> None:
    """Payload too high and share too high: what these errors usually do together, or never."""
    pair = [(load(300.0, 50.0, correlation=c), load(324.0, 50.9, correlation=c)) for c in (0.8, 0.0, -0.8)]
    usual, apart, never = (probability(*one, 0.5, RULES) for one in pair)
    assert usual < EVEN
    assert usual < apart < never
    assert never > 0.99
