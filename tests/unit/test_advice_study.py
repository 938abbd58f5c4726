"""What an advice is held against: every other run that could have come next, over the same batches."""

import math
from collections.abc import Sequence
from dataclasses import replace

import pytest
from support.half_car_road import VAN
from support.known_runs import campaign, split_run

from benchmarks.accuracy import advice
from benchmarks.accuracy.advice import Choice, advice_of, advice_page, compared
from gateway.calibration.half_car.fit import calibrate_cross_spectrum
from gateway.calibration.inspection.log import SplitRun
from gateway.calibration.known_run import KnownRun
from gateway.calibration.plan.loads import weighed_loads
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationImpossibleError
from gateway.records import Why

CHOICES = [
    Choice(
        (1, 2, 3),
        advised=4,
        least=5,
        expected=(7.0, 5.0),
        before=(9.0, 8.0),
        after={4: (2.0, 3.0), 5: (8.0, 6.0), 6: (4.0, 2.0)},
    ),
    Choice(
        (1, 2, 5),
        advised=3,
        least=6,
        expected=(9.0, 7.0),
        before=(7.0, 6.0),
        after={3: (5.0, 5.0), 4: (1.0, 1.0), 6: (6.0, 9.0)},
    ),
]


def test_the_comparison_by_hand() -> None:
    found = compared(CHOICES)
    assert found["n_choices"] == 2
    assert found["expected"] == (8.0, 6.0)
    assert found["before"] == (8.0, 7.0)
    assert found["advised"] == (3.5, 4.0)
    assert found["others"] == pytest.approx(((6.0 + 3.5) / 2, (4.0 + 5.0) / 2))
    assert found["least"] == (7.0, 7.5)
    assert found["best"] == (1.5, 2.0)  # (2, 3) before (4, 2): the smaller sum
    assert found["worst"] == (7.0, 7.5)
    assert found["better_share"] == (0.5, 0.5)
    assert "each of 2 triples" in advice_page({"campaign": "van", "with_misses": found, "answered": found})


def test_a_choice_that_answered_nothing_is_worst_by_hindsight_and_in_no_mean() -> None:
    silent = (math.nan, math.nan)
    found = compared([Choice((1, 2), 3, 4, (1.0, 1.0), (5.0, 5.0), {3: (2.0, 2.0), 4: silent, 5: (6.0, 4.0)})])
    assert found["best"] == (2.0, 2.0)
    assert found["others"] == (6.0, 4.0)


def test_nothing_to_choose_from_is_said() -> None:
    with pytest.raises(ValueError, match="no runs could follow"):
        compared([])


def unanswerable(split: SplitRun) -> SplitRun:
    """Its validation part is nothing but gaps."""
    (batch,) = split.validation.batches
    return replace(split, validation=replace(split.validation, batches=(replace(batch, rejected=(Why.GAP,)),)))


def test_every_set_of_runs_is_calibrated_once_and_from_identification_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    loads = [(0.0, None), (200.0, 0.5), (300.0, 0.5), (250.0, 0.5), (400.0, 2.6)]
    split = [unanswerable(split_run(number, *load)) for number, load in enumerate(loads, 1)]
    known = calibrate_cross_spectrum([split[0].identification], VAN)
    given: list[tuple[KnownRun, ...]] = []

    def stand_in(runs: Sequence[KnownRun], vehicle: Vehicle, estimator: str) -> CalibratedVehicle:
        given.append(tuple(runs))
        return CalibratedVehicle("always", vehicle, (0.0, 400.0), (40.0, 60.0), cross_spectrum=known)

    monkeypatch.setattr(advice, "calibrated_on", stand_in)
    monkeypatch.setattr(advice, "weighed_loads", lambda vehicle: weighed_loads(vehicle)[::10])  # a coarser grid
    steps: list[tuple[int, int]] = []
    found = advice_of(split, VAN, name="van", on_fit=lambda done, of: steps.append((done, of)))
    identification = {one.identification.number: one.identification for one in split}
    assert all(run is identification[run.number] for runs in given for run in runs)
    numbers = [tuple(run.number for run in runs) for runs in given]
    assert len(set(numbers)) == len(numbers) == 3 + 3  # triples; quadruples that follow from them
    assert steps[-1] == (6, 6)
    assert found["with_misses"]["n_choices"] == 3
    assert found["with_misses"]["advised"] == found["with_misses"]["worst"] == found["with_misses"]["before"]
    assert found["with_misses"]["before"][0] == pytest.approx(
        100.0 * (225 + 25 + 75 + 25 + 175) / 5 / 450
    )  # mid-range answers
    assert found["answered"]["expected"] == found["with_misses"]["expected"]
    assert 0.0 < found["answered"]["expected"][0] < 100.0
    assert found["answered"]["before"] == (None, None)


def test_too_few_runs_leave_no_choice() -> None:
    with pytest.raises(CalibrationImpossibleError, match="five runs"):
        advice_of(campaign(), VAN, name="van")
