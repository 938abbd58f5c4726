"""Load epochs: fuse while the load is the same, begin anew when it is not."""

import math
from dataclasses import replace
from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.fusion import LoadEpoch, fields_of, fused
from gateway.records import Estimate, Why


def batch(payload_kg: float, share_pct: float = 50.0, std_kg: float = 10.0, n: int = 0) -> Estimate:
    return Estimate(
        t_start_ns=n,
        t_end_ns=n + 1,
        estimator="cross_spectrum",
        payload_kg=payload_kg,
        payload_std_kg=std_kg,
        front_share_pct=share_pct,
        front_share_std_pct=0.4,
    )


def epoch_of(*batches: Estimate) -> LoadEpoch | None:
    epoch = None
    for one in batches:
        epoch = fused(epoch, one)
    return epoch


def test_one_batch_is_its_own_epoch() -> None:
    assert fields_of(epoch_of(batch(270.0))) == {
        "payload_kg": 270.0,
        "payload_std_kg": pytest.approx(10.0),
        "front_share_pct": 50.0,
        "front_share_std_pct": pytest.approx(0.4),
        "n_batches": 1.0,
    }


def test_the_interval_shrinks_but_never_below_what_batches_share() -> None:
    stds = [fields_of(epoch_of(*[batch(270.0)] * n))["payload_std_kg"] for n in (1, 2, 5, 100)]
    assert stds == sorted(stds, reverse=True)
    assert stds[-1] > 10.0 * math.sqrt(0.5)


def drifted(payload_kg: float) -> Estimate:
    """Nearly all of its 10 kg is what the vehicle has changed since its calibration: every batch has that alike."""
    return replace(batch(payload_kg), diagnostics={"payload_drift_std_kg": 9.8})


def test_what_a_vehicle_has_changed_does_not_average_out() -> None:
    assert fields_of(epoch_of(*[drifted(270.0)] * 100))["payload_std_kg"] > 9.8
    assert fields_of(epoch_of(drifted(270.0)))["payload_std_kg"] == pytest.approx(10.0)


def test_what_a_vehicle_has_changed_hides_no_change_of_load() -> None:
    vague, drifting = (epoch_of(*map(kind, (270.0, 281.0))) for kind in (batch, drifted))
    assert vague is not None
    assert drifting is not None
    assert (vague.is_change, drifting.is_change) == (False, True)


@given(st.lists(st.floats(262.0, 278.0), min_size=1, max_size=8), st.randoms(use_true_random=False))
def test_order_does_not_matter_within_an_epoch(payloads_kg: list[float], random: Random) -> None:
    shuffled = payloads_kg.copy()
    random.shuffle(shuffled)
    one, other = (fields_of(epoch_of(*map(batch, order))) for order in (payloads_kg, shuffled))
    assert one["payload_kg"] == pytest.approx(other["payload_kg"])
    assert one["payload_kg"] == pytest.approx(np.mean(payloads_kg))


def test_surer_batches_count_for_more() -> None:
    epoch = epoch_of(batch(260.0, std_kg=10.0), batch(270.0, std_kg=5.0))
    assert fields_of(epoch)["payload_kg"] == pytest.approx(268.0)


def test_a_change_is_detected_not_averaged() -> None:
    epoch = epoch_of(batch(100.0), batch(104.0), batch(300.0, n=7))
    assert epoch is not None
    assert epoch.is_change
    assert epoch.t_start_ns == 7
    assert fields_of(epoch)["payload_kg"] == 300.0


def test_a_moved_load_is_a_change_too() -> None:
    epoch = epoch_of(batch(200.0, 50.0), batch(200.0, 46.0))
    assert epoch is not None
    assert epoch.is_change


def test_a_stop_opens_a_new_epoch_whatever_the_numbers() -> None:
    epoch = fused(epoch_of(batch(100.0)), batch(100.0), could_have_changed=True)
    assert fields_of(epoch)["n_batches"] == 1.0


@pytest.mark.parametrize(
    "silent",
    [
        Estimate(0, 1, "cross_spectrum", rejected=(Why.GAP,)),
        Estimate(0, 1, "cross_spectrum", payload_kg=5.0, payload_std_kg=1.0),
        Estimate(
            0,
            1,
            "cross_spectrum",
            payload_kg=5.0,
            payload_std_kg=1.0,
            front_share_pct=50.0,
            front_share_std_pct=1.0,
            is_provisional=True,
        ),
    ],
)
def test_what_says_nothing_leaves_the_epoch_unless_a_stop_ended_it(silent: Estimate) -> None:
    epoch = epoch_of(batch(100.0))
    assert fused(epoch, silent) == epoch
    assert fused(epoch, silent, could_have_changed=True) is None
    assert fields_of(None) == {}
