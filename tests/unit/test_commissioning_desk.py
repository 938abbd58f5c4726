"""Steps of a commissioning: what each asks, what refuses it, what is on disk, and what a power cut leaves."""

import errno
import json
import os
import shutil
from collections.abc import Callable
from contextlib import suppress
from importlib.resources import files
from itertools import count, takewhile
from pathlib import Path
from typing import Any

import pytest
from support.calibrated import calibration_file
from support.commissioning import ANSWERS, NOW_NS, WINDOW_S, Bench, fitted, in_steps, replaced
from support.log import names
from support.power import KilledError, kill_at

from gateway.calibration.commissioning.job import Result
from gateway.calibration.file.calibration_file import CalibrationFile
from gateway.config import Settings
from gateway.config.sections import CommissioningSection
from gateway.errors import RefusedError
from gateway.files.kept import KeptFiles
from gateway.log import Event
from gateway.records import Why
from gateway.service.calibration_in_use import commissioned, with_commissioned
from gateway.service.commissioning.record import FILE_NAME, MOST_MADE, CommissioningRecord
from gateway.service.record_file import RecordFile, load_record
from gateway.stated.commissioning import CommissioningState, FindingTold
from gateway.stated.doubt import Doubt, DoubtKind
from gateway.stated.facts import VehicleAnswers
from gateway.units import NS_PER_S

FAULT = FindingTold(kind="pitch_rate_sign", severity="fault", text="turned over", advice="set sign = -1")


def told(bench: Bench) -> dict[str, Any]:
    text = bench.desk.state()
    CommissioningState.model_validate_json(text)  # the shape that the API promises
    return json.loads(text)


def underway(bench: Bench) -> dict[str, Any]:
    return told(bench)["underway"]


def reason(ask: Callable[[], Any]) -> str:
    with pytest.raises(RefusedError) as refused:
        ask()
    return refused.value.reason


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path)


@pytest.fixture
def driving(bench: Bench) -> Bench:
    in_steps(bench)
    return bench


def test_it_is_offered_where_there_is_no_calibration(tmp_path: Path) -> None:
    assert told(Bench(tmp_path / "without"))["is_offered"]
    assert not told(Bench(tmp_path / "with", replaced(is_calibrated=True)))["is_offered"]
    forbidden = told(Bench(tmp_path / "forbidden", replaced(why_not_allowed="it is not wanted here")))
    assert (forbidden["is_offered"], forbidden["is_allowed"], forbidden["why_not"]) == (
        False,
        False,
        "it is not wanted here",
    )


def test_steps_follow_one_another_and_each_is_on_disk(bench: Bench) -> None:
    for until, step in (("vehicle", "vehicle"), ("empty", "empty"), ("drive", "drive")):
        with suppress(RefusedError):
            bench.desk.cancel("workshop")
        in_steps(bench, until=until)
        assert underway(bench)["step"] == step
        assert underway(Bench(bench.directory))["step"] == step  # as after a power cut
    assert bench.events[:2] == ["commissioning", "commissioning_cancelled"]


def test_what_is_out_of_turn_is_refused(bench: Bench) -> None:
    desk = bench.desk
    for ask in (
        lambda: desk.state_vehicle(VehicleAnswers(**ANSWERS)),
        lambda: desk.is_empty("x"),
        lambda: desk.fit_now("x"),
        lambda: desk.cancel("x"),
    ):
        assert reason(ask) == "not_begun"
    assert reason(lambda: desk.undo("x", to_factory=False)) == "nothing_made"
    in_steps(bench, until="vehicle")
    assert reason(lambda: desk.begin("x", None)) == "already_begun"
    assert reason(lambda: desk.is_empty("x")) == "wrong_step"


def test_where_it_is_not_allowed_nothing_begins(tmp_path: Path) -> None:
    bench = Bench(tmp_path, replaced(why_not_allowed="no"))
    assert reason(lambda: bench.desk.begin("x", None)) == "not_allowed"


