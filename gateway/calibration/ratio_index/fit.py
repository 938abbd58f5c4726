"""Calibration of the ratio index: bands chosen on the campaign, then one static regression for each target.

On bands of its own a campaign gets a regression on both logarithms, on the bands of Table 2 the paper's (11); if it has
too few runs or sensors for these, the paper's (9) and (10). Bands are chosen by errors on runs left out. The least of
many such errors is biased low, because the runs left out took part in the choice. The nested error is not: it repeats
the choice without the run that is then judged. It widens the interval of an answer if necessary.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway.calibration.known_run import KnownRun
from gateway.calibration.ratio_index.bands import BandChoice, Pairs, candidates, indexes, ratios
from gateway.calibration.ratio_index.regression import (
    FittedRegression,
    fit_regression,
    held_out_errors,
    scaled_design,
    without_each_run,
)
from gateway.calibration.ratio_index.table import N_SEGMENT, SPECTRUM, SpectrumTable, spectrum_table
from gateway.core.late import special
from gateway.core.ratio_index.index import RatioIndexCalibration
from gateway.core.ratio_index.regression import (
    MODEL_9_PAYLOAD,
    MODEL_10_FRONT_SHARE,
    MODEL_11_FRONT_SHARE,
    MODEL_11_PAYLOAD,
    RegressionModel,
)
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationImpossibleError
from gateway.records import F64, Bool

SPEED_STD_FACTOR: Final = 2.0  # chosen: largest speed spread of a batch, over the largest calibrated
MOST: Final = 0.8  # chosen: quantile of nested errors within the interval; the rest may be far outside the known loads

Terms = tuple[tuple[str, ...], tuple[str, ...]]  # of payload, of front share
OWN_INDEX: Final[Terms] = (MODEL_9_PAYLOAD, MODEL_10_FRONT_SHARE)  # each target from its own index
STRUCTURE: Final[Mapping[BandChoice, Terms]] = {
    "campaign": (("log_ra", "log_rg"), ("log_ra", "log_rg")),  # ours: linear in both logarithms
    "table2": (MODEL_11_PAYLOAD, MODEL_11_FRONT_SHARE),
}

Models = Sequence[RegressionModel | None]  # of payload and of front share
Fold = tuple[Bool, SpectrumTable, list[Pairs]]  # batches left out (n,), the others, and candidate bands for these


@dataclass(frozen=True, slots=True)
class Choice:
    """Bands, and the regressions of payload and of front share on them, None if there is none."""

    pairs: Pairs
    regressions: tuple[FittedRegression | None, FittedRegression | None]

    @property
    def answers(self) -> tuple[bool, bool]:
        """Whether it has a regression of payload, and of front share."""
        return self.regressions[0] is not None, self.regressions[1] is not None

    @property
    def models(self) -> tuple[RegressionModel | None, RegressionModel | None]:
        """Of payload and of front share."""
        payload, front_share = self.regressions
        return payload.model if payload else None, front_share.model if front_share else None

    def predict(self, table: SpectrumTable) -> tuple[F64, F64]:
        """Answers and their standard deviations (2, n) for the table's batches; NaN where it has no regression."""
        shown = list(zip(*indexes(table, self.pairs), strict=True))
        found = np.full((2, len(shown), 2), np.nan)
        for target, model in enumerate(self.models):
            if model is not None:
                found[target] = [model.predict(float(ra), float(rg))[:2] for ra, rg in shown]
        return found[..., 0], found[..., 1]


def structure_of(table: SpectrumTable, bands: BandChoice) -> Terms:
    """The terms for a campaign; those of (9) and (10) if they answer more targets than the others."""
    wanted = STRUCTURE[bands]
    n_answered = [sum(bool(_terms(terms, target, table)) for target in (0, 1)) for terms in (wanted, OWN_INDEX)]
    return OWN_INDEX if n_answered[1] > n_answered[0] else wanted


def choose(table: SpectrumTable, candidates: Sequence[Pairs], terms: Terms, vehicle: Vehicle) -> Choice | None:
    """The bands among the candidates with the least error on runs left out, and the regressions on them.

    None if these runs do not allow a regression.
    """
    scores = _scores(table, candidates, terms, vehicle)
    best = int(np.argmin(scores))
    if not np.isfinite(scores[best]):
        return None
    ra, rg = indexes(table, candidates[best])
    payload, front_share = (
        fit_regression(named, ra, rg, known, table.run) if (named := _terms(terms, target, table)) else None
        for target, known in enumerate(table.targets)
    )
    return Choice(candidates[best], (payload, front_share))


def _terms(terms: Terms, target: int, table: SpectrumTable) -> tuple[str, ...]:
    """The terms of payload (target 0) or front share (1); none if the campaign is too small for them.

    A regression needs its sensors, two runs more than terms, and three different front shares if the share is the
    target or both indexes take part.
    """
    absent = {index for index, spectra in zip(("ra", "rg"), table.spectra, strict=True) if spectra is None}
    named = terms[target]
    used = {index for index in ("ra", "rg") if any(index in term for term in named)}
    needs_shares = target == 1 or len(used) > 1
    is_enough = table.n_runs >= len(named) + 2 and (table.n_shares >= 3 or not needs_shares)
    return named if is_enough and not used & absent else ()


def _spans(vehicle: Vehicle) -> tuple[float, float]:
    """The ranges of (12): payload in kg, front share in percentage points."""
    payload_kg, share_pct = vehicle.payload_range_kg, vehicle.front_share_range_pct
    return payload_kg[1] - payload_kg[0], share_pct[1] - share_pct[0]


