"""Setting and undoing tares at a service's desk: refusals, history, what is on disk, what is in use."""

import errno
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from support.calibrated import calibration_file
from support.log import fields_of, names
from support.tare import FakePipeline

from gateway.calibration.tare_file import FILE_NAME, MOST_ENTRIES, load_tares
from gateway.core.tare import Refusal
from gateway.errors import ConfigurationError, TareRefusedError
from gateway.files.kept import KeptFiles
from gateway.log import Event
from gateway.service.tare_desk import Subject, TareDesk
from gateway.units import NS_PER_S
from gateway.web.routes.calibration.tare import TareState

NOW_NS = 1_790_000_000 * NS_PER_S


CALIBRATED = calibration_file().for_core()


class Desk:
    """A desk in a directory, its events and its pipeline."""

    def __init__(self, directory: Path, **subject: Any) -> None:
        self.pipeline = FakePipeline()
        self.events: list[str] = []
        self.path = directory / FILE_NAME
        self.desk = TareDesk(
            directory,
            replace(Subject(CALIBRATED, "ratio_index", "van-17"), **subject),
            self.pipeline,
            stale_after_s=900.0,
            on_event=lambda kind, detail: self.events.append(kind),
            clock_ns=lambda: NOW_NS,
        )

    @property
    def told(self) -> dict[str, Any]:
        text = self.desk.told()
        TareState.model_validate_json(text)  # the shape that the API promises
        state: dict[str, Any] = json.loads(text)
        return state

    @property
    def in_use(self) -> str | None:
        tare = self.pipeline.flow.tare
        return None if tare is None else str(tare.id)

    def refusal(self, ask: Callable[[], Any]) -> str:
        with pytest.raises(TareRefusedError) as refused:
            ask()
        return refused.value.reason


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    return Desk(tmp_path)


def test_a_tare_is_on_disk_and_in_use_and_says_where_it_is_from(desk: Desk) -> None:
    made = json.loads(desk.desk.tare("workshop", "after new dampers"))
    assert made["payload_kg"] == 12.0
    assert made["payload_std_kg"] == pytest.approx(5.0)
    assert made["front_share_pct"] == pytest.approx(1.0)  # an empty share of 50 % is stated
    assert (made["by"], made["note"], made["vehicle_id"]) == ("workshop", "after new dampers", "van-17")
    assert (made["calibration_id"], made["estimator"]) == (CALIBRATED.id, "ratio_index")
    assert (made["n_batches"], made["batch_ids"], made["ended"]) == (1, ["5-abc"], None)
    assert made["at"] == "2026-09-21T14:13:20.000000Z"
    assert [entry.id for entry in load_tares(desk.path).entries] == [made["id"]]
    assert desk.in_use == made["id"]
    assert desk.events == ["tare_set"]
    assert desk.told["active"] == made == desk.told["history"][0]


def test_undo_restores_what_counted_before_exactly(desk: Desk) -> None:
    desk.desk.tare("a", None)
    first = desk.pipeline.flow.tare
    desk.pipeline.weigh(20.0)
    desk.desk.tare("b", None)
    assert desk.pipeline.flow.tare.zero.payload_kg == 20.0
    state = json.loads(desk.desk.undo("c", to_factory=False))
    assert desk.pipeline.flow.tare == first
    assert state["active"]["id"] == first.id
    assert [entry["ended"] and entry["ended"]["why"] for entry in state["history"]] == ["undone", None]
    assert state["history"][0]["ended"]["by"] == "c"
    desk.desk.undo("c", to_factory=False)
    assert desk.in_use is None


def test_back_to_factory_ends_all_and_keeps_the_history(desk: Desk) -> None:
    for payload_kg in (10.0, 20.0, 30.0):
        desk.pipeline.weigh(payload_kg)
        desk.desk.tare("a", None)
    state = json.loads(desk.desk.undo("b", to_factory=True))
    assert desk.in_use is None
    assert [entry["ended"]["why"] for entry in state["history"]] == ["back_to_factory"] * 3
    assert [entry["payload_kg"] for entry in state["history"]] == [30.0, 20.0, 10.0]
    assert desk.refusal(lambda: desk.desk.undo("b", to_factory=True)) == Refusal.NOT_TARED


