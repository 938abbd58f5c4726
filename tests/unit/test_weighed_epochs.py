"""Which load a stated weight is of: epochs from what the store has, and the one of a time."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.epochs import START_NS, WINDOW_NS, drive_of
from support.estimates import posterior_of

from gateway.calibration.known_weight import WeightRefusal
from gateway.core.change import Rules
from gateway.core.fusion import LoadEpoch, epoch_of, fused_epoch
from gateway.errors import WeightRefusedError
from gateway.estimate import Estimate
from gateway.estimate_json import estimate_from_json, estimate_to_json
from gateway.posterior import PAYLOAD
from gateway.records import Why
from gateway.service.verification.epochs import NEAR_NS, WeighedEpoch, epoch_at, epochs_of
from gateway.stated.facts import Drive

HOUR_NS = 3_600_000_000_000
FIRST = drive_of(3, 100.0)
SECOND = drive_of(2, 300.0, start_ns=START_NS + 2 * HOUR_NS)


@given(
    batches=st.lists(
        st.tuples(st.sampled_from([0.0, 200.0, 450.0]), st.booleans(), st.sampled_from(["counts", "rejected"])),
        max_size=12,
    )
)
def test_epochs_are_those_that_fusion_made(batches: list[tuple[float, bool, str]]) -> None:
    """Whatever jumps, stops and rejections there were between them."""
    epoch: LoadEpoch | None = None
    truth: list[tuple[int, int, float]] = []  # start, batches, payload
    shown = []
    for n, (payload_kg, is_stop, outcome) in enumerate(batches):
        batch = Estimate(
            t_start_ns=START_NS + n * WINDOW_NS,
            t_end_ns=START_NS + (n + 1) * WINDOW_NS,
            estimator="ratio_index",
        ).answered(posterior_of(payload_kg, 50.0, 5.0, 0.3))
        batch = batch if outcome == "counts" else batch.refused(Why.GAP)
        epoch = fused_epoch(epoch, batch, Rules(), is_stop)
        if outcome == "counts":
            assert epoch is not None
            told = (epoch.t_start_ns, epoch.n_batches, float(epoch.posterior.mean[PAYLOAD]))
            truth = [*truth[:-1], told] if truth and truth[-1][0] == told[0] else [*truth, told]
            batch = replace(batch, epoch=epoch_of(epoch.posterior, epoch.n_batches))
        shown.append(estimate_from_json(estimate_to_json(batch)))
    found = [(one.t_start_ns, one.n_batches, one.payload.number) for one in epochs_of(shown)]
    assert [one[:2] for one in found] == [one[:2] for one in truth]
    assert [one[2] for one in found] == pytest.approx([one[2] for one in truth], abs=1e-3)


def test_another_calibration_is_another_epoch() -> None:
    first, second = FIRST[0], replace(FIRST[1], calibration_id="sha256:other")
    assert [epoch.n_batches for epoch in epochs_of([first, second])] == [1, 2]


def at(t_ns: int, drive: Drive | None = None) -> WeighedEpoch:
    return epoch_at(epochs_of([*FIRST, *SECOND]), t_ns, drive)


def refused(t_ns: int, drive: Drive | None = None) -> str:
    with pytest.raises(WeightRefusedError) as caught:
        at(t_ns, drive)
    return caught.value.reason


def test_within_a_drive_there_is_no_doubt() -> None:
    for drive in (None, Drive.BEFORE, Drive.AFTER):
        assert at(FIRST[1].t_start_ns + 1, drive).payload.number == 100.0


def test_between_two_somebody_must_say_which() -> None:
    between_ns = START_NS + HOUR_NS
    assert refused(between_ns) == WeightRefusal.AMBIGUOUS_EPOCH
    assert at(between_ns, Drive.BEFORE).payload.number == 100.0
    assert at(between_ns, Drive.AFTER).payload.number == 300.0


def test_beside_one_alone_it_is_that_one() -> None:
    assert at(START_NS - HOUR_NS).payload.number == 100.0
    assert at(SECOND[-1].t_end_ns + HOUR_NS).payload.number == 300.0


def test_far_from_every_drive_there_is_none() -> None:
    assert refused(START_NS - NEAR_NS - 1) == WeightRefusal.NO_EPOCH
    assert refused(START_NS - HOUR_NS, Drive.BEFORE) == WeightRefusal.NO_EPOCH
    assert refused(SECOND[-1].t_end_ns + HOUR_NS, Drive.AFTER) == WeightRefusal.NO_EPOCH
