"""Load epochs: fuse while the load is the same, begin anew when it is not."""

import math
from dataclasses import replace
from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.fusion import LoadEpoch, found_of, fused, summary
from gateway.estimate import Estimate, Quantity
from gateway.records import Why


def batch(payload_kg: float, share_pct: float = 50.0, std_kg: float = 10.0, n: int = 0) -> Estimate:
    return Estimate(
        t_start_ns=n,
        t_end_ns=n + 1,
        estimator="cross_spectrum",
        payload=Quantity(payload_kg, std_kg),
        front_share=Quantity(share_pct, 0.4),
    )


def epoch_of(*batches: Estimate) -> LoadEpoch | None:
    epoch = None
    for one in batches:
        epoch = fused(epoch, one)
    return epoch


def test_one_batch_is_its_own_epoch() -> None:
    epoch = summary(epoch_of(batch(270.0)))
    assert (epoch.payload.number, epoch.front_share.number, epoch.n_batches) == (270.0, 50.0, 1)
    assert (epoch.payload.std, epoch.front_share.std) == pytest.approx((10.0, 0.4))


def test_the_interval_shrinks_but_never_below_what_batches_share() -> None:
    stds = [summary(epoch_of(*[batch(270.0)] * n)).payload.std for n in (1, 2, 5, 100)]
    assert stds == sorted(stds, reverse=True)
    assert stds[-1] > 10.0 * math.sqrt(0.5)


def drifted(payload_kg: float) -> Estimate:
    """Most of its 10 kg is what the vehicle has changed since its calibration: every batch has that alike."""
    return replace(batch(payload_kg), diagnostics={"payload_own_std_kg": 2.0})


def test_what_a_vehicle_has_changed_does_not_average_out() -> None:
    assert summary(epoch_of(*[drifted(270.0)] * 100)).payload.std > 10.0 * math.sqrt(0.75)
    assert summary(epoch_of(drifted(270.0))).payload.std == pytest.approx(10.0)


@pytest.mark.parametrize(("own_kg", "own_var"), [(None, 50.0), (8.0, 64.0), (0.01, 25.0), (20.0, 100.0)])
def test_what_is_a_batchs_own_is_a_quarter_of_its_variance_at_least_and_all_of_it_at_most(
    own_kg: float | None, own_var: float
) -> None:
    one = replace(batch(270.0), diagnostics={} if own_kg is None else {"payload_own_std_kg": own_kg})
    found = found_of(one, one.payload, "payload_own_std_kg")
    assert (found.own_var, found.shared_var) == pytest.approx((own_var, 100.0 - own_var))


def test_what_a_vehicle_has_changed_hides_no_change_of_load() -> None:
    vague, drifting = (epoch_of(*map(kind, (270.0, 297.0))) for kind in (batch, drifted))
    assert vague is not None
    assert drifting is not None
    assert (vague.is_change, drifting.is_change) == (False, True)


@given(st.lists(st.floats(262.0, 278.0), min_size=1, max_size=8), st.randoms(use_true_random=False))
def test_order_does_not_matter_within_an_epoch(payloads_kg: list[float], random: Random) -> None:
    shuffled = payloads_kg.copy()
    random.shuffle(shuffled)
    one, other = (summary(epoch_of(*map(batch, order))) for order in (payloads_kg, shuffled))
    assert one.payload.number == pytest.approx(other.payload.number)
    assert one.payload.number == pytest.approx(np.mean(payloads_kg))


def test_surer_batches_count_for_more() -> None:
    epoch = epoch_of(batch(260.0, std_kg=10.0), batch(270.0, std_kg=5.0))
    assert summary(epoch).payload.number == pytest.approx(268.0)


def test_a_change_is_detected_not_averaged() -> None:
    epoch = epoch_of(batch(100.0), batch(104.0), batch(300.0, n=7))
    assert epoch is not None
    assert epoch.is_change
    assert epoch.t_start_ns == 7
    assert summary(epoch).payload.number == 300.0


def test_a_moved_load_is_a_change_too() -> None:
    epoch = epoch_of(batch(200.0, 50.0), batch(200.0, 46.0))
    assert epoch is not None
    assert epoch.is_change


def test_a_stop_opens_a_new_epoch_whatever_the_numbers() -> None:
    epoch = fused(epoch_of(batch(100.0)), batch(100.0), could_have_changed=True)
    assert summary(epoch).n_batches == 1


@pytest.mark.parametrize(
    "silent",
    [
        Estimate(0, 1, "cross_spectrum", rejected=(Why.GAP,)),
        Estimate(0, 1, "cross_spectrum", payload=Quantity(5.0, 1.0)),
        Estimate(
            0,
            1,
            "cross_spectrum",
            payload=Quantity(5.0, 1.0),
            front_share=Quantity(50.0, 1.0),
            is_provisional=True,
        ),
    ],
)
def test_what_says_nothing_leaves_the_epoch_unless_a_stop_ended_it(silent: Estimate) -> None:
    epoch = epoch_of(batch(100.0))
    assert fused(epoch, silent) == epoch
    assert fused(epoch, silent, could_have_changed=True) is None
    assert summary(None) is None


def aside(left_m: float, std_m: float = 0.006, payload_kg: float = 270.0) -> Estimate:
    return replace(batch(payload_kg), cg_left=Quantity(left_m, std_m))


def test_the_place_across_is_fused_of_the_batches_that_tell_it() -> None:
    told = summary(epoch_of(aside(0.020), batch(270.0), aside(0.026)))
    assert told.n_batches == 3
    assert told.cg_left.number == pytest.approx(0.023)
    assert told.cg_left.std == pytest.approx(0.006 * math.sqrt(0.75))


def test_without_a_word_of_it_the_place_across_is_unknown() -> None:
    told = summary(epoch_of(batch(270.0), batch(271.0)))
    assert math.isnan(told.cg_left.number)
    assert math.isnan(told.cg_left.std)


def test_a_load_moved_sideways_opens_a_new_epoch() -> None:
    epoch = epoch_of(aside(0.05), aside(0.05), aside(-0.05))
    assert epoch is not None
    assert epoch.is_change
    assert summary(epoch).cg_left.number == -0.05
    assert summary(epoch).n_batches == 1


def test_two_quantities_and_three_raise_one_false_alarm_in_a_thousand() -> None:
    """Batches of one load, a draw in 20 000 at a time, about an epoch that is known for sure."""
    rng = np.random.default_rng(5)
    own = {"payload_own_std_kg": 10.0, "front_share_own_std_pct": 0.4, "cg_left_own_std_m": 0.006}
    known = replace(batch(270.0, std_kg=1e-6), cg_left=Quantity(0.0, 1e-9), front_share=Quantity(50.0, 1e-9))
    for is_aside in (False, True):
        begun = fused(None, known if is_aside else replace(known, cg_left=Quantity()))
        alarms = 0
        for kg, pct, m in rng.standard_normal((20_000, 3)) * [10.0, 0.4, 0.006] + [270.0, 50.0, 0.0]:
            one = replace(batch(kg, pct), cg_left=Quantity(m, 0.006), diagnostics=own)
            alarms += fused(begun, one).is_change
        assert 8 <= alarms <= 34
