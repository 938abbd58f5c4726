"""Batches depend on the rows and their order alone, never on how the rows were chunked."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.drives import assert_same_batch, drive, joined, later, steady, with_journey, with_roll, without_rows

from gateway.core.batch_settings import BatchSettings
from gateway.core.scheduler import Scheduler
from gateway.records import Batch, Motion, Why
from gateway.units import NS_PER_S

RATE_HZ = 50.0


def with_standstill() -> Motion:
    return drive(200.0, lambda t_s: np.where((t_s > 50.0) & (t_s < 125.0), 0.0, 14.0), RATE_HZ)


def with_silence() -> Motion:
    return without_rows(without_rows(drive(120.0, None, RATE_HZ), 33.0, 45.0), 70.0, 79.0)


def with_clock_step_back() -> Motion:
    return joined(drive(50.0, None, RATE_HZ, seed=2), later(drive(50.0, None, RATE_HZ, seed=3), 20.0))


def with_rows_out_of_order() -> Motion:
    straight = drive(90.0, steady(12.0), RATE_HZ)
    arrival = np.argsort(straight.t_ns + np.random.default_rng(4).integers(0, 300_000_000, len(straight)))
    return Motion(straight.signals, straight.t_ns[arrival], straight.columns[arrival])


def with_all_of_it() -> Motion:
    parts = [with_standstill(), with_silence(), with_clock_step_back(), with_rows_out_of_order()]
    return joined(*(later(part, 150.0 * i) for i, part in enumerate(parts)))


DRIVES = {
    made.__name__: made()
    for made in (with_standstill, with_silence, with_clock_step_back, with_rows_out_of_order, with_all_of_it)
}


def batches_of(motion: Motion, cuts: list[int], provisional_every_s: float) -> tuple[list[Batch], int]:
    scheduler = Scheduler(BatchSettings(window_s=20.0, provisional_every_s=provisional_every_s), {})
    edges = [0, *sorted(cuts), len(motion)]
    batches = [batch for a, b in itertools.pairwise(edges) for batch in scheduler.feed(motion.part(a, b))]
    return [*batches, *scheduler.flush()], scheduler.n_late_rows


WHOLE = {(name, every_s): batches_of(motion, [], every_s) for name, motion in DRIVES.items() for every_s in (0.0, 7.0)}


def test_a_silence_ends_a_drive_like_the_next_row():
    motion = DRIVES["with_silence"]
    begin_s = (motion.t_ns - motion.t_ns[0]) / NS_PER_S
    before = int(np.searchsorted(begin_s, 40.0))
    scheduler = Scheduler(BatchSettings(window_s=20.0, provisional_every_s=7.0), {})
    found = [*scheduler.feed(motion.part(0, before)), *scheduler.flush(Why.GAP), *scheduler.flush(Why.GAP)]
    found += [*scheduler.feed(motion.part(before, len(motion))), *scheduler.flush()]
    for one, other in zip(found, WHOLE["with_silence", 7.0][0], strict=True):
        assert_same_batch(one, other)


@pytest.mark.parametrize("provisional_every_s", [0.0, 7.0])
@pytest.mark.parametrize("name", DRIVES)
@settings(max_examples=5, derandomize=True)
@given(share_cuts=st.lists(st.floats(0.0, 1.0), max_size=40))
def test_chunks_do_not_matter(name: str, provisional_every_s: float, share_cuts: list[float]) -> None:
    motion = DRIVES[name]
    whole, n_late = WHOLE[name, provisional_every_s]
    chunked, n_late_chunked = batches_of(motion, [round(x * len(motion)) for x in share_cuts], provisional_every_s)
    assert len(whole) > 2
    assert len(chunked) == len(whole)
    assert n_late_chunked == n_late
    for one, other in zip(whole, chunked, strict=True):
        assert_same_batch(one, other)


@pytest.mark.parametrize("name", DRIVES)
def test_chunks_of_a_few_rows_do_not_matter(name: str) -> None:
    motion = DRIVES[name].part(0, 4000)
    whole, _ = batches_of(motion, [], 0.0)
    chunked, _ = batches_of(motion, list(range(0, len(motion), 3)), 0.0)
    for one, other in zip(whole, chunked, strict=True):
        assert_same_batch(one, other)


@pytest.mark.parametrize("provisional_every_s", [0.0, 7.0])
@pytest.mark.parametrize("name", DRIVES)
@settings(max_examples=3, derandomize=True)
@given(share_cuts=st.lists(st.floats(0.0, 1.0), max_size=20))
def test_frames_of_a_roll_rate_alone_change_no_other_number(
    name: str, provisional_every_s: float, share_cuts: list[float]
) -> None:
    rolling = with_roll(DRIVES[name])
    batches, _ = batches_of(rolling, [round(x * len(rolling)) for x in share_cuts], provisional_every_s)
    whole, _ = WHOLE[name, provisional_every_s]
    assert len(batches) == len(whole)
    for one, other in zip(whole, batches, strict=True):
        assert other.roll_rate_radps is not None
        assert_same_batch(one, replace(other, roll_rate_radps=None))


@pytest.mark.parametrize(("name", "rolls"), [*((name, False) for name in DRIVES), ("with_all_of_it", True)])
@settings(max_examples=3, derandomize=True)
@given(share_cuts=st.lists(st.floats(0.0, 1.0), max_size=20))
def test_frames_aside_change_no_batch(name: str, rolls: bool, share_cuts: list[float]) -> None:
    motion = with_roll(DRIVES[name]) if rolls else DRIVES[name]
    whole, n_late = batches_of(motion, [], 7.0)
    journey = with_journey(motion)
    batches, n_late_beside = batches_of(journey, [round(x * len(journey)) for x in share_cuts], 7.0)
    assert n_late_beside == n_late
    assert len(batches) == len(whole)
    for one, other in zip(whole, batches, strict=True):
        assert_same_batch(one, other)


@pytest.mark.parametrize("name", DRIVES)
def test_windows_of_a_drive_follow_one_another(name: str) -> None:
    batches, _ = WHOLE[name, 0.0]
    for one, following in itertools.pairwise(batches):
        if following.drive_start_ns == one.drive_start_ns:
            assert following.t_start_ns == one.t_end_ns
        else:
            assert following.t_start_ns == following.drive_start_ns
        assert one.t_end_ns - one.t_start_ns <= 20_000_000_000


def test_a_provisional_look_changes_no_final_batch() -> None:
    for name in DRIVES:
        final = [batch for batch in WHOLE[name, 7.0][0] if not batch.is_provisional]
        for one, other in zip(WHOLE[name, 0.0][0], final, strict=True):
            assert_same_batch(one, other)
