"""A stated weight: which load it is of, what it makes known, and refusals that say how to mend it."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.epochs import START_NS, WINDOW_NS, drive_of
from support.estimates import posterior_of

from gateway.calibration.known_weight import WeightRefusal, load_of
from gateway.core.change import Rules
from gateway.core.fusion import LoadEpoch, epoch_of, fused_epoch
from gateway.core.vehicle import Vehicle, front_share_pct
from gateway.core.weights.on_the_road import NOT_CALIBRATED, Unsprung, weights_of
from gateway.errors import RefusedError
from gateway.estimate import Estimate, Quantity
from gateway.estimate_json import estimate_from_json, estimate_to_json
from gateway.posterior import PAYLOAD, exactly
from gateway.records import Why
from gateway.service.verification.epochs import NEAR_NS, WeighedEpoch, epoch_at, epochs_of
from gateway.stated.facts import Drive, StatedWeight

AT = "2026-11-21T04:00:00Z"
VAN = Vehicle(
    name="van",
    empty_mass_kg=1240.0,
    wheelbase_m=2.8,
    empty_front_share_pct=52.0,
    sensor_position_m=0.0,
    unsprung_front_kg=80.0,
    unsprung_rear_kg=95.0,
)
BARE = Vehicle(name="van", empty_mass_kg=1240.0, wheelbase_m=2.8, empty_front_share_pct=52.0, sensor_position_m=0.0)


@given(payload_kg=st.floats(0.0, 1200.0), position_m=st.floats(0.3, 3.2))
def test_axle_weights_are_the_inverse_of_weights_on_the_road(payload_kg: float, position_m: float) -> None:
    share = front_share_pct(VAN, payload_kg, position_m)
    road = weights_of(VAN, exactly(payload_kg, share))
    known = load_of(
        StatedWeight(AT, front_axle_kg=road.front_axle.kg, rear_axle_kg=road.rear_axle.kg), VAN, NOT_CALIBRATED
    )
    assert known.payload_kg == pytest.approx(payload_kg, abs=1e-6)
    assert known.front_share_pct == pytest.approx(share, abs=1e-6)
    assert (known.gross_kg, known.front_axle_kg) == pytest.approx((road.gross.kg, road.front_axle.kg))
    by_gross = load_of(StatedWeight(AT, gross_kg=road.gross.kg), VAN, NOT_CALIBRATED)
    assert by_gross.payload_kg == pytest.approx(payload_kg, abs=1e-6)
    assert (by_gross.front_share_pct, by_gross.front_axle_kg) == (None, None)


def test_a_payload_needs_its_place_for_a_share_but_an_empty_vehicle_does_not() -> None:
    assert load_of(StatedWeight(AT, payload_kg=270.0), VAN, NOT_CALIBRATED).front_share_pct is None
    placed = load_of(StatedWeight(AT, payload_kg=270.0, position_m=1.4), VAN, NOT_CALIBRATED)
    assert placed.front_share_pct == pytest.approx(front_share_pct(VAN, 270.0, 1.4))
    assert load_of(StatedWeight(AT, payload_kg=0.0), VAN, NOT_CALIBRATED).front_share_pct == 52.0


def test_without_unsprung_masses_only_a_payload_is_known() -> None:
    known = load_of(StatedWeight(AT, payload_kg=100.0), BARE, NOT_CALIBRATED)
    assert (known.payload_kg, known.gross_kg, known.rear_axle_kg) == (100.0, None, None)
    for stated in (StatedWeight(AT, gross_kg=1500.0), StatedWeight(AT, front_axle_kg=700.0, rear_axle_kg=800.0)):
        with pytest.raises(RefusedError, match="state the payload instead") as refused:
            load_of(stated, BARE, NOT_CALIBRATED)
        assert refused.value.reason == WeightRefusal.NO_UNSPRUNG_MASS


def test_those_that_calibration_found_do() -> None:
    found = Unsprung(Quantity(80.0, 5.0), Quantity(95.0, 5.0), 0.3)
    assert load_of(StatedWeight(AT, gross_kg=1515.0), BARE, found).payload_kg == pytest.approx(100.0)


@pytest.mark.parametrize(
    ("stated", "why"),
    [
        (StatedWeight(AT, gross_kg=900.0), "another unit"),
        (StatedWeight(AT, gross_kg=40_000.0), "another vehicle's"),
        (StatedWeight(AT, front_axle_kg=1700.0, rear_axle_kg=100.0), "are axles or place mixed up"),
        (StatedWeight(AT, payload_kg=1000.0, position_m=9.0), "are axles or place mixed up"),
    ],
)
def test_what_cannot_be_is_refused_in_words(stated: StatedWeight, why: str) -> None:
    with pytest.raises(RefusedError, match=why) as refused:
        load_of(stated, VAN, NOT_CALIBRATED)
    assert refused.value.reason == WeightRefusal.IMPOSSIBLE_WEIGHT


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
    with pytest.raises(RefusedError) as caught:
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
