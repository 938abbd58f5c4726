"""Calibrates the ratio index: bands found on the campaign, then the static regression (9), (10), (11).

Bands and terms are chosen by errors on runs left out. The least of many such errors flatters, for the runs
left out took part in the choice. The nested error does not: there the whole choice is made anew without
the run that is then judged. By it the families of structures are compared, and the spread of an answer
is widened where it demands so.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.special import stdtrit

from gateway.calibration.known_run import KnownRun
from gateway.calibration.ratio_index.band_map import BandMap, band_maps
from gateway.calibration.ratio_index.choice import (
    TARGETS,
    BandChoice,
    Choice,
    Pairs,
    candidates,
    choose,
    indexes,
    n_answered,
    truth,
)
from gateway.calibration.ratio_index.structures import FAMILIES, Family, StructureChoice
from gateway.calibration.ratio_index.table import IndexTable, index_table
from gateway.core.ratio_index.index import RatioIndexCalibration, SpectrumKind
from gateway.core.ratio_index.regression import RegressionModel
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationImpossibleError
from gateway.records import F64, Batch

N_SEGMENT: Final = 1024  # 20.5 s at 50 Hz: resolves 0.05 Hz and still fits between two traffic lights
SPEED_STD_FACTOR: Final = 2.0  # a batch's speed may spread this many times as much as the widest calibrated
MOST: Final = 0.8  # quantile of nested errors that a spread must allow for; the rest may lie far outside the loads seen


@dataclass(frozen=True, slots=True)
class NestedErrors:
    """Of batches of runs that took no part in any choice, (2, n), payload and front share; NaN where none is told.

    error is estimate less truth, in kg and percentage points; std is what the fold's own model stated.
    """

    error: F64
    std: F64

    @property
    def rms(self) -> tuple[float, float]:
        """Root mean square of either target; NaN where one batch or more got no answer."""
        found = np.sqrt(np.mean(self.error**2, axis=1))
        return float(found[0]), float(found[1])


@dataclass(frozen=True, slots=True)
class FamilyTrial:
    """The best bands for one family of structures, and how such a choice fares on runs unseen."""

    family: Family
    choice: Choice
    nested: NestedErrors


@dataclass(frozen=True, slots=True)
class RatioIndexFit:
    """The calibration and what stands behind it.

    payload_errors_kg and front_share_errors_pct (n,) are the nested errors of the family chosen, batches in
    the order of ``table``; where so few runs allow none, those of the regression alone, bands given.
    ``trials`` are all families, the chosen one first; ``band_maps`` hold what every band could tell.
    """

    calibration: RatioIndexCalibration
    payload_errors_kg: F64 | None
    front_share_errors_pct: F64 | None
    n_runs: int
    n_batches: int
    table: IndexTable
    trials: tuple[FamilyTrial, ...]
    band_maps: tuple[BandMap, ...] = ()

    @property
    def chosen(self) -> FamilyTrial:
        """The family whose choice errs least on runs unseen."""
        return self.trials[0]


def fit_ratio_index(
    runs: Sequence[KnownRun],
    vehicle: Vehicle,
    kind: SpectrumKind = "amplitude",
    *,
    bands: BandChoice = "campaign",
    structure: StructureChoice = "auto",
) -> RatioIndexFit:
    """Identification runs -> calibration. Raises CalibrationImpossibleError where they cannot carry one."""
    table = index_table(runs, kind, N_SEGMENT)
    families = FAMILIES if structure == "auto" else (structure,)
    trials = _family_trials(table, vehicle, bands, families)
    chosen = trials[0]
    models = [
        _widened(tried.fitted.model, chosen.nested, row) if tried else None
        for row, tried in enumerate(chosen.choice.tried)
    ]
    errors = [_errors(chosen, row) for row in range(2)]
    batches = [batch for run in runs for batch in run.batches if not batch.rejected]
    speeds = [batch.mean_speed_mps for batch in batches]
    of_a, of_g = chosen.choice.pairs
    return RatioIndexFit(
        RatioIndexCalibration(
            spectrum=kind,
            n_segment=N_SEGMENT,
            acceleration_bands=of_a.bands if of_a else None,
            pitch_rate_bands=of_g.bands if of_g else None,
            payload=models[0],
            front_share=models[1],
            speed_range_mps=(min(speeds), max(speeds)),
            speed_std_max_mps=SPEED_STD_FACTOR * max(_speed_std_mps(batch) for batch in batches),
        ),
        payload_errors_kg=errors[0],
        front_share_errors_pct=errors[1],
        n_runs=table.n_runs,
        n_batches=len(table.run),
        table=table,
        trials=trials,
        band_maps=band_maps(table),
    )


def _family_trials(
    table: IndexTable, vehicle: Vehicle, bands: BandChoice, families: Sequence[Family]
) -> tuple[FamilyTrial, ...]:
    """Every family these runs can carry, the best first: most targets told, then least nested error."""
    _check(table)
    found = candidates(table, bands)
    choices = {family: choose(table, found, family, vehicle) for family in families}
    carried = {family: choice for family, choice in choices.items() if choice is not None}
    if not carried:
        raise CalibrationImpossibleError(
            f"no regression ({', '.join(families)}) can be made of {table.n_runs} runs with {table.n_loads} payloads "
            f"and {table.n_shares} front shares: drive another known load"
        )
    nested = _nested(table, vehicle, bands, tuple(carried))
    trials = [FamilyTrial(family, choice, nested[family]) for family, choice in carried.items()]
    return tuple(sorted(trials, key=lambda trial: _rank(trial, vehicle)))


def _rank(trial: FamilyTrial, vehicle: Vehicle) -> tuple[int, bool, float]:
    spans = [high - low for low, high in (vehicle.payload_range_kg, vehicle.front_share_range_pct)]
    told = [tried is not None for tried in trial.choice.tried]
    score = sum((rms / span) ** 2 for rms, span, is_told in zip(trial.nested.rms, spans, told, strict=True) if is_told)
    is_nested = bool(np.isfinite(score))
    return -n_answered(trial.choice), not is_nested, score if is_nested else trial.choice.score


def _check(table: IndexTable) -> None:
    if table.n_loads < 2:
        raise CalibrationImpossibleError(
            "the ratio index needs runs with at least two different payloads; all of these carry "
            f"{table.payload_kg[0]:g} kg: drive the vehicle empty and loaded"
        )
    if table.n_runs < 3:
        raise CalibrationImpossibleError(
            f"the ratio index needs at least three runs, there are {table.n_runs}: drive another known load"
        )


def _nested(
    table: IndexTable, vehicle: Vehicle, bands: BandChoice, families: Sequence[Family]
) -> dict[Family, NestedErrors]:
    """For each run, bands and terms of every family chosen and fitted on the others, then held against it."""
    blank = np.full((2, len(table.run)), np.nan)
    nested = {family: NestedErrors(blank.copy(), blank.copy()) for family in families}
    for number in np.unique(table.run):
        out = table.run == number
        rest, left = table.rows(~out), table.rows(out)
        if rest.n_loads < 2:
            continue
        try:
            found = candidates(rest, bands)
        except CalibrationImpossibleError:
            continue
        for family in families:
            choice = choose(rest, found, family, vehicle)
            for row, tried in enumerate(choice.tried if choice else ()):
                if choice is not None and tried is not None:
                    predicted, std = _predicted(tried.fitted.model, left, choice.pairs)
                    nested[family].error[row, out] = predicted - truth(left, TARGETS[row])
                    nested[family].std[row, out] = std
    return nested


def _predicted(model: RegressionModel, table: IndexTable, pairs: Pairs) -> tuple[F64, F64]:
    told = [model.predict(float(ra), float(rg))[:2] for ra, rg in zip(*indexes(table, pairs), strict=True)]
    centre, std = np.array(told).T
    return centre, std


def _widened(model: RegressionModel, nested: NestedErrors, row: int) -> RegressionModel:
    """The model with a spread that four fifths of the nested errors bear out; never a smaller one."""
    z = np.abs(nested.error[row] / nested.std[row])
    if not np.all(np.isfinite(z)):
        return model
    expected = float(stdtrit(model.dof, 0.5 + MOST / 2.0))
    return replace(model, residual_std=model.residual_std * max(1.0, float(np.quantile(z, MOST)) / expected))


def _errors(trial: FamilyTrial, row: int) -> F64 | None:
    tried = trial.choice.tried[row]
    if tried is None:
        return None
    nested: F64 = trial.nested.error[row]
    return nested if np.all(np.isfinite(nested)) else tried.fitted.held_out_errors


def _speed_std_mps(batch: Batch) -> float:
    return float(np.std(batch.speed_mps[batch.usable]))
