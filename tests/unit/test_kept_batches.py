"""Batches kept for calibrations to come: bit for bit what they were, bounded, whole whenever the power fails."""

import threading
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from gateway.calibration.kept.shelf import Shelf, ShelfLimits
from gateway.service.keeper import MOST_WAITING, BatchKeeper
from pydantic import TypeAdapter
from support.bus_drive import bus_drive
from support.known_load_logs import write_known_loads
from support.log import names
from support.patience import PATIENCE_S
from support.power import KilledError, kill_at

from gateway.bus.signals import Decoder, load_signal_map
from gateway.calibration.calibrate import calibrate_inspected
from gateway.calibration.campaign import load_campaign
from gateway.calibration.inspection.rows import row_facts
from gateway.calibration.kept.batch_file import KeptBatch, kept_batch_of, packed, unpacked
from gateway.calibration.kept.drive import inspect_kept, split_run_of
from gateway.calibration.known_run import KnownRun
from gateway.core.settings import BatchSettings
from gateway.errors import KeptBatchError
from gateway.estimate import Estimate
from gateway.log import Event
from gateway.model.vehicle import VehicleModel
from gateway.offline.campaigns import calibrate, read_whole_log
from gateway.records import Batch, Motion, Why
from gateway.weighing.flow import Flow, Identity

MAP = load_signal_map("springscale:reference")
SETTINGS = BatchSettings(window_s=20.0)
EMPTY = ((0.0, None),)


def driven(duration_s: float) -> Motion:
    return Decoder(MAP).decode(bus_drive(duration_s, seed=1))


def weighed(keeper: BatchKeeper, motion: Motion) -> Iterator[Estimate]:
    """As a service does whose batches the keeper keeps."""
    flow = Flow(SETTINGS, MAP.traits, None, "cross_spectrum", Identity("van-17"))
    flow.on_batch = keeper.keep
    return flow.feed(motion)


def kept_of(motion: Motion, settings: BatchSettings = SETTINGS) -> list[KeptBatch]:
    """What a service of these settings would keep of the rows."""
    found: list[KeptBatch] = []
    flow = Flow(settings, MAP.traits, None, "cross_spectrum", Identity("van-17"))

    def keep(batch: Batch, estimate: Estimate, rows: Motion) -> None:
        if not batch.rejected:
            found.append(kept_batch_of(estimate.id, MAP.id, batch, rows, MAP.traits))

    flow.on_batch = keep
    list(flow.feed(motion))
    list(flow.flush())
    return found


@pytest.fixture(scope="module")
def three() -> list[KeptBatch]:
    return kept_of(driven(65.0))[:3]


def assert_same_batch(one: Batch, other: Batch) -> None:
    for field in fields(Batch):
        mine, its = getattr(one, field.name), getattr(other, field.name)
        if isinstance(mine, np.ndarray):
            assert mine.tobytes() == its.tobytes(), field.name
        else:
            assert mine == its, field.name


def test_a_batch_comes_back_bit_for_bit(three: list[KeptBatch]) -> None:
    for kept in three:
        same = unpacked(packed(kept))
        assert (same.id, same.signals_id) == (kept.id, MAP.id)
        assert same.facts == kept.facts
        assert_same_batch(same.batch, kept.batch)


def test_a_batch_with_a_roll_rate_and_unknown_numbers_comes_back_too(three: list[KeptBatch]) -> None:
    n = len(three[0].batch.usable)
    roll = np.where(np.arange(n) % 7 == 0, np.nan, np.sin(np.arange(n)))
    odd = replace(three[0].batch, roll_rate_radps=roll, gravity_mps2=np.nan, rejected=(Why.GAP,), shares={Why.GAP: 0.5})
    same = unpacked(packed(replace(three[0], batch=odd))).batch
    assert np.isnan(same.gravity_mps2)
    assert_same_batch(replace(same, gravity_mps2=0.0), replace(odd, gravity_mps2=0.0))


def test_facts_are_of_the_window_alone(three: list[KeptBatch]) -> None:
    motion = driven(65.0)
    begin = int(motion.t_ns[0])
    window = motion.rows((motion.t_ns >= begin) & (motion.t_ns < begin + 20 * 10**9))
    assert three[0].facts == row_facts(window, MAP.traits)