REFUSALS: list[tuple[Callable[[FakePipeline], Any], Refusal]] = [
    (lambda p: setattr(p.flow, "weighed", None), Refusal.NO_COUNTED_BATCH),
    (lambda p: setattr(p, "age_s", None), Refusal.NO_COUNTED_BATCH),
    (lambda p: setattr(p, "age_s", 900.5), Refusal.STALE),
    (lambda p: setattr(p.flow, "load_may_have_changed", True), Refusal.LOAD_MAY_HAVE_CHANGED),
    (lambda p: p.weigh(62.5), Refusal.OFFSET_TOO_LARGE),
    (lambda p: p.weigh(-62.5), Refusal.OFFSET_TOO_LARGE),
    (lambda p: p.weigh(0.0, share_pct=54.0), Refusal.OFFSET_TOO_LARGE),
    (lambda p: p.weigh(0.0, std_kg=32.0), Refusal.OFFSET_UNCERTAIN),
]


@pytest.mark.parametrize(("spoil", "reason"), REFUSALS)
def test_refusals_change_nothing_and_are_told_beforehand(
    desk: Desk, spoil: Callable[[FakePipeline], Any], reason: Refusal
) -> None:
    desk.desk.tare("a", None)
    before, stored = desk.in_use, desk.path.read_bytes()
    spoil(desk.pipeline)
    assert desk.told["offer"] == desk.told["offer"] | {"is_possible": False, "reason": reason, "zero": None}
    assert desk.refusal(lambda: desk.desk.tare("b", None)) == reason
    assert (desk.in_use, desk.path.read_bytes()) == (before, stored)


def test_the_offer_says_what_a_tare_would_be(desk: Desk) -> None:
    offer = desk.told["offer"]
    made = json.loads(desk.desk.tare("a", None))
    assert offer["is_possible"] is True
    assert {name: made[name] for name in offer["zero"]} == offer["zero"]


def test_without_a_calibration_there_is_nothing_to_correct(tmp_path: Path) -> None:
    desk = Desk(tmp_path, calibrated=None)
    assert desk.refusal(lambda: desk.desk.tare("a", None)) == Refusal.NO_CALIBRATION
    assert desk.told["active"] is None


def test_a_restart_goes_on_with_the_tare(tmp_path: Path) -> None:
    Desk(tmp_path).desk.tare("a", None)
    again = Desk(tmp_path)
    assert again.in_use == load_tares(tmp_path / FILE_NAME).entries[0].id
    assert again.pipeline.flow.tare.zero.payload_kg == 12.0
    assert again.events == []


def test_another_calibration_ends_it_for_good_and_keeps_it_in_the_history(tmp_path: Path) -> None:
    Desk(tmp_path).desk.tare("a", None)
    other = Desk(tmp_path, calibrated=calibration_file(payload_kg=300.0).for_core())
    assert other.in_use is None
    assert other.events == ["tare_dropped"]
    (entry,) = other.told["history"]
    assert (entry["ended"]["why"], entry["ended"]["by"]) == ("other_calibration", "service")
    assert Desk(tmp_path).in_use is None  # the old file back again does not bring an old zero back


def test_another_estimator_does_not_use_it_and_no_calibration_does_not_end_it(tmp_path: Path) -> None:
    Desk(tmp_path).desk.tare("a", None)
    other = Desk(tmp_path, estimator="cross_spectrum")
    assert other.in_use is None
    assert other.refusal(lambda: other.desk.undo("a", to_factory=True)) == Refusal.NOT_TARED
    assert Desk(tmp_path, calibrated=None).in_use is None
    assert Desk(tmp_path).in_use is not None


def test_the_history_is_bounded_and_the_newest_counts(desk: Desk) -> None:
    for n in range(MOST_ENTRIES + 5):
        desk.pipeline.weigh(n / 10.0)
        desk.desk.tare("a", None)
    entries = load_tares(desk.path).entries
    assert len(entries) == MOST_ENTRIES
    assert entries[-1].payload_kg == pytest.approx((MOST_ENTRIES + 4) / 10.0)
    assert desk.in_use == entries[-1].id


