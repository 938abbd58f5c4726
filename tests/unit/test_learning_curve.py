"""Learning curves: which runs are left out, that a trial knows nothing of them, and what a report shows."""

from collections.abc import Sequence
from math import comb

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.calibrated import ratio_index_calibration
from support.half_car_road import VAN
from support.known_runs import campaign

from gateway.calibration.judgement import learning_curve
from gateway.calibration.judgement.learning_curve import (
    LearningCurve,
    Score,
    Trial,
    curve_of,
    spread_of,
    subsets_to_drive,
    trial_of,
    triples_at_different_positions,
)
from gateway.calibration.known_run import KnownRun
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.vehicle import Vehicle, front_share_pct
from gateway.errors import CalibrationImpossibleError
from gateway.reports.calibration.learning import learning_section
from gateway.reports.charts import Points
from gateway.reports.charts.live import plotly_json


def run(number: int, payload_kg: float, position_m: float | None = None) -> KnownRun:
    return KnownRun(number, f"{number}.log", payload_kg, front_share_pct(VAN, payload_kg, position_m), ())


TEN = [run(1, 0.0), *(run(2 + i, (120.0, 270.0, 420.0)[i // 3], (0.5, 1.3, 2.8)[i % 3]) for i in range(9))]


@given(st.integers(1, 10), st.integers(1, 12), st.integers(0, 99))
def test_subsets_hold_the_empty_run_and_repeat_nothing(n_runs: int, most: int, seed: int) -> None:
    found = subsets_to_drive(TEN, n_runs, most, seed)
    assert len(found) == min(most, comb(9, n_runs - 1))
    assert len(set(found)) == len(found)
    assert all(len(set(subset)) == n_runs and subset[0] == 1 for subset in found)
    assert found == subsets_to_drive(TEN[::-1], n_runs, most, seed)


def test_more_runs_than_there_are_make_no_subset() -> None:
    assert subsets_to_drive(TEN, 11, 5, 1) == []
    assert subsets_to_drive(TEN[1:3], 1, 5, 1) == [(2,), (3,)]  # no empty run: any


def test_the_triples_are_the_27_with_two_positions() -> None:
    found = triples_at_different_positions(TEN, VAN)
    assert len(found) == 27
    assert (1, 2, 5) not in found  # both at 0.5 m
    assert (1, 2, 3) in found
    assert triples_at_different_positions(TEN[1:], VAN) == []


def score(payload_pct: float | None, share_pct: float | None, n_rejected: int = 0) -> Score:
    return Score(4, n_rejected, payload_pct, 1.0, share_pct, None)


def test_a_spread_counts_each_trial_once_and_leaves_out_what_was_not_answered() -> None:
    found = spread_of([score(2.0, 1.0), score(6.0, None, n_rejected=2), score(None, None, n_rejected=4)])
    assert (found.n_trials, found.rejected_share) == (3, 0.5)
    assert (found.payload_mean_pct, found.payload_std_pct, found.payload_worst_pct) == (4.0, 2.0, 6.0)
    assert (found.front_share_mean_pct, found.front_share_worst_pct) == (1.0, 1.0)
    assert found.front_share_coverage95 is None
    assert spread_of([]).payload_mean_pct is None


def test_a_rung_counts_calibrations_that_were_refused() -> None:
    trials = (
        Trial((1, 2), "ratio_index", refused="too few"),
        Trial((1, 3), "ratio_index", left_out=score(5.0, None), validation=score(4.0, None)),
    )
    (rung,) = LearningCurve("van", 1, trials, ()).rungs
    assert (rung.n_runs, rung.n_subsets, rung.n_refused) == (2, 2, 1)
    assert rung.left_out.payload_mean_pct == 5.0
    assert rung.validation.payload_mean_pct == 4.0


class Fits:
    """Stands in for the fits: remembers what they were given, answers 200 kg and 48 % always."""

    def __init__(self) -> None:
        self.given: list[tuple[KnownRun, ...]] = []

    def __call__(self, runs: Sequence[KnownRun], vehicle: Vehicle, estimator: str) -> CalibratedVehicle:
        self.given.append(tuple(runs))
        if len(runs) < 3:
            raise CalibrationImpossibleError("needs three runs")
        return CalibratedVehicle("always", vehicle, (0.0, 400.0), (45.0, 60.0), ratio_index_calibration())


@pytest.fixture
def fits(monkeypatch: pytest.MonkeyPatch) -> Fits:
    stand_in = Fits()
    monkeypatch.setattr(learning_curve, "calibrated_on", stand_in)
    return stand_in


def test_a_trial_is_given_its_own_identification_parts_alone(fits: Fits) -> None:
    split = campaign()
    trial = trial_of(split, VAN, (1, 3, 4), "ratio_index")
    assert fits.given == [tuple(split[i].identification for i in (0, 2, 3))]
    assert trial.left_out.n_batches == 2  # run 2: both its parts
    assert trial.validation.n_batches == 4
    assert trial.left_out.payload_mean_abs_pct == pytest.approx(0.0)  # run 2 carries 200 kg
    assert trial.validation.payload_mean_abs_pct == pytest.approx(100.0 * (200 + 0 + 100 + 200) / 4 / 450)


def test_a_curve_tries_every_size_and_every_triple_once(fits: Fits) -> None:
    steps: list[tuple[int, int]] = []
    curve = curve_of(
        campaign(), VAN, name="van", estimators=("ratio_index",), most_subsets=2,
        on_trial=lambda done, of: steps.append((done, of)),
    )  # fmt: skip
    assert [(rung.n_runs, rung.n_subsets, rung.n_refused) for rung in curve.rungs] == [(2, 2, 2), (3, 2, 0), (4, 1, 0)]
    assert [trial.numbers for trial in curve.triples] == [(1, 2, 3), (1, 2, 4), (1, 3, 4)]
    assert len({frozenset(one.number for one in runs) for runs in fits.given}) == len(fits.given) == 6
    assert steps[0] == (0, 6)
    assert steps[-1] == (6, 6)
    assert curve.rungs[2].left_out.n_trials == 0  # nothing is left out of four
    assert curve.rungs[2].validation.n_trials == 1
    assert curve.triple_rungs[0].n_subsets == 3
    assert "every triple" in learning_section(curve).tables[1].caption
    assert len(curve.to_json()["trials"]) == 6


def test_two_runs_make_no_curve() -> None:
    with pytest.raises(CalibrationImpossibleError, match="at least three runs"):
        curve_of(campaign()[:2], VAN, name="van")


def test_a_real_trial_weighs_what_it_never_saw() -> None:
    trial = trial_of(campaign(), VAN, (1, 2, 4), "cross_spectrum")
    assert trial.left_out.n_rejected == 0
    assert trial.left_out.payload_mean_abs_pct is not None
    assert trial.left_out.payload_mean_abs_pct < 6.0
    too_few = trial_of(campaign(), VAN, (1, 2), "ratio_index")
    assert too_few.left_out is None
    assert "three runs" in (too_few.refused or "")


SCORES = {2: (20.0, 30.0), 4: (8.0, 12.0)}


def trial(n_runs: int, first: int, error_pct: float, estimator: str = "ratio_index") -> Trial:
    numbers = tuple(range(first, first + n_runs))
    return Trial(numbers, estimator, Score(6, 0, error_pct, 0.9, error_pct / 2.0, 1.0))


def test_means_over_choices_of_runs_with_their_spread() -> None:
    trials = tuple(trial(n, i, error) for n, errors in SCORES.items() for i, error in enumerate(errors))
    refused = Trial((1,), "ratio_index", refused="one run is no scale")
    section = learning_section(LearningCurve("van", 1, (*trials, refused), ()))
    (chart,) = section.charts
    payload, share = (next(mark for mark in panel.marks if isinstance(mark, Points)) for panel in chart.panels)
    assert [chart.panels[0].x.places[int(at)] for at in payload.x] == ["2", "4"]
    assert payload.y.tolist() == [25.0, 10.0]
    assert payload.low is not None
    assert np.allclose(payload.y - payload.low, [5.0, 2.0])
    assert share.y.tolist() == [12.5, 5.0]
    assert plotly_json(chart)
    (table,) = section.tables
    assert [row[0] for row in table.rows] == ["2", "4"]  # judged on left-out runs alone, nothing for one run
    assert table.rows[0][4] == "25.0 ± 5.0 %"
    assert all(len(row) == len(table.columns) for row in table.rows)


def test_each_estimator_has_its_own_marks() -> None:
    trials = tuple(trial(n, 1, 10.0, name) for name in ("ratio_index", "cross_spectrum") for n in (2, 4))
    (chart,) = learning_section(LearningCurve("van", 1, trials, ())).charts
    marks = [mark for mark in chart.panels[0].marks if isinstance(mark, Points)]
    assert len({(mark.label, mark.colour, mark.marker) for mark in marks}) == 2