def _scores(table: SpectrumTable, candidates: Sequence[Pairs], terms: Terms, vehicle: Vehicle) -> F64:
    """Mean square errors (c,) on runs left out with each of the candidate bands, as shares of the ranges of (12);
    infinite if nothing can be fitted.
    """
    ra, rg = (_ratios_of_all(table, candidates, sensor) for sensor in (0, 1))
    parts = []
    for target, (known, span) in enumerate(zip(table.targets, _spans(vehicle), strict=True)):
        if named := _terms(terms, target, table):
            columns, _, _ = scaled_design(named, ra, rg)
            errors = held_out_errors(columns, without_each_run(columns, known, table.run)[0], known, table.run)
            parts.append(np.mean((errors / span) ** 2, axis=1))
    return np.sum(parts, axis=0) if parts else np.full(len(candidates), np.inf)


def _ratios_of_all(table: SpectrumTable, candidates: Sequence[Pairs], sensor: int) -> F64:
    """Indexes (c, n) of one sensor; each pair is computed once."""
    by_pair = {pair: ratios(table, sensor, pair) for pair in {pairs[sensor] for pairs in candidates}}
    return np.array([by_pair[pairs[sensor]] for pairs in candidates])


@dataclass(frozen=True, slots=True)
class Nested:
    """The choice repeated without each run, by the run's number (``without``).

    Its error (estimate minus truth, kg and percentage points) and stated standard deviation on the batches of that run:
    error and std (2, n), payload and front share; NaN without an answer.
    """

    without: Mapping[int, Choice]
    error: F64
    std: F64


@dataclass(frozen=True, slots=True)
class RatioIndexFit:
    """The calibration and its evidence.

    ``without`` has, by run number, the calibration without that run: bands chosen again, or if too few runs allow that,
    the same ones fitted again. payload_errors_kg and front_share_errors_pct (n,) are its errors, batches in the order
    of ``table``. Its intervals are widened as all runs require.
    """

    calibration: RatioIndexCalibration
    without: Mapping[int, RatioIndexCalibration]
    payload_errors_kg: F64 | None
    front_share_errors_pct: F64 | None
    table: SpectrumTable
    choice: Choice


def fit_ratio_index(
    runs: Sequence[KnownRun],
    vehicle: Vehicle,
    *,
    bands: BandChoice = "campaign",
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> RatioIndexFit:
    """The calibration from identification runs. Raises CalibrationImpossibleError if they do not allow one.

    ``progress`` is called with (steps done, steps in all).
    """
    table = spectrum_table(runs, vehicle.sensor_left_m)
    _check(table)
    terms = structure_of(table, bands)
    chosen = choose(table, candidates(table, bands), terms, vehicle)
    if chosen is None:
        raise CalibrationImpossibleError(
            f"no regression can be made of {table.n_runs} runs with {table.n_loads} payloads and {table.n_shares} "
            "front shares: drive another known load"
        )
    nested = _nested(table, bands, terms, vehicle, progress)
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
    models = chosen.models
    widening = [_widening(model, nested, target) for target, model in enumerate(models)]
    dof = table.n_runs - 1.0
    return RatioIndexFit(
        calibration=_calibration(blank, chosen.pairs, models, widening, dof),
        without={
            number: _calibration(blank, pairs, others, widening, dof)
            for number, (pairs, others) in _models_without(chosen, nested, table).items()
        },
        payload_errors_kg=_errors(chosen, nested, 0),
        front_share_errors_pct=_errors(chosen, nested, 1),
        table=table,
        choice=chosen,
    )


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


def _nested(
    table: SpectrumTable, bands: BandChoice, terms: Terms, vehicle: Vehicle, progress: Callable[[int, int], None]
) -> Nested:
    """For each run, bands chosen and regressions fitted on the others, then compared with it."""
    error, std = np.full((2, 2, len(table.run)), np.nan)
    without: dict[int, Choice] = {}
    for done, folds in enumerate(_folds(table, bands), 1):
        for is_out, rest, pairs in folds:
            again = choose(rest, pairs, terms, vehicle)
            if again is not None:
                left = table.rows(is_out)
                without[int(left.number[0])] = again
                answer, std[:, is_out] = again.predict(left)
                error[:, is_out] = answer - np.array(left.targets)
        progress(done, table.n_runs)
    return Nested(without, error, std)


def _widening(model: RegressionModel | None, nested: Nested, target: int) -> float | None:
    """Factor of the spread so that it covers four fifths of the nested errors; None without a model."""
    if model is None:
        return None
    z = np.abs(nested.error[target] / nested.std[target])
    if not np.all(np.isfinite(z)):
        return 1.0
    return max(1.0, float(np.quantile(z, MOST)) / float(special.stdtrit(model.dof, 0.5 + MOST / 2.0)))


def _models_without(choice: Choice, nested: Nested, table: SpectrumTable) -> dict[int, tuple[Pairs, Models]]:
    """By run number, bands and regressions without that run."""
    if np.isfinite(nested.error[list(choice.answers)]).all():
        return {number: (again.pairs, again.models) for number, again in nested.without.items()}
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


def _errors(choice: Choice, nested: Nested, target: int) -> F64 | None:
    regression = choice.regressions[target]
    if regression is None:
        return None
    errors: F64 = nested.error[target]
    return errors if np.all(np.isfinite(errors)) else regression.held_out_errors