def test_a_disk_that_refuses_leaves_all_as_it_was(desk: Desk) -> None:
    desk.desk.tare("a", None)
    before, stored = desk.in_use, desk.path.read_bytes()
    desk.path.with_name(f".{FILE_NAME}.new").mkdir()  # no file can be written there, not even by root
    assert desk.refusal(lambda: desk.desk.tare("b", None)) == Refusal.NOT_STORED
    assert desk.refusal(lambda: desk.desk.undo("b", to_factory=False)) == Refusal.NOT_STORED
    assert (desk.in_use, desk.path.read_bytes()) == (before, stored)


def test_a_disk_that_refuses_at_the_start_does_not_put_another_calibrations_zero_in_use(tmp_path: Path) -> None:
    Desk(tmp_path).desk.tare("a", None)
    (tmp_path / f".{FILE_NAME}.new").mkdir()
    other = Desk(tmp_path, calibrated=calibration_file(payload_kg=300.0).for_core())
    assert other.in_use is None


SPOILT: list[tuple[Callable[[str], str], str]] = [
    (lambda text: text.replace('"payload_kg": 12.0', '"payload_kg": 13.0'), "was changed after it was written"),
    (lambda text: text.replace('"version": 1', '"version": 2'), "version"),
    (lambda text: text[: len(text) // 2], "JSON"),
    (lambda text: text.replace('"payload_kg": 12.0', '"payload_kg": NaN'), "payload_kg"),
]


@pytest.mark.parametrize(("spoil", "said"), SPOILT)
def test_a_file_that_cannot_be_believed_is_set_aside_and_the_weighing_goes_on(
    tmp_path: Path, spoil: Callable[[str], str], said: str, caplog: pytest.LogCaptureFixture
) -> None:
    Desk(tmp_path).desk.tare("a", None)
    path = tmp_path / FILE_NAME
    path.write_text(spoil(path.read_text()))
    spoilt = path.read_bytes()
    with pytest.raises(ConfigurationError, match=said) as fault:
        load_tares(path)
    assert str(path) in str(fault.value)
    assert "remove it to go on from the factory zero" in str(fault.value)

    desk = Desk(tmp_path)
    assert desk.in_use is None
    assert desk.events == ["broken_tares_set_aside"]
    (aside,) = tmp_path.glob("tare.json.broken-*")
    assert aside.read_bytes() == spoilt
    assert desk.desk.fault is not None
    assert aside.name in desk.desk.fault
    assert said in fields_of(caplog, Event.TARE_SET_ASIDE)["fault"]
    desk.desk.tare("b", None)
    assert desk.desk.fault is None
    assert Desk(tmp_path).in_use is not None


def test_a_broken_file_that_cannot_be_moved_is_not_written_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / FILE_NAME).write_text("{")

    def refuse(_self: KeptFiles, _name: str) -> str:
        raise OSError(errno.EROFS, "Read-only file system")

    with monkeypatch.context() as patch:
        patch.setattr(KeptFiles, "set_aside", refuse)
        desk = Desk(tmp_path)
        assert desk.refusal(lambda: desk.desk.tare("a", None)) == Refusal.NOT_STORED
        assert (tmp_path / FILE_NAME).read_text() == "{"
    desk.desk.tare("a", None)
    assert [aside.read_text() for aside in tmp_path.glob("tare.json.broken-*")] == ["{"]


def test_a_note_that_is_no_text_is_neither_stored_nor_used(desk: Desk) -> None:
    with pytest.raises(UnicodeEncodeError):
        desk.desk.tare("a", "\ud83d")
    assert (desk.in_use, desk.path.exists()) == (None, False)


def test_the_log_tells_of_every_change_of_the_zero(desk: Desk, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO", "gateway")
    made = json.loads(desk.desk.tare("workshop", None))
    desk.desk.undo("office", to_factory=False)
    assert names(caplog) == [Event.TARE_SET, Event.TARE_UNDONE]
    told = fields_of(caplog, Event.TARE_SET)
    assert (told["tare_id"], told["by"], told["payload_kg"]) == (made["id"], "workshop", 12.0)
    assert fields_of(caplog, Event.TARE_UNDONE) == {"tare_ids": [made["id"]], "by": "office"}