def test_one_flipped_bit_is_told(three: list[KeptBatch]) -> None:
    content = bytearray(packed(three[0]))
    for at in (3, 400, len(content) // 2, len(content) - 1):
        damaged = content.copy()
        damaged[at] ^= 4
        with pytest.raises(KeptBatchError, match="damaged"):
            unpacked(bytes(damaged))
    with pytest.raises(KeptBatchError):
        unpacked(b"")


def test_a_fit_from_kept_batches_is_the_fit_from_the_logs_bit_for_bit(tmp_path: Path) -> None:
    path = write_known_loads(tmp_path, EMPTY, duration_s=200.0, identification_fraction=1.0)
    campaign, settings = load_campaign(path), BatchSettings(window_s=100.0)
    from_log = calibrate(campaign, settings, estimators=("cross_spectrum",)).file

    motion, _ = read_whole_log(campaign.log_of(campaign.runs[0]), load_signal_map(campaign.signals))
    shelf = Shelf(tmp_path / "batches", ShelfLimits())
    for one in kept_of(motion, settings):
        shelf.add(one)
    again = Shelf(tmp_path / "batches", ShelfLimits())  # as after a restart
    kept = tuple(again.read(entry.id) for entry in again.entries())
    drive = split_run_of(KnownRun(1, "01.log", 0.0, campaign.front_share_pct(campaign.runs[0]), ()), kept)
    inspection = inspect_kept(campaign, (drive,), settings)
    from_kept = calibrate_inspected(campaign, inspection, estimators=("cross_spectrum",)).file

    assert len(kept) == 2
    assert from_kept.cross_spectrum is not None
    assert exact(from_kept.cross_spectrum) == exact(from_log.cross_spectrum)
    assert from_kept.seen == from_log.seen
    assert from_kept.warnings == from_log.warnings


def exact(calibration: VehicleModel | None) -> bytes:
    return TypeAdapter(VehicleModel | None).dump_json(calibration)


def test_the_shelf_is_bounded_in_count_and_the_oldest_gives_way(tmp_path: Path, three: list[KeptBatch]) -> None:
    shelf = Shelf(tmp_path, ShelfLimits(most_batches=2))
    assert [shelf.add(one) for one in three] == [True] * 3
    assert [entry.id for entry in shelf.entries()] == [one.id for one in three[1:]]
    assert len(list(tmp_path.glob("*.batch"))) == 2
    assert not shelf.add(three[2])  # it is there
    with pytest.raises(KeyError):
        shelf.read(three[0].id)


def test_the_shelf_is_bounded_in_bytes(tmp_path: Path, three: list[KeptBatch]) -> None:
    one = len(packed(three[0]))
    shelf = Shelf(tmp_path, ShelfLimits(most_bytes=2 * one + one // 2))
    for kept in three:
        assert shelf.add(kept)
    assert [entry.id for entry in shelf.entries()] == [kept.id for kept in three[1:]]
    assert sum(entry.n_bytes for entry in shelf.entries()) <= 2 * one + one // 2
    assert not Shelf(tmp_path / "small", ShelfLimits(most_bytes=one // 2)).add(three[0])
    assert not Shelf(tmp_path / "none", ShelfLimits(most_batches=0)).add(three[0])


def test_what_somebody_holds_stays_until_it_is_let_go(tmp_path: Path, three: list[KeptBatch]) -> None:
    shelf = Shelf(tmp_path, ShelfLimits(most_batches=2))
    shelf.add(three[0])
    assert shelf.hold("ticket-1", [three[0].id, "1-000000000000"])
    for one in three[1:]:
        shelf.add(one)
    again = Shelf(tmp_path, ShelfLimits(most_batches=2))
    assert again.held_by("ticket-1") == {three[0].id}
    assert [entry.id for entry in again.entries()] == [three[0].id, three[2].id]
    assert not again.hold("ticket-2", [three[2].id])  # two of two: nothing new could come
    again.let_go("ticket-1")
    again.add(three[1])
    assert [entry.id for entry in again.entries()] == [three[2].id, three[1].id]


def test_a_damaged_file_is_told_and_removed(tmp_path: Path, three: list[KeptBatch]) -> None:
    shelf = Shelf(tmp_path, ShelfLimits())
    shelf.add(three[0])
    file = next(tmp_path.glob("*.batch"))
    file.write_bytes(file.read_bytes()[:-40])
    with pytest.raises(KeptBatchError, match=f"{file.name}.*damaged.*removed"):
        shelf.read(three[0].id)
    assert shelf.entries() == ()
    assert not file.exists()


def test_files_that_are_none_of_ours_are_left_alone(tmp_path: Path, three: list[KeptBatch]) -> None:
    (tmp_path / "holds.json").write_text("[not json")
    (tmp_path / "notes.batch").write_text("mine")
    (tmp_path / f"0000000009-1-{three[0].id}.batch").symlink_to("/etc/passwd")
    shelf = Shelf(tmp_path, ShelfLimits(most_batches=1))
    for one in three:
        shelf.add(one)
    assert [entry.id for entry in shelf.entries()] == [three[2].id]
    assert (tmp_path / "notes.batch").read_text() == "mine"


def test_killed_between_any_two_writes_the_shelf_holds_whole_batches(
    tmp_path: Path, three: list[KeptBatch], monkeypatch: pytest.MonkeyPatch
) -> None:
    limits = ShelfLimits(most_batches=2)
    for n in range(100):
        folder = tmp_path / f"killed-{n}"
        shelf = Shelf(folder, limits)
        with monkeypatch.context() as patch, suppress(KilledError):
            kill_at(patch, n)
            for one in three:
                shelf.add(one)
            break
        again = Shelf(folder, limits)
        ids = [entry.id for entry in again.entries()]
        assert ids in [[one.id for one in three[i:j]] for i in range(3) for j in range(i, min(i + 2, 3) + 1)]
        for batch_id in ids:
            assert_same_batch(again.read(batch_id).batch, next(one for one in three if one.id == batch_id).batch)
        assert again.add(three[0]) or three[0].id in ids
    assert n > 12
    assert len(Shelf(folder, limits).entries()) == 2


class FullShelf(Shelf):
    """A disk without room."""

    is_full = True

    def add(self, kept: KeptBatch) -> bool:
        if self.is_full:
            raise OSError(28, "No space left on device")
        return super().add(kept)


def test_a_full_disk_loses_batches_is_told_once_and_forgotten_when_there_is_room(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    shelf = FullShelf(tmp_path, ShelfLimits())
    keeper = BatchKeeper(shelf, MAP)
    keeper.start()
    motion = driven(105.0)
    estimates = weighed(keeper, motion)
    for _ in range(2):
        next(estimates)
        keeper.flush()
    assert (keeper.n_lost, keeper.fault is not None) == (2, True)
    assert names(caplog).count(Event.BATCH_NOT_KEPT) == 1
    shelf.is_full = False
    next(estimates)
    keeper.flush()
    assert keeper.fault is None
    assert len(shelf.entries()) == 1
    keeper.stop()


def test_the_pipeline_never_waits_for_the_keeper(tmp_path: Path) -> None:
    keeper = BatchKeeper(Shelf(tmp_path, ShelfLimits()), MAP)  # not started: a disk that hangs
    assert len(list(weighed(keeper, driven(20.0 * (MOST_WAITING + 2) + 5.0)))) == MOST_WAITING + 2
    assert keeper.n_lost == 2
    assert keeper.fault is not None


def test_a_batch_that_nobody_can_read_ends_no_keeping(tmp_path: Path) -> None:
    """The keeper's thread died of it, and nobody was told."""

    class Deaf:
        wants_all = True

        def hear(self, kept: KeptBatch) -> None:
            raise ArithmeticError("cannot read this one")

    keeper = BatchKeeper(Shelf(tmp_path, ShelfLimits()), MAP)
    keeper.listener = Deaf()
    keeper.start()
    for _ in weighed(keeper, driven(65.0)):
        keeper.flush()
    assert len(keeper.shelf.entries()) == 3
    assert "cannot read this one" in str(keeper.fault)
    keeper.stop()


def test_a_disk_that_hangs_holds_the_stop_no_longer_than_it_may_and_what_is_lost_is_counted(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    keeper = BatchKeeper(Shelf(tmp_path, ShelfLimits()), MAP)
    hangs, is_let_go = threading.Event(), threading.Event()

    class Hanging:
        wants_all = True

        def hear(self, kept: KeptBatch) -> None:
            hangs.set()
            is_let_go.wait(PATIENCE_S)

    keeper.listener = Hanging()
    keeper.start()
    estimates = weighed(keeper, driven(20.0 * 4 + 5.0))
    next(estimates)
    assert hangs.wait(PATIENCE_S)
    assert len(list(estimates)) == 3
    keeper.stop(0.05)
    assert keeper.n_lost == 3
    assert names(caplog).count(Event.BATCH_NOT_KEPT) == 1
    is_let_go.set()
