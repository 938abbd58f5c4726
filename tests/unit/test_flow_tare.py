"""The flow under a tare: what is weighed, when the load may have changed, and that frames alone decide the numbers."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from support.calibrated import calibration_file
from support.drives import drive, joined, later

from gateway.core.flow import Flow, Identity
from gateway.core.settings import BatchSettings
from gateway.core.tare import Tare, Zero
from gateway.estimate import Estimate, Lack
from gateway.estimate_json import estimate_to_json
from gateway.records import F64, Motion

SETTINGS = BatchSettings(window_s=20.0, provisional_every_s=10.0)
LONG = BatchSettings(window_s=100.0, provisional_every_s=60.0)  # an early look long enough to count
CALIBRATED = calibration_file(payload_kg=12.0, front_share_pct=51.0).for_core()
TARE = Tare("sha256:cd", CALIBRATED.id, "ratio_index", Zero(10.0, 3.0, 0.5, 0.1))


def flow(tare: Tare | None = None, settings: BatchSettings = SETTINGS) -> Flow:
    """Answers 12 kg and 51 % whatever is driven."""
    return Flow(settings, {}, CALIBRATED, "ratio_index", Identity("van-17"), tare)


def fed(one: Flow, motion: Motion) -> list[Estimate]:
    return list(one.feed(motion))


def standing_between(begin_s: float, end_s: float) -> Callable[[F64], F64]:
    """15 m/s but for one stop."""
    return lambda t_s: np.where((t_s >= begin_s) & (t_s < end_s), 0.0, 15.0)


def test_what_is_weighed_is_raw_and_names_the_batches_as_they_were_sent() -> None:
    tared = flow(TARE)
    shown = [found for found in fed(tared, drive(45.0)) if not found.is_provisional]
    assert [found.payload.number for found in shown] == [2.0, 2.0]
    assert shown[0].payload.std == pytest.approx(109.0**0.5)
    assert tared.weighed is not None
    assert tared.weighed.epoch.payload_kg.mean == 12.0
    assert tared.weighed.batch_ids == tuple(found.id for found in shown)
    assert tared.weighed.n_batches == 2


def test_early_looks_are_tared_too() -> None:
    early = [found for found in fed(flow(TARE, LONG), drive(105.0)) if found.is_provisional]
    assert early
    assert {found.payload.number for found in early} == {2.0}


def test_weights_are_those_of_the_tared_load_early_and_late() -> None:
    vehicle = replace(CALIBRATED.vehicle, unsprung_front_kg=90.0, unsprung_rear_kg=110.0)
    weighing = Flow(LONG, {}, replace(CALIBRATED, vehicle=vehicle), "ratio_index", Identity("van-17"), TARE)
    found = [one for one in fed(weighing, drive(105.0)) if one.counted]
    assert {one.is_provisional for one in found} == {True, False}
    assert {one.weights.gross.kg for one in found} == {vehicle.empty_mass_kg + 200.0 + 2.0}
    assert {one.weights.front_left.lacks for one in found} == {Lack.TRACK_WIDTH}


def test_a_rejected_batch_weighs_nothing_and_says_so() -> None:
    (found,) = [one for one in fed(flow(), drive(45.0, lambda t_s: np.full_like(t_s, 0.5))) if not one.is_provisional][
        :1
    ]
    assert found.rejected
    assert {weight.lacks for _, weight in found.weights.items()} == {Lack.ESTIMATE}


def test_a_tare_set_between_two_batches_counts_from_the_next() -> None:
    motion = drive(45.0)
    cut = int(np.searchsorted(motion.t_ns, motion.t_ns[0] + 25 * 10**9))
    one = flow()
    before = fed(one, motion.part(0, cut))
    one.tare = TARE
    after = fed(one, motion.part(cut, len(motion)))
    assert {found.payload.number for found in before if found.counted} == {12.0}
    assert {found.payload.number for found in after if found.counted} == {2.0}


def test_undone_the_numbers_are_the_very_same() -> None:
    motion = drive(45.0)
    tared = flow(TARE)
    tared.tare = None
    plain = [estimate_to_json(found) for found in fed(flow(), motion)]
    assert [estimate_to_json(found) for found in fed(tared, motion)] == plain


@pytest.mark.parametrize("n_chunks", [2, 7, 30])
def test_how_frames_are_chunked_leaves_no_trace_under_a_tare(n_chunks: int) -> None:
    motion = drive(65.0)
    whole = [estimate_to_json(found) for found in fed(flow(TARE), motion)]
    one = flow(TARE)
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
    assert one.weighed is not None
    assert one.weighed.n_batches == 1


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
    assert patient.weighed is not None
    assert patient.load_may_have_changed
    fed(patient, later(drive(120.0), 185.02))
    assert [patient.weighed.n_batches, patient.load_may_have_changed] == [1, False]


def test_a_batch_that_is_all_stop_leaves_the_load_open() -> None:
    """Standing does not end this drive; the batch is refused for it, and the load of the one before is not trusted."""
    patient = flow(settings=replace(SETTINGS, standstill_s=600.0, window_s=100.0, provisional_every_s=0.0))
    fed(patient, joined(drive(105.0), later(drive(100.0, standing_between(0.0, 90.0)), 105.01)))
    assert patient.weighed is not None
    assert patient.weighed.n_batches == 1
    assert patient.load_may_have_changed


def test_a_short_stop_is_still_the_same_load() -> None:
    one = flow()
    fed(one, drive(65.0, lambda t_s: np.where((t_s >= 41.0) & (t_s < 46.0), 0.0, 15.0)))
    assert not one.load_may_have_changed
