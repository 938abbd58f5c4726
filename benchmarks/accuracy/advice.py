"""Does the plan's advice help? Tested on a campaign whose next runs were already driven.

From every triple of the empty run and two loads at different positions, each remaining run in turn is taken as the
fourth; the plan chooses among them knowing the triple alone. All choices are judged on the same batches, the validation
part of all runs.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from benchmarks.accuracy.markdown import number, page, table
from gateway.calibration.inspection.log import SplitRun
from gateway.calibration.judgement.evaluation import errors_of, judge
from gateway.calibration.judgement.learning_curve import calibrated_on, triples_at_different_positions
from gateway.calibration.plan.design import Design
from gateway.calibration.plan.loads import PlacedLoad, weighed_loads
from gateway.calibration.plan.plan import usual_drive
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.cargo import shape_prior
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.predicted import Drive, predicted
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationImpossibleError

Errors = tuple[float, float]  # mean |error| of payload and front share, percent (12)
ESTIMATOR: Final = "cross_spectrum"
LEAST_RUNS: Final = 5  # three, and two to choose from
BATCH_S: Final = 300.0  # BatchSettings.window_s
ADVICE_ROWS: Final = (
    ("before", "three runs"),
    ("advised", "and the fourth that the plan advises"),
    ("others", "and another fourth, on average"),
    ("least", "and the fourth that the plan calls least useful"),
    ("best", "best fourth by hindsight"),
    ("worst", "worst fourth by hindsight"),
)
OnFit = Callable[[int, int], None]  # (calibrations done, calibrations in all)
Scored = tuple[Errors, Errors]  # with misses, and of what was answered


@dataclass(frozen=True, slots=True)
class Choice:
    """One set of runs driven so far and every run that could follow it.

    ``before`` and ``after`` (by the run's number) are errors over the same batches; ``advised`` and ``least`` are the
    runs with the largest and the smallest expected benefit. ``expected`` is the error that the plan predicts over the
    vehicle's loads before any of them.
    """

    numbers: tuple[int, ...]
    advised: int
    least: int
    expected: Errors
    before: Errors
    after: Mapping[int, Errors]


def advice_of(
    split: Sequence[SplitRun], vehicle: Vehicle, *, name: str, on_fit: OnFit = lambda done, of: None
) -> dict[str, Any]:
    """Errors with and without the advice, over runs without a fault: ``compared`` twice.

    ``with_misses`` counts a rejected batch as a mid-range answer; ``answered`` leaves it out, which favours a
    calibration that refuses many.

    Raises CalibrationImpossibleError if there is no such triple with runs to choose from.
    """
    runs = [one.identification for one in split]
    triples = triples_at_different_positions(runs, vehicle)
    if not triples or len(runs) < LEAST_RUNS:
        raise CalibrationImpossibleError(
            "needs an empty run, loads at two positions or more and five runs in all, so as to have a choice"
        )
    tried = _Tried(split, vehicle, on_fit, _n_calibrations(triples, [run.number for run in runs]))
    choices = [tried.choice(triple) for triple in triples]
    with_misses, answered = (compared([choice[which] for choice in choices]) for which in (0, 1))
    return {"campaign": name, "with_misses": with_misses, "answered": answered}


def _n_calibrations(triples: Sequence[tuple[int, ...]], numbers: Sequence[int]) -> int:
    """The number of triples and of different quadruples made of them."""
    fours = {frozenset((*triple, number)) for triple in triples for number in numbers if number not in triple}
    return len(triples) + len(fours)


class _Tried:
    """The calibrations made so far, each computed once."""

    def __init__(self, split: Sequence[SplitRun], vehicle: Vehicle, on_fit: OnFit, n_fits: int) -> None:
        self._split = {one.identification.number: one for one in split}
        self._vehicle = vehicle
        self._on_fit, self._n_fits = on_fit, n_fits
        self._made: dict[frozenset[int], tuple[CalibratedVehicle, Scored]] = {}

    def choice(self, numbers: tuple[int, ...]) -> tuple[Choice, Choice]:
        """The runs that could follow these, once with misses and once over answered batches."""
        calibrated, before = self._calibrated(numbers)
        advised, least, expected = self._advice(numbers, calibrated)
        after = {number: self._calibrated((*numbers, number))[1] for number in self._split if number not in numbers}
        both = [
            Choice(
                numbers,
                advised,
                least,
                expected,
                before[which],
                {number: errors[which] for number, errors in after.items()},
            )
            for which in (0, 1)
        ]
        return both[0], both[1]

    def _advice(self, numbers: tuple[int, ...], calibrated: CalibratedVehicle) -> tuple[int, int, Errors]:
        """The remaining runs with the largest and the smallest expected benefit, and the error predicted so far."""
        found = calibrated.cross_spectrum
        if found is None:
            raise ValueError("a study of the advice needs the cross-spectral calibration")
        drive = usual_drive([self._split[number].identification for number in numbers])
        design = Design(self._vehicle, found.parameters, drive, weighed_loads(self._vehicle))
        number_of = {
            PlacedLoad(one.identification.payload_kg, None, one.identification.front_share_pct): number
            for number, one in self._split.items()
            if number not in numbers
        }
        loads = list(number_of)
        return (
            number_of[design.best(found.covariance, loads)],
            number_of[design.worst(found.covariance, loads)],
            expected_of(found, self._vehicle, drive.speed_mps),
        )

    def _calibrated(self, numbers: tuple[int, ...]) -> tuple[CalibratedVehicle, Scored]:
        key = frozenset(numbers)
        if key not in self._made:
            runs = [self._split[number].identification for number in sorted(numbers)]
            calibrated = calibrated_on(runs, self._vehicle, ESTIMATOR)
            self._made[key] = calibrated, self._scored(calibrated)
            self._on_fit(len(self._made), self._n_fits)
        return self._made[key]

    def _scored(self, calibrated: CalibratedVehicle) -> Scored:
        judged = judge((one.validation for one in self._split.values()), calibrated, ESTIMATOR)
        errors = errors_of(judged, self._vehicle)
        payload, share = errors.payload, errors.front_share
        return (
            (_or_nan(payload.mean_abs_pct_with_misses), _or_nan(share.mean_abs_pct_with_misses)),
            (_or_nan(payload.mean_abs_pct), _or_nan(share.mean_abs_pct)),
        )


def expected_of(found: CrossSpectrumCalibration, vehicle: Vehicle, speed_mps: float) -> Errors:
    """Mean |error| (12) of Gaussian errors with the variances that the service would state, over all loads."""
    prior = shape_prior(vehicle, *found.known_shape)
    drive = Drive(BATCH_S, speed_mps)
    stated = [predicted(found, prior, placed.load, drive).covariance for placed in weighed_loads(vehicle)]
    payload_std_kg, share_std_pct = np.sqrt(np.mean([np.diag(one)[:2] for one in stated], axis=0)).tolist()
    (low_kg, high_kg), (low_pct, high_pct) = vehicle.payload_range_kg, vehicle.front_share_range_pct
    mean_of_std = 100.0 * math.sqrt(2.0 / math.pi)
    return mean_of_std * payload_std_kg / (high_kg - low_kg), mean_of_std * share_std_pct / (high_pct - low_pct)


def _or_nan(x: float | None) -> float:
    return float("nan") if x is None else x


def compared(choices: Sequence[Choice]) -> dict[str, Any]:
    """Means over all choices, of payload and front share; None without an answer. Raises ValueError without any choice.

    ``others`` is the mean of the runs not advised, the expectation without advice; ``best`` and ``worst`` are known in
    hindsight, by the sum of both errors. better_share (0..1): how often the advised run was better than the mean of the
    others.
    """
    if not choices:
        raise ValueError("nothing to compare: no runs could follow")
    advised = _rows([choice.after[choice.advised] for choice in choices])
    others = _rows([_mean([errors for n, errors in choice.after.items() if n != choice.advised]) for choice in choices])
    by_hindsight = [sorted(choice.after.values(), key=_both) for choice in choices]
    errors_of: dict[str, Any] = {
        "expected": [choice.expected for choice in choices],
        "before": [choice.before for choice in choices],
        "advised": advised,
        "others": others,
        "least": [choice.after[choice.least] for choice in choices],
        "best": [ordered[0] for ordered in by_hindsight],
        "worst": [ordered[-1] for ordered in by_hindsight],
        "better_share": advised < others,
    }
    return {"n_choices": len(choices), **{name: _mean(errors) for name, errors in errors_of.items()}}


def _both(errors: Errors) -> float:
    """Sum of both errors, for sorting; infinite without an answer."""
    return sum(errors) if np.isfinite(errors).all() else float("inf")


def _rows(errors: Any) -> np.ndarray:
    return np.asarray(errors, dtype=float).reshape(-1, 2)


def _mean(errors: Any) -> tuple[float | None, float | None]:
    """Mean of each column over answered batches; None without any."""
    payload, share = (
        float(np.mean(known)) if (known := column[np.isfinite(column)]).size else None for column in _rows(errors).T
    )
    return payload, share


def advice_page(found: Mapping[str, Any]) -> str:
    """The page in Markdown, from the numbers of ``advice_of``."""
    missed, answered = found["with_misses"], found["answered"]
    return page(
        "Does the plan's advice help?",
        "advice CAMPAIGN.toml --output DIR",
        f"From each of {missed['n_choices']} triples of runs (the empty one, and two loads at different positions) "
        "every other run of the campaign is taken as the fourth, and the plan, knowing the triple alone, says "
        "which it would drive. Judged on the validation part of all runs, the same batches for every choice. Mean "
        "|error| (12) of payload and of share, cross spectrum: once with every rejected batch counted as a "
        "mid-range answer, once over answered batches only. The second flatters whoever refuses the hard ones, so "
        "the first decides. What the plan itself expects after three runs, of the loads the vehicle may carry, "
        f"is a mean |error| of {' and '.join(_pair(answered['expected']))} %: "
        "cautious where it lies above what was found.",
        "",
        *table(
            ("Calibrated on", "Payload %", "Share %", "Payload %, answered", "Share %, answered"),
            [
                *([what, *_pair(missed[key]), *_pair(answered[key])] for key, what in ADVICE_ROWS),
                ["the advised one beats the average of the others", *_often(missed), *_often(answered)],
            ],
        ),
        "",
        on=f" on the campaign of the vehicle `{found['campaign']}`",
    )


def _pair(errors: Sequence[float | None]) -> list[str]:
    return [number(str(i))({str(i): x}) for i, x in enumerate(errors)]


def _often(comparison: Mapping[str, Any]) -> list[str]:
    return [f"{'none' if x is None else f'{100.0 * x:.0f} %'} of triples" for x in comparison["better_share"]]
