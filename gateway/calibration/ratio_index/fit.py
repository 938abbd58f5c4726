"""Calibration of the ratio index: bands chosen on the campaign, then the static regression (9), (10), (11).

Bands and terms are chosen by errors on runs left out. The least of many such errors is biased low, because the runs
left out took part in the choice. The nested error is not: it repeats the whole choice without the run that is then
judged. It ranks the families of structures, and widens the interval of an answer if necessary.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway.calibration.known_run import KnownRun
from gateway.calibration.ratio_index.bands import BandChoice, Pairs, candidates
from gateway.calibration.ratio_index.choice import TERMS_OF, Choice, Family, StructureChoice, choose, spans_of
from gateway.calibration.ratio_index.table import N_SEGMENT, SPECTRUM, SpectrumTable, spectrum_table
from gateway.core.late import special
from gateway.core.ratio_index.index import RatioIndexCalibration
from gateway.core.ratio_index.regression import RegressionModel
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationImpossibleError
from gateway.records import F64, Bool

SPEED_STD_FACTOR: Final = 2.0  # chosen: largest speed spread of a batch, over the largest calibrated
MOST: Final = 0.8  # chosen: quantile of nested errors within the interval; the rest may be far outside the known loads

Models = Sequence[RegressionModel | None]  # of payload and of front share
Fold = tuple[Bool, SpectrumTable, list[Pairs]]  # batches left out (n,), the others, and candidate bands for these


@dataclass(frozen=True, slots=True)
class FamilyTrial:
    """The best bands for one family of structures, and the errors of such a choice on unseen runs.

    ``without`` has the choice repeated without each run, by the run's number. Its error (estimate minus truth, kg and
    percentage points) and stated standard deviation on the batches of that run: nested_error and nested_std (2, n),
    payload and front share; NaN without an answer.
    """

    choice: Choice
    without: Mapping[int, Choice]
    nested_error: F64
    nested_std: F64

    @property
    def nested_rms(self) -> tuple[float, float]:
        """Root mean square of either target's nested error; NaN if a batch got no answer."""
        payload_kg, share_pct = np.sqrt(np.mean(self.nested_error**2, axis=1)).tolist()
        return payload_kg, share_pct


@dataclass(frozen=True, slots=True)
class RatioIndexFit:
    """The calibration and its evidence.

    ``without`` has, by run number, the calibration without that run: bands and terms chosen again, or if too few runs
    allow that, the same ones fitted again. payload_errors_kg and front_share_errors_pct (n,) are its errors, batches in
    the order of ``table``. Its intervals are widened as all runs require. ``trials`` are all families, the chosen one
    first.
    """

    calibration: RatioIndexCalibration
    without: Mapping[int, RatioIndexCalibration]
    payload_errors_kg: F64 | None
    front_share_errors_pct: F64 | None
    table: SpectrumTable
    trials: tuple[FamilyTrial, ...]

    @property
    def chosen(self) -> FamilyTrial:
        """The family with the least error on unseen runs."""
        return self.trials[0]