@pytest.mark.parametrize(
    ("changes", "what"),
    [
        ({"kerb_front_axle_kg": 20.0, "kerb_rear_axle_kg": 700.0}, "unsprung"),
        ({"payload_range_kg": (500.0, 100.0)}, "must rise"),
        ({"empty_mass_kg": 1240.0}, "belong together"),
        ({"kerb_front_axle_kg": 30.0, "kerb_rear_axle_kg": 31.0}, "100"),
    ],
)
def test_a_vehicle_that_cannot_be_is_refused_in_words(bench: Bench, changes: dict[str, Any], what: str) -> None:
    in_steps(bench, until="vehicle")
    with pytest.raises(RefusedError, match=what) as refused:
        bench.desk.state_vehicle(VehicleAnswers(**{**ANSWERS, **changes}))
    assert refused.value.reason == "vehicle_unusable"
    assert underway(bench)["step"] == "vehicle"


def test_batches_count_from_the_claim_on_and_each_is_fitted(bench: Bench) -> None:
    in_steps(bench, until="empty")
    bench.drive(0)
    assert underway(bench)["n_batches"] == 0
    bench.drives.drive_start_ns, bench.drives.newest_ns = NOW_NS, NOW_NS + 450 * NS_PER_S
    bench.desk.is_empty("workshop")
    bench.drive(1)  # had begun when it was said
    assert underway(bench)["n_batches"] == 0
    bench.drive(2)
    assert (underway(bench)["n_batches"], underway(bench)["driven_s"]) == (1, WINDOW_S)
    assert bench.worker.job.is_fit
    assert len(bench.worker.job.drives[0].batches) == 1
    bench.drive(3)
    assert len(bench.worker.jobs[-1].drives[0].batches) == 2
    assert bench.shelf.held_by("commissioning") == {entry.id for entry in bench.shelf.entries()[-2:]}


def test_rejected_batches_count_for_nothing_but_are_looked_at(driving: Bench) -> None:
    driving.drive(0, WINDOW_S, Why.GRAVITY_MISSING)
    assert underway(driving)["n_batches"] == 0
    assert not driving.worker.job.is_fit
    driving.worker.finish(Result(findings=(FAULT,)))
    assert underway(driving)["inspection"] == {
        "seconds": WINDOW_S,
        "has_fault": True,
        "findings": [FAULT.model_dump()],
    }


def test_the_rest_of_a_drive_that_was_too_short_for_a_window_shows_no_fault(bench: Bench) -> None:
    in_steps(bench, until="empty")
    bench.drive(0, 70, Why.TOO_SHORT, Why.GAP)
    assert bench.worker.jobs == []
    bench.desk.is_empty("workshop")
    assert underway(bench)["step"] == "drive"


def test_a_fault_keeps_the_vehicle_from_being_called_empty_until_it_is_mended(bench: Bench) -> None:
    in_steps(bench, until="empty")
    bench.drive(0, 60, is_provisional=True)
    bench.worker.finish(Result(findings=(FAULT,)))
    with pytest.raises(RefusedError, match=r"turned over: set sign = -1"):
        bench.desk.is_empty("workshop")
    bench.drive(0, 120, is_provisional=True)
    bench.worker.finish(Result())
    bench.desk.is_empty("workshop")
    assert underway(bench)["step"] == "drive"


def test_enough_is_what_was_learned(driving: Bench) -> None:
    driving.drive(0)
    driving.worker.finish(fitted(payload_std_kg=15.0))
    assert told(driving)["active"] is None  # one window may be an odd one
    driving.drive(1)
    driving.worker.finish(fitted(payload_std_kg=19.0))
    assert underway(driving)["learned"]["share"] == pytest.approx(18.0 / 19.0)
    assert not underway(driving)["learned"]["is_enough"]
    driving.drive(2)
    driving.worker.finish(fitted(payload_std_kg=17.0))
    state = told(driving)
    assert state["underway"] is None
    assert (state["active"]["id"], state["active"]["n_batches"]) == (calibration_file().id, 3)
    assert state["is_pending"]
    assert driving.desk.is_due
    assert driving.events[-1] == "commissioned"


