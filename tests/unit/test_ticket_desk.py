"""Tickets: attached to a load, learned from, taken back; nothing is lost by a stop, a kill or a disk that refuses."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from support.calibrated import calibration_file
from support.commissioning import fitted
from support.tickets import PLANNED, TicketBench

from gateway.calibration.commissioning import Result
from gateway.calibration.known_weight import WeightRefusal
from gateway.errors import WeightRefusedError
from gateway.service.proving.ticket_desk import OWNER
from gateway.stated_weight import StatedWeight


def calibration_id(payload_kg: float) -> str:
    return calibration_file(payload_kg=payload_kg).id


BASE = calibration_id(1.0)


@pytest.fixture
def desk(tmp_path: Path) -> Iterator[TicketBench]:
    made = TicketBench(tmp_path)
    yield made
    made.store.close()


def refusal_of(desk: TicketBench, stated: StatedWeight) -> str:
    n_before = len(desk.told()["history"])
    with pytest.raises(WeightRefusedError) as refused:
        desk.desk.add("workshop", None, stated)
    assert len(desk.told()["history"]) == n_before
    return refused.value.reason


def test_after_the_empty_drive_it_is_told_which_load_would_help_most(desk: TicketBench) -> None:
    assert [drive.name for drive in desk.worker.jobs[-1].drives] == ["empty drive"]
    assert (desk.told()["is_busy"], desk.told()["planned"], desk.told()["is_provisional"]) == (True, None, True)
    desk.finish(1.0)
    told = desk.told()
    assert (told["is_busy"], told["is_possible"], told["is_provisional"]) == (False, True, True)
    assert told["planned"] == PLANNED.model_dump()
    assert desk.active_id == BASE  # the same drives make the same calibration
    desk.restart()
    assert desk.worker.jobs == []  # it is known already


def test_a_ticket_is_fitted_with_the_empty_drive_and_what_comes_of_it_is_used(desk: TicketBench) -> None:
    ticket = desk.add(1)
    job = desk.worker.jobs[-1]
    assert [(drive.name, drive.payload_kg, len(drive.batches)) for drive in job.drives] == [
        ("empty drive", 0.0, 2),
        (ticket["id"], 270.0, 2),
    ]
    assert job.is_planned
    assert desk.bench.shelf.held_by(OWNER) == set(ticket["batch_ids"])
    desk.finish(2.0, PLANNED.model_copy(update={"is_enough": True}))
    told = desk.told()
    assert (told["n_teaching"], told["is_provisional"], told["fault"]) == (1, False, None)
    assert desk.active_id == calibration_id(2.0)
    assert desk.bench.desk.is_due  # from the next drive on
    assert desk.events == ["ticket_added", "refitted_with_tickets"]


def test_a_ticket_taken_back_leaves_no_trace_in_the_calibration(desk: TicketBench) -> None:
    first, second = desk.add(1), desk.add(2, payload_kg=400.0)
    assert len(desk.worker.jobs[-1].drives) == 3
    desk.finish(3.0)
    desk.desk.withdraw("workshop", first["id"])
    assert [drive.payload_kg for drive in desk.worker.jobs[-1].drives] == [0.0, 400.0]
    assert desk.active_id == calibration_id(3.0)  # until there is a better one
    desk.finish(4.0)
    assert desk.active_id == calibration_id(4.0)
    desk.desk.withdraw("workshop", second["id"])
    assert desk.active_id == BASE
    assert desk.bench.shelf.held_by(OWNER) == frozenset()
    history = desk.told()["history"]
    assert [one["withdrawn"]["by"] for one in history] == ["workshop", "workshop"]
    with pytest.raises(WeightRefusedError) as refused:
        desk.desk.withdraw("workshop", first["id"])
    assert refused.value.reason == WeightRefusal.NO_SUCH_TICKET


def test_tickets_that_were_fitted_before_are_not_fitted_again(desk: TicketBench) -> None:
    desk.add(1)
    desk.finish(2.0)
    second = desk.add(2)
    desk.finish(3.0)
    n_before = len(desk.worker.jobs)
    desk.desk.withdraw("workshop", second["id"])
    assert len(desk.worker.jobs) == n_before
    assert desk.active_id == calibration_id(2.0)


def test_one_undone_by_a_person_stays_undone_until_tickets_change(desk: TicketBench) -> None:
    desk.add(1)
    desk.finish(2.0)
    desk.bench.desk.undo("workshop", to_factory=False)
    assert desk.active_id == BASE
    desk.restart()
    assert desk.worker.jobs == []
    desk.add(2)
    assert len(desk.worker.jobs[-1].drives) == 3


def test_a_gross_weight_alone_is_kept_and_teaches_nothing(desk: TicketBench) -> None:
    desk.finish(1.0)
    ticket = desk.add(1, position_m=None)
    assert ticket["front_share_pct"] is None
    assert desk.told()["n_teaching"] == 0
    assert len(desk.worker.jobs) == 1


def test_a_stop_in_the_middle_of_a_fit_begins_it_again(desk: TicketBench) -> None:
    desk.add(1)
    desk.desk.stop()
    desk.restart()
    assert [len(job.drives) for job in desk.worker.jobs] == [2]
    desk.finish(2.0)
    assert desk.active_id == calibration_id(2.0)


def test_what_came_of_an_earlier_fit_is_not_taken_for_that_of_the_next(desk: TicketBench) -> None:
    """It ended while a second ticket was handed in: it was kept as if it knew both, and theirs was thrown away."""
    desk.add(1)
    earlier = desk.worker.jobs[-1]
    desk.add(2)
    desk.worker.tell(earlier, fitted(payload_kg=2.0))
    assert desk.active_id == BASE
    desk.finish(3.0)
    assert desk.active_id == calibration_id(3.0)
    assert len(desk.told()["history"]) == 2


def test_a_ticket_handed_in_while_the_service_stops_is_fitted_after_the_next_start(desk: TicketBench) -> None:
    """The process would have gone on without anybody, in the folder of the next one."""
    n_before = len(desk.worker.jobs)
    desk.desk.stop()
    desk.add(1)
    assert len(desk.worker.jobs) == n_before
    desk.restart()
    assert [len(job.drives) for job in desk.worker.jobs] == [2]


@pytest.mark.parametrize(
    "result", [Result(fault="the fit was killed: the machine has not enough memory"), Result(refusal="a sign is wrong")]
)
def test_a_fit_that_fails_is_told_and_changes_nothing(desk: TicketBench, result: Result) -> None:
    desk.add(1)
    desk.worker.finish(result)
    told = desk.told()
    assert told["fault"] == (result.fault or result.refusal)
    assert (told["is_busy"], desk.active_id) == (False, BASE)
    desk.restart()
    assert desk.worker.jobs == []  # it would fail again; another ticket is another fit


def test_what_cannot_teach_is_refused_in_words(desk: TicketBench) -> None:
    assert refusal_of(desk, replace(desk.stated(1), at="2020-01-01T00:00:00Z")) == WeightRefusal.NO_EPOCH
    assert refusal_of(desk, replace(desk.stated(1), payload_kg=9000.0)) == WeightRefusal.IMPOSSIBLE_WEIGHT
    desk.add(1)
    assert refusal_of(desk, desk.stated(1, payload_kg=280.0)) == WeightRefusal.TOO_MANY


def test_a_load_whose_batches_are_gone_cannot_teach(desk: TicketBench) -> None:
    for entry in desk.bench.shelf.entries():
        desk.bench.shelf.remove(entry.id)
    assert refusal_of(desk, desk.stated(1)) == WeightRefusal.NOT_KEPT


def test_a_disk_that_refuses_keeps_no_ticket(desk: TicketBench) -> None:
    (desk.directory / ".tickets.json.new").mkdir()
    assert refusal_of(desk, desk.stated(1)) == WeightRefusal.NOT_STORED


def test_where_the_calibration_came_by_file_tickets_are_refused(tmp_path: Path) -> None:
    made = TicketBench(tmp_path)
    made.bench.desk.undo("workshop", to_factory=True)
    assert refusal_of(made, made.stated(1)) == WeightRefusal.NOT_COMMISSIONED
    assert (made.told()["is_possible"], "campaign at a desk" in made.told()["why_not"]) == (False, True)
    made.store.close()


@pytest.mark.parametrize("content", ["{", "[]", '{"tickets": [{"id": 1}]}'])
def test_a_file_that_cannot_be_believed_is_set_aside(desk: TicketBench, content: str) -> None:
    (desk.directory / "tickets.json").write_text(content)
    desk.restart()
    assert "set aside as tickets.json.broken-" in str(desk.desk.fault)
    desk.add(1)
    assert desk.desk.fault is None