def fit_ratio_index(
    runs: Sequence[KnownRun],
    vehicle: Vehicle,
    *,
    bands: BandChoice = "campaign",
    structure: StructureChoice = "auto",
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> RatioIndexFit:
    """The calibration from identification runs. Raises CalibrationImpossibleError if they do not allow one.

    ``progress`` is called with (steps done, steps in all).
    """
    table = spectrum_table(runs, vehicle.sensor_left_m)
    trials = _family_trials(table, vehicle, bands, tuple(TERMS_OF) if structure == "auto" else (structure,), progress)
    chosen = trials[0]
    batches = [batch for run in runs for batch in run.batches if not batch.rejected]
    speeds_mps = [batch.mean_speed_mps for batch in batches]
    speed_stds_mps = [float(np.std(batch.speed_mps[batch.usable])) for batch in batches]
    blank = RatioIndexCalibration(
        spectrum=SPECTRUM,
        n_segment=N_SEGMENT,
        acceleration_bands=None,
        pitch_rate_bands=None,
        payload=None,
        front_share=None,
        speed_range_mps=(min(speeds_mps), max(speeds_mps)),
        speed_std_max_mps=SPEED_STD_FACTOR * max(speed_stds_mps),
        roll_lever_m=table.roll_lever_m,
    )
    models = chosen.choice.models
    widening = [_widening(model, chosen, target) for target, model in enumerate(models)]
    dof = table.n_runs - 1.0
    return RatioIndexFit(
        calibration=_calibration(blank, chosen.choice.pairs, models, widening, dof),
        without={
            number: _calibration(blank, pairs, others, widening, dof)
            for number, (pairs, others) in _models_without(chosen, table).items()
        },
        payload_errors_kg=_errors(chosen, 0),
        front_share_errors_pct=_errors(chosen, 1),
        table=table,
        trials=trials,
    )


def _family_trials(
    table: SpectrumTable,
    vehicle: Vehicle,
    bands: BandChoice,
    families: Sequence[Family],
    progress: Callable[[int, int], None],
) -> tuple[FamilyTrial, ...]:
    """Every family that these runs allow, the best first: most targets answered, then least nested error."""
    _check(table)
    pairs = candidates(table, bands)
    choices = [choice for family in families if (choice := choose(table, pairs, family, vehicle)) is not None]
    if not choices:
        raise CalibrationImpossibleError(
            f"no regression ({', '.join(families)}) can be made of {table.n_runs} runs with {table.n_loads} payloads "
            f"and {table.n_shares} front shares: drive another known load"
        )
    n_steps = table.n_runs + len(choices)
    folds: list[Fold] = []
    for done, fold in enumerate(_folds(table, bands), 1):
        folds += fold
        progress(done, n_steps)
    trials: list[FamilyTrial] = []
    for choice in choices:
        trials.append(_trial(table, folds, choice, vehicle))
        progress(table.n_runs + len(trials), n_steps)
    return tuple(sorted(trials, key=lambda trial: _rank(trial, vehicle)))


def _check(table: SpectrumTable) -> None:
    if table.n_loads < 2:
        raise CalibrationImpossibleError(
            "the ratio index needs runs with at least two different payloads; all of these carry "
            f"{table.targets[0][0]:g} kg: drive the vehicle empty and loaded"
        )
    if table.n_runs < 3:
        raise CalibrationImpossibleError(
            f"the ratio index needs at least three runs, there are {table.n_runs}: drive another known load"
        )


def _folds(table: SpectrumTable, bands: BandChoice) -> Iterator[list[Fold]]:
    """For each run the fold without it; empty if no bands can be chosen then."""
    for number in np.unique(table.run):
        folds: list[Fold] = []
        is_out = table.run == number
        rest = table.rows(~is_out)
        if rest.n_loads > 1:
            with suppress(CalibrationImpossibleError):
                folds.append((is_out, rest, candidates(rest, bands)))
        yield folds


def _trial(table: SpectrumTable, folds: Sequence[Fold], choice: Choice, vehicle: Vehicle) -> FamilyTrial:
    """For each run, bands and terms of the family chosen and fitted on the others, then compared with it."""
    error, std = np.full((2, 2, len(table.run)), np.nan)
    without: dict[int, Choice] = {}
    for is_out, rest, pairs in folds:
        again = choose(rest, pairs, choice.family, vehicle)
        if again is None:
            continue
        left = table.rows(is_out)
        without[int(left.number[0])] = again
        answer, std[:, is_out] = again.predict(left)
        error[:, is_out] = answer - np.array(left.targets)
    return FamilyTrial(choice, without, error, std)


def _rank(trial: FamilyTrial, vehicle: Vehicle) -> tuple[int, bool, float]:
    parts = zip(trial.nested_rms, spans_of(vehicle), trial.choice.answers, strict=True)
    score = sum((rms / span) ** 2 for rms, span, answers in parts if answers)
    is_nested = bool(np.isfinite(score))
    return -sum(trial.choice.answers), not is_nested, score if is_nested else trial.choice.score


def _widening(model: RegressionModel | None, trial: FamilyTrial, target: int) -> float | None:
    """Factor of the spread so that it covers four fifths of the nested errors; None without a model."""
    if model is None:
        return None
    z = np.abs(trial.nested_error[target] / trial.nested_std[target])
    if not np.all(np.isfinite(z)):
        return 1.0
    return max(1.0, float(np.quantile(z, MOST)) / float(special.stdtrit(model.dof, 0.5 + MOST / 2.0)))


def _models_without(trial: FamilyTrial, table: SpectrumTable) -> dict[int, tuple[Pairs, Models]]:
    """By run number, bands and regressions without that run."""
    choice = trial.choice
    if np.isfinite(trial.nested_error[list(choice.answers)]).all():
        return {number: (again.pairs, again.models) for number, again in trial.without.items()}
    places = dict(zip(table.number.tolist(), table.run.tolist(), strict=True))
    return {
        number: (choice.pairs, [one.without[place] if one else None for one in choice.regressions])
        for number, place in places.items()
    }


def _calibration(
    blank: RatioIndexCalibration, pairs: Pairs, models: Models, widening: Sequence[float | None], dof: float
) -> RatioIndexCalibration:
    of_a, of_g = pairs
    payload, front_share = (
        replace(model, residual_std=model.residual_std * factor, dof=dof) if model and factor else None
        for model, factor in zip(models, widening, strict=True)
    )
    return replace(
        blank,
        acceleration_bands=of_a.bands if of_a else None,
        pitch_rate_bands=of_g.bands if of_g else None,
        payload=payload,
        front_share=front_share,
    )


def _errors(trial: FamilyTrial, target: int) -> F64 | None:
    regression = trial.choice.regressions[target]
    if regression is None:
        return None
    nested: F64 = trial.nested_error[target]
    return nested if np.all(np.isfinite(nested)) else regression.held_out_errors
