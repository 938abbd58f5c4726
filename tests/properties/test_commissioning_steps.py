"""Whatever people, drives, fits and power cuts do in whatever order: what is told was kept, and nothing is half."""

import json
import shutil
import tempfile
from pathlib import Path
from typing import Any

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule
from support.commissioning import ANSWERS, WINDOW_S, Bench, fitted

from gateway.calibration.commissioning.job import Result
from gateway.errors import RefusedError
from gateway.records import Why
from gateway.stated.commissioning import CommissioningState
from gateway.stated.facts import VehicleAnswers

ORDER = [None, "vehicle", "empty", "drive", "fit"]


class Commissioned(RuleBasedStateMachine):
    """A desk, and beside it how many windows were driven since the vehicle was called empty."""

    def __init__(self) -> None:
        super().__init__()
        self.folder = Path(tempfile.mkdtemp())
        self.bench = Bench(self.folder)
        self.n_windows = self.n_driven = 0

    def teardown(self) -> None:
        shutil.rmtree(self.folder)

    @property
    def told(self) -> dict[str, Any]:
        text = self.bench.desk.state()
        CommissioningState.model_validate_json(text)
        return json.loads(text)

    @property
    def step(self) -> str | None:
        underway = self.told["underway"]
        return None if underway is None else str(underway["step"])

    def asks(self, ask: str, *said: Any, **more: Any) -> bool:
        """Whether it was done; a refusal changes nothing."""
        before = self.told
        try:
            getattr(self.bench.desk, ask)(*said, **more)
        except RefusedError:
            assert self.told == before
            return False
        return True

    @rule()
    def begin(self) -> None:
        was = self.step
        if self.asks("begin", "workshop", None):
            assert was is None
            self.n_driven = 0

    @rule(wheelbase_m=st.sampled_from([2.5, 2.75, 3.0]))
    def state_vehicle(self, wheelbase_m: float) -> None:
        self.asks("state_vehicle", VehicleAnswers(**{**ANSWERS, "wheelbase_m": wheelbase_m}))

    @rule(front_kg=st.sampled_from([69.0, 690.0]))
    def state_weights(self, front_kg: float) -> None:
        if self.asks("state_vehicle", VehicleAnswers(**{**ANSWERS, "kerb_front_axle_kg": front_kg})):
            assert bool(self.told["underway"]["doubts"]) is (front_kg < 100.0)

    @rule()
    def confirm(self) -> None:
        self.asks("confirm", "workshop")

    @rule(again=st.booleans())
    def call_empty(self, again: bool) -> None:
        if self.asks("is_empty", "workshop", again=again) and again:
            self.n_driven = 0

    @rule()
    def fit_now(self) -> None:
        if self.asks("fit_now", "workshop"):
            assert self.n_driven > 0

    @rule()
    def cancel(self) -> None:
        if self.asks("cancel", "workshop"):
            self.n_driven = 0

    @rule(to_factory=st.booleans())
    def undo(self, to_factory: bool) -> None:
        self.asks("undo", "workshop", to_factory=to_factory)

    @rule(is_good=st.booleans(), is_open=st.booleans())
    def drive(self, is_good: bool, is_open: bool) -> None:
        underway = self.told["underway"]
        counts = underway is not None and underway["empty"] is not None
        self.n_windows += 1
        if is_open:
            self.bench.drive(self.n_windows, 60, is_provisional=True)
        self.bench.drive(self.n_windows, WINDOW_S, *(() if is_good else (Why.GAP,)))
        self.n_driven += counts and is_good

    @precondition(lambda self: self.bench.worker.job is not None)
    @rule(payload_std_kg=st.sampled_from([10.0, 90.0]), fails=st.booleans())
    def work(self, payload_std_kg: float, fails: bool) -> None:
        made = len(self.told["history"])
        self.bench.worker.finish(Result(fault="it failed") if fails else fitted(payload_std_kg))
        if len(self.told["history"]) > made:
            assert not fails
            self.n_driven = 0

    @rule()
    def cut_the_power(self) -> None:
        before = self.told
        self.bench = Bench(self.folder)
        self.bench.desk.start()
        after = self.told
        assert after["history"] == before["history"]
        assert after["active"] == before["active"]

    @invariant()
    def what_was_driven_is_there(self) -> None:
        underway = self.told["underway"]
        assert underway is None or underway["n_batches"] == self.n_driven

    @invariant()
    def what_is_held_can_be_read(self) -> None:
        for batch_id in self.bench.shelf.held_by("commissioning"):
            self.bench.shelf.read(batch_id)

    @invariant()
    def the_step_is_one_of_them(self) -> None:
        assert self.step in ORDER


TestCommissioned = Commissioned.TestCase
TestCommissioned.settings = settings(max_examples=15, stateful_step_count=25, deadline=None)