def test_whoever_asks_may_have_it_of_one_window(driving: Bench) -> None:
    assert reason(lambda: driving.desk.fit_now("workshop")) == "no_batch"
    driving.drive(0)
    driving.worker.finish(fitted(payload_std_kg=90.0))
    driving.desk.fit_now("workshop")
    assert (underway(driving)["step"], underway(driving)["is_fitting"]) == ("fit", True)
    assert reason(lambda: driving.desk.state_vehicle(VehicleAnswers(**ANSWERS))) == "fitting"
    driving.worker.finish(fitted(payload_std_kg=90.0))
    assert told(driving)["active"]["learned"]["payload_std_kg"] == 90.0


def test_a_fit_that_fails_says_why_and_the_drive_goes_on(driving: Bench) -> None:
    driving.drive(0)
    driving.desk.fit_now("workshop")
    driving.worker.finish(Result(fault="the fit needs more than 256 MB"))
    assert (underway(driving)["step"], underway(driving)["fault"]) == ("drive", "the fit needs more than 256 MB")
    driving.drive(1)
    driving.worker.finish(Result(refusal="no run can be used", findings=(FAULT,)))
    assert underway(driving)["fault"] == "no run can be used"
    driving.drive(2)
    driving.worker.finish(fitted())
    assert told(driving)["active"] is not None


def test_a_calibration_that_does_not_hold_its_own_hash_is_not_used(driving: Bench) -> None:
    driving.drive(0)
    driving.drive(1)
    good = fitted()
    changed = good.calibration.replace('"van"', '"vam"')
    assert changed != good.calibration
    driving.worker.finish(good.model_copy(update={"calibration": changed}))
    assert told(driving)["active"] is None
    assert driving.desk.fault is not None


def test_the_vehicle_may_be_answered_anew_and_what_was_driven_stays(driving: Bench) -> None:
    driving.drive(0)
    driving.worker.finish(fitted(payload_std_kg=50.0))
    driving.desk.state_vehicle(VehicleAnswers(**{**ANSWERS, "wheelbase_m": 2.9}))
    assert (underway(driving)["step"], underway(driving)["n_batches"]) == ("drive", 1)
    assert underway(driving)["learned"] is None
    assert driving.worker.jobs[-1].vehicle.wheelbase_m == 2.9


@pytest.mark.parametrize(
    ("typed", "payload_kg"), [({}, 900.0), ({"payload_range_kg": (0.0, 700.0)}, 700.0)], ids=["as its sister", "said"]
)
def test_what_a_sister_shares_need_not_be_typed(tmp_path: Path, typed: dict[str, Any], payload_kg: float) -> None:
    sister = json.loads((Path(str(files("gateway"))) / "demo" / "paper_van.json").read_text())
    sister["vehicle"] |= {"payload_range_kg": [0.0, 900.0], "gross_limit_kg": 2300.0, "track_width_m": 1.6}
    held = CalibrationFile.model_validate(sister)
    bench = Bench(tmp_path / "state", replaced(sister=held.vehicle))
    bench.desk.begin("workshop", None)
    bench.desk.state_vehicle(VehicleAnswers(**{**ANSWERS, "wheelbase_m": held.vehicle.wheelbase_m, **typed}))
    bench.desk.is_empty("workshop")
    bench.drive(0)
    vehicle = bench.worker.jobs[-1].vehicle
    assert vehicle.payload_range_kg == (0.0, payload_kg)
    assert (vehicle.gross_limit_kg, vehicle.track_width_m) == (2300.0, 1.6)
    assert vehicle.kerb_front_axle_kg == ANSWERS["kerb_front_axle_kg"]


CONTRADICTED = Doubt.of(DoubtKind.DRIVEN_SISTER)
SLIPPED = {**ANSWERS, "kerb_front_axle_kg": 69.0}


