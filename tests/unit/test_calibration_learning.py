"""The learning curve of a report: every number of runs, what was not tried left out."""

import numpy as np

from gateway.calibration.judgement.learning_curve import LearningCurve, Score, Trial
from gateway.reports.calibration.learning import learning_section
from gateway.reports.charts import Points
from gateway.reports.charts.live import plotly_json

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
