"""Runs over an archive that go wrong, stop, or meet what has changed: no lie, no loss, nothing done twice."""

from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from support.archive import MIDNIGHT_NS, Here, S, write_drive, write_manifest

from gateway.archive import Location, PlaceError, failures, place_of, receipts, rows_of, slots_done
from gateway.archive.inventory import look
from gateway.archive.job_run import JobStatus, run
from gateway.archive.jobs import ArchiveJob
from gateway.archive.manifest import load_manifest
from gateway.archive.reprocessing import Summary, reprocess
from gateway.archive.survey import LogFile, SurveyedLog, survey
from gateway.errors import ConfigurationError, ReaderMissingError

HOUR = 3600 * S


@pytest.fixture(name="archive")
def _archive(tmp_path: Path) -> Path:
    """Two vehicles, two drives each, of one whole batch and a short one."""
    for n, name in enumerate(("van-1", "van-2")):
        for i in range(2):
            write_drive(tmp_path / name / f"{i}.log", MIDNIGHT_NS + i * HOUR, 21.0, seed=10 * n + i)
    write_manifest(tmp_path, "van-1", "van-2")
    return tmp_path


def dataset_of(archive: Path) -> Location:
    return place_of(archive / "dataset")


def done(archive: Path, workers: Any = None, **how: Any) -> Summary:
    return reprocess(load_manifest(str(archive)), dataset_of(archive), workers or Here(), **how)


def files_of(archive: Path) -> dict[str, bytes]:
    return {item.path: dataset_of(archive).read(item.path) for item in dataset_of(archive).items()}


class Refusing(Here):
    """Answers with a fault where a job is of this vehicle."""

    def __init__(self, vehicle: str, fault: Exception) -> None:
        self.vehicle, self.fault = vehicle, fault

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        if isinstance(args[0], ArchiveJob) and args[0].slot.vehicle == self.vehicle:
            future: Future[Any] = Future()
            future.set_exception(self.fault)
            return future
        return super().submit(fn, *args, **kwargs)


def test_a_second_run_writes_nothing(archive: Path) -> None:
    first = done(archive)
    before = files_of(archive)
    second = done(archive)
    assert (first.counts["done"], first.is_good) == (2, True)
    assert (second.counts["done"], second.counts["already"], second.is_good) == (0, 2, True)
    assert files_of(archive) == before


def test_a_poison_log_is_reported_and_the_others_are_processed(archive: Path) -> None:
    (archive / "van-1" / "0.log").write_bytes(b"\0\xff not a log \n" * 100)
    summary = done(archive)
    assert not summary.is_good
    assert (summary.counts["done"], summary.n_failed_logs) == (2, 1)
    [told] = failures(archive / "dataset")
    assert told["log"] == "van-1/0.log"
    assert told["reason"].startswith("van-1/0.log: holds no CAN frame")
    [receipt] = [one for one in receipts(archive / "dataset") if one["vehicle"] == "van-1"]
    assert [one["log"] for one in receipt["logs"]] == ["van-1/1.log"]
    assert done(archive).is_good  # it is told once; nothing else can be made of the same bytes


def test_a_vehicle_of_poison_logs_alone_gets_a_receipt_that_names_them(archive: Path) -> None:
    for log in (archive / "van-1").iterdir():
        log.write_bytes(b"")
    assert not done(archive).is_good
    first, second = slots_done(dataset_of(archive))
    assert (len(rows_of(dataset_of(archive), first)), len(rows_of(dataset_of(archive), second))) == (0, 2)
    assert [told["log"] for told in failures(archive / "dataset")] == ["van-1/0.log", "van-1/1.log"]
    assert done(archive).is_good