def test_unlikely_answers_are_kept_and_nothing_goes_on_until_they_are_confirmed(bench: Bench) -> None:
    in_steps(bench, until="vehicle")
    bench.desk.state_vehicle(VehicleAnswers(**SLIPPED))
    now = underway(bench)
    assert (now["step"], now["vehicle"]["kerb_front_axle_kg"]) == ("vehicle", 69.0)
    assert {one["kind"] for one in now["doubts"]} == {"mass", "front_share"}
    assert now["doubts"][0]["meant"] == {"kerb_front_axle_kg": 690.0}
    assert reason(lambda: bench.desk.is_empty("x")) == "wrong_step"
    bench.desk.confirm("workshop")
    now = underway(bench)
    assert (now["step"], now["doubts"], len(now["confirmed"])) == ("empty", [], 2)
    assert reason(lambda: bench.desk.confirm("x")) == "nothing_doubted"
    assert "commissioning_doubt_confirmed" in bench.events
    bench.desk.is_empty("workshop")
    bench.drive(0)
    bench.drive(1)
    bench.worker.finish(fitted())
    assert any("did you mean kerb_front_axle_kg = 690?" in one for one in told(bench)["active"]["warnings"])


def test_corrected_answers_leave_no_doubt(bench: Bench) -> None:
    in_steps(bench, until="vehicle")
    bench.desk.state_vehicle(VehicleAnswers(**SLIPPED))
    bench.desk.state_vehicle(VehicleAnswers(**ANSWERS))
    assert (underway(bench)["step"], underway(bench)["doubts"]) == ("empty", [])


def test_a_fit_that_contradicts_the_facts_is_held_until_somebody_confirms(driving: Bench) -> None:
    doubtful = fitted().model_copy(update={"doubts": (CONTRADICTED,)})
    for n in range(2):
        driving.drive(n)
        driving.worker.finish(doubtful)
    assert told(driving)["active"] is None
    assert [one["kind"] for one in underway(driving)["doubts"]] == ["driven_sister"]
    driving.desk.confirm("workshop")
    assert underway(driving)["step"] == "fit"
    driving.worker.finish(doubtful)
    assert told(driving)["active"] is not None


def test_where_it_was_not_empty_the_drive_begins_again(driving: Bench) -> None:
    driving.drive(0)
    driving.worker.finish(fitted().model_copy(update={"doubts": (CONTRADICTED,)}))
    driving.desk.is_empty("workshop")
    assert underway(driving)["n_batches"] == 1  # said once more, it changes nothing
    driving.desk.is_empty("workshop", again=True)
    now = underway(driving)
    assert (now["step"], now["n_batches"], now["doubts"], now["learned"]) == ("drive", 0, [], None)
    driving.drive(1)
    assert underway(driving)["n_batches"] == 1


def test_the_open_window_counts_from_its_first_second(driving: Bench) -> None:
    assert (underway(driving)["driven_s"], underway(driving)["next_window_s"]) == (0.0, None)
    driving.drives.drive_start_ns = NOW_NS
    driving.drives.open_window_ns = (NOW_NS, NOW_NS + 50 * NS_PER_S)
    assert (underway(driving)["driven_s"], underway(driving)["next_window_s"]) == (50.0, 250.0)


def test_a_window_that_had_begun_before_the_claim_does_not_count(bench: Bench) -> None:
    in_steps(bench, until="empty")
    bench.drives.drive_start_ns, bench.drives.newest_ns = NOW_NS, NOW_NS + 100 * NS_PER_S
    bench.desk.is_empty("workshop")
    bench.drives.open_window_ns = (NOW_NS, NOW_NS + 120 * NS_PER_S)
    assert (underway(bench)["driven_s"], underway(bench)["next_window_s"]) == (0.0, 480.0)


def test_cancel_forgets_all_but_what_was_made(driving: Bench) -> None:
    make(driving)
    in_steps(driving)
    driving.drive(5)
    driving.desk.cancel("workshop")
    driving.drive(6)
    assert told(driving)["underway"] is None
    assert told(driving)["active"] is not None
    assert driving.shelf.held_by("commissioning") == frozenset()
    assert not driving.worker.is_busy


def make(bench: Bench, payload_kg: float = 100.0) -> str:
    """A calibration, from two windows."""
    for n in range(2):
        bench.drive(n)
    bench.worker.finish(fitted(payload_kg=payload_kg))
    return str(told(bench)["active"]["id"])


