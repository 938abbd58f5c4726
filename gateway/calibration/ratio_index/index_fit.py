"""Calibration of the ratio index: bands chosen on the campaign, then one static regression for each target.

On bands of its own a campaign gets a regression on both logarithms, on the bands of Table 2 the paper's (11); if it has
too few runs or sensors for these, the paper's (9) and (10). Bands are chosen by errors on runs left out. The least of
many such errors is biased low, because the runs left out took part in the choice. The nested error is not: it repeats
the choice without the run that is then judged. It widens the interval of an answer if necessary.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway.calibration.ratio_index.bands import BandChoice, Pairs, candidates, ratios
from gateway.calibration.ratio_index.least_squares import (
    FittedRegression,
    fit_regression,
    held_out_errors,
    scaled_design,
    without_each_run,
)
from gateway.calibration.ratio_index.spectra_table import N_SEGMENT, SpectrumTable, spectrum_table
from gateway.calibration.stated_drive import StatedDrive
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
from gateway.records import F64

SPEED_STD_FACTOR: Final = 2.0  # chosen: largest speed spread of a batch, over the largest calibrated
MOST: Final = 0.8  # chosen: quantile of nested errors within the interval; the rest may be far outside the known loads

Terms = tuple[tuple[str, ...], ...]  # of payload and of front share
Models = Sequence[RegressionModel | None]  # likewise
OWN_INDEX: Final[Terms] = (MODEL_9_PAYLOAD, MODEL_10_FRONT_SHARE)  # each target from its own index
STRUCTURE: Final[Mapping[BandChoice, Terms]] = {
    "campaign": (("log_ra", "log_rg"), ("log_ra", "log_rg")),  # ours: linear in both logarithms
    "table2": (MODEL_11_PAYLOAD, MODEL_11_FRONT_SHARE),
}


@dataclass(frozen=True, slots=True)
class Choice:
    """Bands, and the regressions of payload and of front share on them, None if there is none."""

    pairs: Pairs
    regressions: tuple[FittedRegression | None, ...]

    @property
    def models(self) -> Models:
        """The regressions of payload and of front share."""
        return [one.model if one else None for one in self.regressions]

    def predict(self, table: SpectrumTable) -> tuple[F64, F64]:
        """Answers and their standard deviations (2, n) for the table's batches; NaN where it has no regression."""
        ra, rg = (ratios(table, sensor, pair).tolist() for sensor, pair in enumerate(self.pairs))
        found = np.full((2, len(ra), 2), np.nan)
        for target, model in enumerate(self.models):
            if model is not None:
                found[target] = [model.predict(*shown)[:2] for shown in zip(ra, rg, strict=True)]
        return found[..., 0], found[..., 1]


def _allowed(terms: Terms, table: SpectrumTable) -> Terms:
    """The terms of each target; none if the campaign is too small for them.

    A regression needs its sensors, two runs more than terms, and three different front shares if the share is the
    target or both indexes take part.
    """
    absent = {index for index, spectra in zip(("ra", "rg"), table.spectra, strict=True) if spectra is None}
    allowed = []
    for target, named in enumerate(terms):
        used = {index for index in ("ra", "rg") if any(index in term for term in named)}
        needs_shares = target == 1 or len(used) > 1
        is_enough = table.n_runs >= len(named) + 2 and (table.n_shares >= 3 or not needs_shares)
        allowed.append(named if is_enough and not used & absent else ())
    return tuple(allowed)


def choose(table: SpectrumTable, candidates: Sequence[Pairs], terms: Terms, vehicle: Vehicle) -> Choice | None:
    """The bands among the candidates with the least error on runs left out, and the regressions on them.

    The error is the sum of both targets' mean squares, as shares of the ranges of (12). None if these runs do not allow
    a regression.
    """
    ra, rg = (_ratios_of_all(table, candidates, sensor) for sensor in (0, 1))
    ranges = (vehicle.payload_range_kg, vehicle.front_share_range_pct)
    targets = list(zip(_allowed(terms, table), table.targets, ranges, strict=True))
    scores = np.zeros(len(candidates))
    for named, known, (low, high) in targets:
        if named:
            columns, _, _ = scaled_design(named, ra, rg)
            errors = held_out_errors(columns, without_each_run(columns, known, table.run)[0], known, table.run)
            scores += np.mean((errors / (high - low)) ** 2, axis=1)
    best = int(np.argmin(scores))
    regressions = tuple(
        fit_regression(named, ra[best], rg[best], known, table.run) if named else None for named, known, _ in targets
    )
    return Choice(candidates[best], regressions) if any(regressions) and np.isfinite(scores[best]) else None


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

    def widening(self, model: RegressionModel | None, target: int) -> float:
        """Factor of the model's spread so that it covers four fifths of the errors."""
        z = np.abs(self.error[target] / self.std[target])
        if model is None or not np.all(np.isfinite(z)):
            return 1.0
        return max(1.0, float(np.quantile(z, MOST)) / float(special.stdtrit(model.dof, 0.5 + MOST / 2.0)))