def test_a_worker_killed_between_table_and_receipt_leaves_no_lie(
    archive: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    create = Location.create

    def killed(place: Location, path: str, content: bytes) -> bool:
        if path.startswith("receipts/"):
            raise KeyboardInterrupt
        return create(place, path, content)

    with monkeypatch.context() as killing:
        killing.setattr(Location, "create", killed)
        with pytest.raises(KeyboardInterrupt):
            done(archive)
    (torn, *_) = dataset_of(archive).items("estimates")  # by a power cut
    dataset_of(archive).replace(torn.path, b"")
    assert slots_done(dataset_of(archive)) == []
    assert done(archive).counts["done"] == 2
    assert {len(rows_of(dataset_of(archive), slot)) for slot in slots_done(dataset_of(archive))} == {2}


def test_two_workers_at_one_job_agree_on_one_receipt(archive: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both find no receipt; the conditional write lets one of them win, and the other says so."""
    done(archive)
    before = files_of(archive)
    job = look(load_manifest(str(archive)), dataset_of(archive)).jobs()[0]
    monkeypatch.setattr("gateway.archive.job_run._is_done", lambda job: False)
    assert run(job).status is JobStatus.ALREADY
    assert files_of(archive) == before


def test_a_library_that_is_missing_ends_the_run_and_blames_no_log(
    archive: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing(*log: Any, **zone: Any) -> Any:
        raise ReaderMissingError("install springscale[mdf]")

    for reader in ("gateway.archive.survey.open_whole_log", "gateway.archive.drives.motion_of_log"):
        with monkeypatch.context() as without:
            without.setattr(reader, missing)
            with pytest.raises(ConfigurationError, match="install springscale"):
                done(archive)
    assert dataset_of(archive).items("receipts") == []
    assert done(archive).counts["done"] == 2


@pytest.mark.parametrize("why", ["s3://x/y: timed out", "several processes died over it"])
def test_a_job_that_cannot_be_done_now_is_left_for_the_next_run(why: str, archive: Path) -> None:
    summary = done(archive, Refusing("van-1", PlaceError(why)))
    assert (summary.counts["done"], summary.counts["lost"], summary.is_good) == (1, 1, False)
    assert list(summary.lost.values()) == [why]
    assert done(archive).counts["done"] == 1


def test_a_worker_with_another_version_ends_the_run(archive: Path) -> None:
    manifest = load_manifest(str(archive))
    done(archive)
    job = look(manifest, dataset_of(archive)).jobs()[0]
    other = replace(job, inputs={**job.inputs, "software": "springscale 9.9.9 code 0"})
    with pytest.raises(ConfigurationError, match="install the same springscale on every computer"):
        run(other)


def test_a_log_that_is_changed_meanwhile_is_left_for_the_next_run(archive: Path) -> None:
    manifest = load_manifest(str(archive))
    reprocess(manifest, dataset_of(archive), Here())
    job = next(job for job in look(manifest, dataset_of(archive)).jobs() if job.slot.vehicle == "van-1")
    dataset_of(archive).remove(job.slot.receipt)
    write_drive(archive / "van-1" / "0.log", MIDNIGHT_NS, 21.0, seed=99)
    with pytest.raises(PlaceError, match=r"van-1/0\.log: was changed while the archive was read"):
        run(job)


def test_new_inputs_take_the_place_of_the_old_once_they_are_done(archive: Path) -> None:
    done(archive)
    before = {slot.vehicle: slot for slot in slots_done(dataset_of(archive))}
    write_drive(archive / "van-1" / "2.log", MIDNIGHT_NS + 2 * HOUR, 21.0, seed=7)
    refused = done(archive, Refusing("van-1", PlaceError("later")))
    assert refused.counts["lost"] == 1
    assert set(slots_done(dataset_of(archive))) == set(before.values())  # the old stands until then
    assert done(archive).counts["done"] == 1
    after = {slot.vehicle: slot for slot in slots_done(dataset_of(archive))}
    assert after["van-2"] == before["van-2"]
    assert after["van-1"] != before["van-1"]
    assert len(rows_of(dataset_of(archive), after["van-1"])) == 3


def test_a_vehicle_with_a_log_out_of_reach_is_not_weighed_without_it(
    archive: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unreachable(log: LogFile) -> SurveyedLog:
        if log.name == "van-1/1.log":
            raise PlaceError(f"{log.name}: timed out")
        return survey(log)

    with monkeypatch.context() as breaking:
        breaking.setattr("gateway.archive.reprocessing.survey", unreachable)
        summary = done(archive)
    assert summary.lost == {"van-1/1.log": "van-1/1.log: timed out"}
    assert {slot.vehicle for slot in slots_done(dataset_of(archive))} == {"van-2"}
    assert done(archive).counts["done"] == 1


def test_a_folder_out_of_reach_takes_nothing_back(archive: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A vehicle was calibrated anew within the month; the one folder is there, the other cannot be listed."""
    half_past = "2026-11-01T00:30:00Z"
    write_drive(archive / "later" / "1.log", MIDNIGHT_NS + HOUR, 21.0, seed=5)
    entries = [
        f'id = "van-1"\nlogs = "van-1"\nuntil = {half_past}',
        f'id = "van-1"\nlogs = "later"\nsince = {half_past}',
    ]
    write_manifest(archive, *entries)
    assert done(archive).counts["done"] == 2
    before = files_of(archive)

    def unreachable(place: Location, below: str = "") -> list[Any]:
        if place.url.endswith("/later"):
            raise PlaceError(f"{place}: timed out")
        return items(place, below)

    items = Location.items
    with monkeypatch.context() as breaking:
        breaking.setattr(Location, "items", unreachable)
        summary = done(archive)
    assert (list(summary.lost), summary.n_jobs, summary.is_good) == ([str(archive / "later")], 0, False)
    assert files_of(archive) == before
    assert done(archive).counts["already"] == 2


def test_an_archive_without_logs_is_reported_with_the_searched_folders(tmp_path: Path) -> None:
    write_manifest(tmp_path, "van-1")
    with pytest.raises(ConfigurationError, match=r"not one log in the folders of its vehicles, .*van-1; see logs"):
        done(tmp_path)


@pytest.mark.parametrize("span", ["", "\nuntil = 2026-01-01", "\nsince = 2026-01-01"])
def test_an_undated_log_is_refused_and_named_whatever_the_span(span: str, tmp_path: Path) -> None:
    """It belongs to no month and no calibration's span."""
    write_drive(tmp_path / "van-1" / "1.log", 0, 3.0)
    write_manifest(tmp_path, f'id = "van-1"{span}')
    summary = done(tmp_path)
    assert not summary.is_good
    assert [reason for outcome in summary.outcomes for reason in outcome.failures] == [
        "van-1/1.log: has no date: nothing tells which month and calibration it belongs to; "
        "weigh it with springscale estimate"
    ]