def test_undo_brings_the_one_before_back_and_factory_the_settings_own(driving: Bench) -> None:
    first = make(driving, 100.0)
    in_steps(driving)
    second = make(driving, 200.0)
    assert first != second
    driving.desk.undo("workshop", to_factory=False)
    assert told(driving)["active"]["id"] == first
    driving.desk.undo("workshop", to_factory=False)
    assert told(driving)["active"] is None
    assert not driving.desk.is_due  # as it was started
    assert [one["ended"]["why"] for one in told(driving)["history"]] == ["undone", "undone"]
    in_steps(driving)
    make(driving, 300.0)
    driving.desk.undo("workshop", to_factory=True)
    assert told(driving)["history"][0]["ended"]["why"] == "back_to_factory"


def test_the_part_of_an_open_window_is_all_that_a_power_cut_costs(driving: Bench) -> None:
    driving.drive(0)
    driving.drive(1, 60, is_provisional=True)
    driving.drive(1, 120, is_provisional=True)
    assert len(driving.shelf.entries()) == 2
    after = Bench(driving.directory)
    assert (underway(after)["n_batches"], underway(after)["driven_s"]) == (2, WINDOW_S + 120)
    after.desk.start()
    assert len(after.worker.jobs[-1].drives[0].batches) == 2
    assert after.worker.jobs[-1].settings["window_s"] == WINDOW_S


def test_a_window_that_is_whole_takes_the_place_of_its_parts(driving: Bench) -> None:
    driving.drive(0, 60, is_provisional=True)
    driving.drive(0)
    assert (underway(driving)["n_batches"], underway(driving)["driven_s"]) == (1, WINDOW_S)
    driving.drive(1, 60, is_provisional=True)
    driving.drive(1, 90, Why.TOO_SHORT)  # the drive is over
    assert (underway(driving)["n_batches"], underway(driving)["driven_s"]) == (1, WINDOW_S)
    assert len(driving.shelf.entries()) == 1


def test_another_signal_map_begins_the_drive_anew(driving: Bench) -> None:
    driving.drive(0)
    after = Bench(driving.directory, replaced(signals_id="another"))
    assert (underway(after)["step"], underway(after)["n_batches"]) == ("empty", 0)
    assert "signal map" in underway(after)["fault"]


def test_batches_that_are_gone_are_forgotten(driving: Bench) -> None:
    driving.drive(0)
    for file in (driving.directory / "batches").glob("*.batch"):
        file.unlink()
    assert underway(Bench(driving.directory))["n_batches"] == 0


def test_a_result_that_comes_late_belongs_to_nobody(driving: Bench) -> None:
    driving.drive(0)
    late = driving.worker.job
    driving.desk.cancel("workshop")
    in_steps(driving)
    driving.worker.job = late
    driving.worker.finish(fitted())
    assert told(driving)["active"] is None
    assert underway(driving)["learned"] is None