def _nested(
    table: SpectrumTable, bands: BandChoice, terms: Terms, vehicle: Vehicle, progress: Callable[[int, int], None]
) -> Nested:
    """For each run, bands chosen and regressions fitted on the others, then compared with it."""
    error, std = np.full((2, 2, len(table.run)), np.nan)
    without: dict[int, Choice] = {}
    for done, run in enumerate(np.unique(table.run), 1):
        is_out = table.run == run
        left, rest = table.rows(is_out), table.rows(~is_out)
        with suppress(CalibrationImpossibleError):  # no bands follow the load over the others
            again = choose(rest, candidates(rest, bands), terms, vehicle) if rest.n_loads > 1 else None
            if again is not None:
                without[int(left.number[0])] = again
                answer, std[:, is_out] = again.predict(left)
                error[:, is_out] = answer - np.array(left.targets)
        progress(done, table.n_runs)
    return Nested(without, error, std)


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


def fit_ratio_index(
    runs: Sequence[StatedDrive],
    vehicle: Vehicle,
    *,
    bands: BandChoice = "campaign",
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> RatioIndexFit:
    """The calibration from identification runs. Raises CalibrationImpossibleError if they do not allow one.

    ``progress`` is called with (steps done, steps in all).
    """
    table = spectrum_table(runs, vehicle.sensor_left_m)
    if table.n_loads < 2:
        raise CalibrationImpossibleError(
            "the ratio index needs runs with at least two different payloads; all of these carry "
            f"{table.targets[0][0]:g} kg: drive the vehicle empty and loaded"
        )
    if table.n_runs < 3:
        raise CalibrationImpossibleError(
            f"the ratio index needs at least three runs, there are {table.n_runs}: drive another known load"
        )
    structures = (STRUCTURE[bands], OWN_INDEX)  # (9) and (10) only if they answer more targets
    terms = max(structures, key=lambda terms: sum(map(bool, _allowed(terms, table))))
    chosen = choose(table, candidates(table, bands), terms, vehicle)
    if chosen is None:
        raise CalibrationImpossibleError(
            f"no regression can be made of {table.n_runs} runs with {table.n_loads} payloads and {table.n_shares} "
            "front shares: drive another known load"
        )
    nested = _nested(table, bands, terms, vehicle, progress)
    widening = [nested.widening(model, target) for target, model in enumerate(chosen.models)]
    batches = [batch for run in runs for batch in run.batches if not batch.rejected]
    speeds_mps = [batch.mean_speed_mps for batch in batches]
    speed_stds_mps = [float(np.std(batch.speed_mps[batch.usable])) for batch in batches]

    def calibration(pairs: Pairs, models: Models) -> RatioIndexCalibration:
        of_a, of_g = pairs
        payload, front_share = (
            replace(model, residual_std=factor * model.residual_std, dof=table.n_runs - 1.0) if model else None
            for model, factor in zip(models, widening, strict=True)
        )
        return RatioIndexCalibration(
            spectrum="amplitude",
            n_segment=N_SEGMENT,
            acceleration_bands=of_a.bands if of_a else None,
            pitch_rate_bands=of_g.bands if of_g else None,
            payload=payload,
            front_share=front_share,
            speed_range_mps=(min(speeds_mps), max(speeds_mps)),
            speed_std_max_mps=SPEED_STD_FACTOR * max(speed_stds_mps),
            roll_lever_m=table.roll_lever_m,
        )

    payload_errors_kg, share_errors_pct = (
        None if one is None else errors if np.all(np.isfinite(errors)) else one.held_out_errors
        for one, errors in zip(chosen.regressions, nested.error, strict=True)
    )
    return RatioIndexFit(
        calibration=calibration(chosen.pairs, chosen.models),
        without={number: calibration(*one) for number, one in _models_without(chosen, nested, table).items()},
        payload_errors_kg=payload_errors_kg,
        front_share_errors_pct=share_errors_pct,
        table=table,
    )


def _models_without(choice: Choice, nested: Nested, table: SpectrumTable) -> dict[int, tuple[Pairs, Models]]:
    """Bands and regressions without each run, by its number."""
    is_answered = [model is not None for model in choice.models]
    if np.isfinite(nested.error[is_answered]).all():
        return {number: (again.pairs, again.models) for number, again in nested.without.items()}
    return {
        number: (choice.pairs, [one.without[place] if one else None for one in choice.regressions])
        for number, place in zip(table.number.tolist(), table.run.tolist(), strict=True)
    }
