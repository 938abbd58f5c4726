"""The result of statements does not depend on their order, and a withdrawn one leaves no trace."""

import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st
from support.learner import ANSWERS, LearnerBench, at

from gateway.calibration.learning.spans import standing
from gateway.stated.facts import VehicleAnswers
from gateway.stated.statement import StatementRecord

Told = dict[str, Any]


def _told(source: str, begin_s: int, kg: int, length_s: int | None, ref: int | None) -> Told:
    loads: Told = {
        "empty": {"payload_kg": 0},
        "delivery_note": {"payload_kg": kg},
        "scale": {"gross_kg": 1400 + kg},
        "axle_scales": {"front_axle_kg": 700 + kg / 3, "rear_axle_kg": 700 + kg},
        "known": {"change_kg": kg - 200},
    }
    until = None if length_s is None else at(begin_s + length_s)
    named = None if ref is None else f"LS-{ref}"
    return {"from": at(begin_s), "until": until, "source": source, "load": loads[source], "ref": named}


SAID = st.builds(
    _told,
    st.sampled_from(["empty", "delivery_note", "scale", "axle_scales", "known"]),
    st.integers(0, 40).map(lambda n: n * 300),
    st.integers(1, 600),
    st.none() | st.integers(1, 20).map(lambda n: n * 300),
    st.none(),
)


def records(told: list[Told]) -> list[StatementRecord]:
    return [StatementRecord.model_validate(one).identified() for one in told]


def bench_in(folder: str, told: list[Told]) -> LearnerBench:
    """A learner with three drives that was told these statements in this order."""
    bench = LearnerBench(Path(folder))
    bench.learner.van.state(VehicleAnswers(**ANSWERS), "workshop", is_confirmed=True)
    for begin_s in (0, 3600, 7200):
        bench.drive(begin_s)
    for one in records(told):
        bench.learner.loads.state(one, "workshop")
    return bench


def job_of(bench: LearnerBench) -> str:
    """The job that the learning process would get, without the folder of the files."""
    bench.turn()
    assert bench.worker.job is not None
    job = bench.worker.job.model_dump_json(by_alias=True)
    return job.replace(str(bench.directory), "")


@given(st.lists(SAID, max_size=6), st.randoms(use_true_random=False))
@settings(max_examples=40, deadline=None)
def test_the_order_of_arrival_does_not_matter(told: list[Told], draw: Any) -> None:
    shuffled = list(told)
    draw.shuffle(shuffled)
    with TemporaryDirectory() as one, TemporaryDirectory() as other:
        assert job_of(bench_in(one, told)) == job_of(bench_in(other, shuffled))


@given(st.lists(SAID, max_size=5), SAID, st.integers(0, 5))
@settings(max_examples=40, deadline=None)
def test_withdrawing_undoes_everything(told: list[Told], wrong: Told, place: int) -> None:
    gone = records([wrong])[0]
    others = [one for one in told if records([one])[0].id != gone.id]
    place = min(place, len(others))
    with TemporaryDirectory() as one, TemporaryDirectory() as other:
        bench = bench_in(one, [*others[:place], wrong, *others[place:]])
        bench.learner.loads.confirm(gone.id, "workshop")
        bench.learner.loads.withdraw(gone.id, "workshop")
        without = bench_in(other, others)
        assert job_of(bench) == job_of(without)
        shown = [item for item in json.loads(bench.learner.loads.page())["items"] if item["id"] != gone.id]
        assert shown == json.loads(without.learner.loads.page())["items"]


@given(st.lists(SAID, min_size=1, max_size=6))
def test_the_last_statement_of_a_ref_counts(told: list[Told]) -> None:
    made = [one.model_copy(update={"ref": "LS-1", "id": f"s-{i}"}) for i, one in enumerate(records(told))]
    assert standing(made) == [made[-1]]
