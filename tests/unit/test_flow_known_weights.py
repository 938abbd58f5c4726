"""The flow with known weights: what is weighed stays as measured, and frames alone decide the numbers."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from support.calibrated import calibration_file
from support.drives import drive, joined, later

from gateway.core.known_weights import Knowledge, Observation
from gateway.core.settings import BatchSettings
from gateway.estimate import Estimate, Lack
from gateway.estimate_json import estimate_to_json
from gateway.posterior import PAYLOAD, Posterior, Source
from gateway.records import F64, Motion
from gateway.weighing.flow import Flow, Identity

SETTINGS = BatchSettings(window_s=20.0, provisional_every_s=10.0)
LONG = BatchSettings(window_s=100.0, provisional_every_s=60.0)  # an early look long enough to count
CALIBRATED = calibration_file(payload_kg=12.0, front_share_pct=51.0).for_core()
SHARE_STD_PCT = CALIBRATED.vehicle.empty_front_share_std_pct


def known(calibration_id: str = CALIBRATED.id) -> Knowledge:
    """The empty vehicle, whose axles were weighed: the stated empty share is too high by most of what was found."""
    column = np.array([[0.0, SHARE_STD_PCT]])
    weighed = Posterior(np.array([0.0, 51.0]), np.diag([25.0, 0.01]), {Source.EMPTY_SHARE: column})
    axles = Observation("a", 0, calibration_id, "ratio_index", weighed, np.array([0.0, 50.5]), np.diag([9.0, 0.01]))
    knowledge = Knowledge.of([axles])
    assert knowledge is not None
    return knowledge


def flow(knowledge: Knowledge | None = None, settings: BatchSettings = SETTINGS) -> Flow:
    """Answers 12 kg and 51 % whatever is driven."""
    return Flow(settings, {}, CALIBRATED, "ratio_index", Identity("van-17"), knowledge)


def fed(one: Flow, motion: Motion) -> list[Estimate]:
    return list(one.feed(motion))


def standing_between(begin_s: float, end_s: float) -> Callable[[F64], F64]:
    """15 m/s but for one stop."""
    return lambda t_s: np.where((t_s >= begin_s) & (t_s < end_s), 0.0, 15.0)


def test_what_is_weighed_is_as_measured_and_names_the_batches_as_they_were_sent() -> None:
    knowing = flow(known())
    shown = [found for found in fed(knowing, drive(45.0)) if not found.is_provisional]
    assert len(shown) == 2
    moved = known().mean[0] * SHARE_STD_PCT * 1240.0 / 1252.0
    assert moved > 0.3
    for found in shown:
        assert found.front_share.number == pytest.approx(51.0 - moved)
        assert found.raw_front_share.number == pytest.approx(51.0)
        assert found.front_share.std < found.raw_front_share.std
        assert found.known_weights_id == known().id
        assert found.epoch.front_share.number == pytest.approx(51.0 - moved)
    assert knowing.weighed.epoch.posterior.mean.tolist() == pytest.approx([12.0, 51.0])
    assert knowing.weighed.batch_ids == tuple(found.id for found in shown)


def test_early_looks_take_known_weights_into_account_too() -> None:
    early = [found for found in fed(flow(known(), LONG), drive(105.0)) if found.is_provisional]
    assert early
    assert all(found.front_share.number < 50.7 for found in early)


def test_weights_and_the_budget_are_of_what_is_shown() -> None:
    vehicle = replace(CALIBRATED.vehicle, unsprung_front_kg=90.0, unsprung_rear_kg=110.0)
    weighing = Flow(LONG, {}, replace(CALIBRATED, vehicle=vehicle), "ratio_index", Identity("van-17"), known())
    found = [one for one in fed(weighing, drive(105.0)) if one.counted]
    assert {one.is_provisional for one in found} == {True, False}
    for one in found:
        assert one.weights.gross.kg == pytest.approx(vehicle.empty_mass_kg + 200.0 + 12.0)
        assert one.weights.front_axle.kg == pytest.approx(1252.0 * one.front_share.number / 100.0 + 90.0)
        assert one.weights.front_left.lacks is Lack.TRACK_WIDTH
        assert sum(line.payload_kg**2 for line in one.error_budget) == pytest.approx(one.posterior.std(PAYLOAD) ** 2)


def test_a_rejected_batch_weighs_nothing_and_says_so() -> None:
    crawling = drive(45.0, lambda t_s: np.full_like(t_s, 0.5))
    found = next(one for one in fed(flow(known()), crawling) if not one.is_provisional)
    assert found.rejected
    assert {weight.lacks for _, weight in found.weights.items()} == {Lack.ESTIMATE}
    assert (found.posterior, found.known_weights_id, found.error_budget) == (None, None, ())


def test_a_weight_made_known_between_two_batches_counts_from_the_next() -> None:
    motion = drive(45.0)
    cut = int(np.searchsorted(motion.t_ns, motion.t_ns[0] + 25 * 10**9))
    one = flow()
    before = fed(one, motion.part(0, cut))
    one.knowledge = known()
    after = fed(one, motion.part(cut, len(motion)))
    assert {found.known_weights_id for found in before if found.counted} == {None}
    assert {found.known_weights_id for found in after if found.counted} == {known().id}


def test_taken_back_or_of_another_calibration_the_numbers_are_the_very_same() -> None:
    motion = drive(45.0)
    plain = [estimate_to_json(found) for found in fed(flow(), motion)]
    back = flow(known())
    back.knowledge = None
    assert [estimate_to_json(found) for found in fed(back, motion)] == plain
    assert [estimate_to_json(found) for found in fed(flow(known("sha256:other")), motion)] == plain


@pytest.mark.parametrize("n_chunks", [2, 30])
def test_how_frames_are_chunked_leaves_no_trace(n_chunks: int) -> None:
    motion = drive(65.0)
    whole = [estimate_to_json(found) for found in fed(flow(known()), motion)]
    one = flow(known())
    bounds = np.linspace(0, len(motion), n_chunks + 1, dtype=int)
    pieces = [motion.part(a, b) for a, b in pairwise(bounds.tolist())]
    assert [estimate_to_json(found) for piece in pieces for found in one.feed(piece)] == whole


def test_parked_after_the_drive_the_weighing_stands() -> None:
    one = flow()
    assert not one.load_may_have_changed
    fed(one, drive(110.0, standing_between(45.0, 200.0)))
    assert one.scheduler.is_parked
    assert one.weighed is not None
    assert not one.load_may_have_changed


def test_once_it_drives_again_the_load_may_have_changed_until_a_batch_counts() -> None:
    one = flow()
    fed(one, drive(150.0, standing_between(45.0, 130.0)))
    assert one.load_may_have_changed
    fed(one, later(drive(15.0), 150.01))
    assert not one.load_may_have_changed
    assert one.weighed.epoch.n_batches == 1


def test_after_silence_the_next_drive_may_be_another_load() -> None:
    one = flow()
    fed(one, drive(45.0))
    assert not one.load_may_have_changed
    fed(one, later(drive(5.0), 3600.0))
    assert one.load_may_have_changed


def test_a_long_stop_within_a_drive_is_seen_in_the_window_that_is_still_open() -> None:
    """Where standing does not end the drive: an early look tells of the stop before the batch does."""
    patient = flow(settings=replace(SETTINGS, standstill_s=600.0, window_s=100.0))
    fed(patient, joined(drive(105.0), later(drive(80.0, standing_between(2.0, 66.0)), 105.01)))
    assert patient.load_may_have_changed
    fed(patient, later(drive(120.0), 185.02))
    assert [patient.weighed.epoch.n_batches, patient.load_may_have_changed] == [1, False]


def test_a_batch_that_is_all_stop_leaves_the_load_open() -> None:
    """Standing does not end this drive; the batch is refused for it, and the load of the one before is not trusted."""
    patient = flow(settings=replace(SETTINGS, standstill_s=600.0, window_s=100.0, provisional_every_s=0.0))
    fed(patient, joined(drive(105.0), later(drive(100.0, standing_between(0.0, 90.0)), 105.01)))
    assert patient.weighed.epoch.n_batches == 1
    assert patient.load_may_have_changed


def test_a_short_stop_is_still_the_same_load() -> None:
    one = flow()
    fed(one, drive(65.0, lambda t_s: np.where((t_s >= 41.0) & (t_s < 46.0), 0.0, 15.0)))
    assert not one.load_may_have_changed


def test_the_stated_empty_share_widens_what_is_shown_and_no_epoch_counts_it_twice() -> None:
    stds, own = [], []
    for std_pct in (0.01, 0.8):
        vehicle = replace(CALIBRATED.vehicle, empty_front_share_std_pct=std_pct)
        one = Flow(SETTINGS, {}, replace(CALIBRATED, vehicle=vehicle), "ratio_index", Identity())
        last = [found for found in fed(one, drive(45.0)) if found.counted][-1]
        stds.append(last.front_share.std)
        own.append(one.weighed.epoch.posterior.own)
    assert stds[1] ** 2 - stds[0] ** 2 == pytest.approx((0.64 - 0.0001) * (1240.0 / 1252.0) ** 2)
    assert np.array_equal(own[0], own[1])