def test_a_disk_that_refuses_changes_nothing(driving: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(self: KeptFiles, name: str, content: bytes) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    before = told(driving)
    with monkeypatch.context() as patch:
        patch.setattr(KeptFiles, "write", full)
        for ask in (
            lambda: driving.desk.state_vehicle(VehicleAnswers(**{**ANSWERS, "wheelbase_m": 2.9})),
            lambda: driving.desk.cancel("workshop"),
        ):
            assert reason(ask) == "not_stored"
    assert told(driving) == before


def test_a_full_disk_while_driving_is_told_and_the_next_window_counts(
    driving: Bench, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def full(*_: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(RecordFile, "keep", full)
        driving.drive(0)
    assert driving.desk.fault is not None
    assert Event.COMMISSIONING_NOT_KEPT in names(caplog)
    driving.drive(1)
    assert underway(driving)["n_batches"] == 1


def test_a_book_that_cannot_be_believed_is_set_aside(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / FILE_NAME).write_text("{not json")
    bench = Bench(tmp_path)
    assert told(bench)["history"] == []
    assert bench.desk.fault is not None
    assert Event.COMMISSIONING_SET_ASIDE in names(caplog)
    assert list(tmp_path.glob(f"{FILE_NAME}.broken-*"))


def test_a_book_that_cannot_be_set_aside_is_not_written_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder that was read-only at the start may be writable when somebody begins."""

    def refuse(_self: KeptFiles, _name: str) -> str:
        raise OSError(30, "Read-only file system")

    (tmp_path / FILE_NAME).write_text("{what was made here")
    with monkeypatch.context() as patch:
        patch.setattr(KeptFiles, "set_aside", refuse)
        bench = Bench(tmp_path)
        assert "cannot be set aside" in str(bench.desk.fault)
        with pytest.raises(RefusedError, match="Read-only"):
            bench.desk.begin("workshop", None)
        assert (tmp_path / FILE_NAME).read_text() == "{what was made here"
    bench.desk.begin("workshop", None)
    (aside,) = tmp_path.glob(f"{FILE_NAME}.broken-*")
    assert aside.read_text() == "{what was made here"
    assert told(Bench(tmp_path))["underway"] is not None


def test_only_so_many_are_remembered(driving: Bench) -> None:
    for n in range(MOST_MADE + 2):
        make(driving, 10.0 * n)
        in_steps(driving)
    assert len(told(driving)["history"]) == MOST_MADE
    assert len(list(driving.directory.glob("commissioned-*.json"))) == MOST_MADE


STEPS: list[Callable[[Bench], Any]] = [
    lambda b: b.desk.begin("workshop", "note"),
    lambda b: b.desk.state_vehicle(VehicleAnswers(**ANSWERS)),
    lambda b: b.desk.is_empty("workshop"),
    lambda b: b.drive(0, 60, is_provisional=True),
    lambda b: b.drive(0),
    lambda b: b.drive(1, 60, is_provisional=True),
    lambda b: b.drive(1),
    lambda b: b.worker.finish(fitted()),
    lambda b: b.desk.undo("workshop", to_factory=False),
]


def essence(bench: Bench) -> tuple[Any, ...]:
    """What must be one of two neighbours."""
    state = told(bench)
    now = state["underway"] or {}
    made = tuple((one["id"], one["ended"] is None) for one in state["history"])
    return now.get("step"), now.get("n_batches"), now.get("driven_s"), made


@pytest.mark.parametrize("at", range(len(STEPS)))
def test_killed_between_any_two_writes_it_is_one_of_the_neighbours(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, at: int
) -> None:
    base = Bench(tmp_path / "base")
    for step in STEPS[:at]:
        step(base)

    def killed_after(n_writes: int) -> tuple[Any, ...] | None:
        """What is found after the next start; None where the step came to its end before."""
        folder = tmp_path / str(n_writes)
        shutil.copytree(base.directory, folder)
        bench = Bench(folder)
        bench.desk.start()
        with monkeypatch.context() as patch:
            kill_at(patch, n_writes)
            try:
                STEPS[at](bench)
            except KilledError:
                is_killed = True
            else:
                is_killed = False
        return essence(Bench(folder)) if is_killed else None

    base.directory.mkdir(exist_ok=True)
    neighbours = [essence(Bench(base.directory))]
    after = shutil.copytree(base.directory, tmp_path / "after")
    done = Bench(after)
    done.desk.start()
    STEPS[at](done)
    neighbours.append(essence(Bench(after)))
    found = list(takewhile(lambda one: one is not None, map(killed_after, count())))
    assert len(found) > 4
    assert found[0] == neighbours[0]
    assert all(one in neighbours for one in found), (found, neighbours)
    assert found == sorted(found, key=neighbours.index)  # never back again


def test_a_service_starts_with_what_was_made_here(driving: Bench) -> None:
    settings = Settings(
        signals="springscale:reference", store={"directory": driving.directory}, estimator="cross_spectrum"
    )
    assert with_commissioned(settings) is settings
    for n in range(2):
        driving.drive(n)
    driving.worker.finish(fitted())
    active = load_record(driving.directory / FILE_NAME, CommissioningRecord()).active
    chosen = with_commissioned(settings)
    assert chosen.calibration == driving.directory / active.file_name
    forbidden = settings.model_copy(update={"commissioning": CommissioningSection(is_allowed=False)})
    assert with_commissioned(forbidden) is forbidden
    (driving.directory / active.file_name).write_text("{}")
    used, setup, fault = commissioned(settings)
    assert used is settings
    assert setup.calibration is None
    assert fault is not None
    assert "cannot be used" in fault
