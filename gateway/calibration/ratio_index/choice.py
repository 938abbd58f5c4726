"""The choice of bands, and of terms where these are not fixed, by errors on runs left out."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Final, Literal

import numpy as np

from gateway.calibration.ratio_index.bands import WIDTHS_HZ, BandPair, candidate_pairs, ratios
from gateway.calibration.ratio_index.regression import (
    FittedRegression,
    fit_regression,
    held_out_errors,
    without_each_run,
)
from gateway.calibration.ratio_index.stepwise import Selection, select_stepwise
from gateway.calibration.ratio_index.structures import Family, Target, terms_of
from gateway.calibration.ratio_index.table import IndexTable
from gateway.core.ratio_index.index import PAPER_BANDS
from gateway.core.ratio_index.regression import scaled_columns, term_columns
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationImpossibleError
from gateway.records import F64

BandChoice = Literal["campaign", "table2"]
Pairs = tuple[BandPair | None, BandPair | None]  # of acceleration and of pitch rate; None without the sensor

TARGETS: Final[tuple[Target, Target]] = ("payload", "front_share")
N_CANDIDATES: Final = 12  # pairs of each sensor and width
N_STEPWISE: Final = 12  # pairs of pairs, the best with both logarithms, worth a stepwise choice


@dataclass(frozen=True, slots=True)
class Tried:
    """A regression of one family on given bands; ``selection`` tells how a stepwise one came about."""

    family: Family
    fitted: FittedRegression
    selection: Selection | None = None

    @property
    def held_out_rms(self) -> float:
        """Root mean square error on runs left out of the regression, the bands given; kg or percentage points."""
        return float(np.sqrt(np.mean(self.fitted.held_out_errors**2)))


@dataclass(frozen=True, slots=True)
class Choice:
    """Bands, and one family's regressions on them.

    ``score`` is the sum of mean square errors on runs left out, as shares of the ranges of (12).
    """

    pairs: Pairs
    payload: Tried | None
    front_share: Tried | None
    score: float

    @property
    def tried(self) -> tuple[Tried | None, Tried | None]:
        """Of payload and of front share."""
        return self.payload, self.front_share


def candidates(table: IndexTable, bands: BandChoice) -> list[list[Pairs]]:
    """Band pairs worth a regression, a list for each width: the most significant of the campaign, or the paper's.

    Raises CalibrationImpossibleError where no pair follows the load.
    """
    if bands == "table2":
        sensors = (("acceleration", table.acceleration), ("pitch_rate", table.pitch_rate))
        of_a, of_g = (None if seen is None else BandPair(PAPER_BANDS[name]) for name, seen in sensors)
        return [[(of_a, of_g)]]
    found = []
    for width_hz in WIDTHS_HZ:
        of_load = _pairs_of(table, table.acceleration, table.payload_kg, table.front_share_pct, width_hz)
        of_share = _pairs_of(table, table.pitch_rate, table.front_share_pct, table.payload_kg, width_hz)
        found.append(list(product(of_load, of_share)))
    if not any(found):
        raise CalibrationImpossibleError(
            "no pair of bands follows the load over these runs: drive more different loads"
        )
    return found


def choose(table: IndexTable, found: list[list[Pairs]], family: Family, vehicle: Vehicle) -> Choice | None:
    """The bands among the candidates ``found`` with which ``family`` errs least on runs left out.

    None where these runs cannot carry a regression of this family.
    """
    pairs = [one for of_width in found for one in of_width]
    ranking: Family = "log" if family == "stepwise" else family
    scores = np.concatenate([_scores(table, of_width, ranking, vehicle) for of_width in found])
    if family != "stepwise":
        best = int(np.argmin(scores))
        return choice_on(table, pairs[best], family, vehicle) if np.isfinite(scores[best]) else None
    finalists = [pairs[int(i)] for i in np.argsort(scores, kind="stable")[:N_STEPWISE]]
    choices = [choice_on(table, one, family, vehicle) for one in finalists]
    carried = [one for one in choices if one is not None]
    return min(carried, key=_rank, default=None)


def choice_on(table: IndexTable, pairs: Pairs, family: Family, vehicle: Vehicle) -> Choice | None:
    """One family's regressions with given bands; None where there is none."""
    payload, front_share = (_tried(table, pairs, family, target) for target in TARGETS)
    shares = [
        (tried.held_out_rms / span) ** 2
        for tried, span in zip((payload, front_share), _spans(vehicle), strict=True)
        if tried is not None
    ]
    return Choice(pairs, payload, front_share, sum(shares)) if shares else None


def n_answered(choice: Choice) -> int:
    """How many of payload and front share a choice tells."""
    return sum(tried is not None for tried in choice.tried)


def indexes(table: IndexTable, pairs: Pairs) -> tuple[F64, F64]:
    """R_a and R_g (n,) of every batch; NaN without the sensor."""
    return ratios(table, table.acceleration, pairs[0]), ratios(table, table.pitch_rate, pairs[1])


def truth(table: IndexTable, target: Target) -> F64:
    """What was weighed, of every batch (n,)."""
    return table.payload_kg if target == "payload" else table.front_share_pct


def _rank(choice: Choice) -> tuple[int, float]:
    return -n_answered(choice), choice.score


def _pairs_of(
    table: IndexTable, spectra: F64 | None, target: F64, other: F64, width_hz: float
) -> list[BandPair | None]:
    if spectra is None:
        return [None]
    return [*candidate_pairs(table, spectra, target, other, width_hz, N_CANDIDATES)]


def _scores(table: IndexTable, found: list[Pairs], family: Family, vehicle: Vehicle) -> F64:
    """Score (c,) of a fixed family on each of the candidate bands: all at once."""
    if not found:
        return np.empty(0)
    ra, rg = (
        _ratios_of_all(table, table.acceleration, [of_a for of_a, _ in found]),
        _ratios_of_all(table, table.pitch_rate, [of_g for _, of_g in found]),
    )
    scores = np.full(len(found), np.inf)
    for target, span in zip(TARGETS, _spans(vehicle), strict=True):
        terms = terms_of(family, target, table)
        if terms:
            known = truth(table, target)
            raw = term_columns(terms, ra, rg)
            lows, highs = raw.min(axis=1, keepdims=True), raw.max(axis=1, keepdims=True)
            columns = scaled_columns(terms, ra, rg, lows, highs)
            without, _ = without_each_run(columns, known, table.run)
            errors = held_out_errors(columns, without, known, table.run)
            scores = np.where(np.isinf(scores), 0.0, scores) + np.mean((errors / span) ** 2, axis=1)
    return scores


def _ratios_of_all(table: IndexTable, spectra: F64 | None, pairs: list[BandPair | None]) -> F64:
    """Indexes (c, n) of one sensor; a pair that comes again is not worked out again."""
    found = {pair: ratios(table, spectra, pair) for pair in dict.fromkeys(pairs)}
    return np.array([found[pair] for pair in pairs])


def _tried(table: IndexTable, pairs: Pairs, family: Family, target: Target) -> Tried | None:
    terms = terms_of(family, target, table)
    selection = None
    if terms and family == "stepwise":
        selection = select_stepwise(terms, *indexes(table, pairs), truth(table, target), table.run)
        terms = selection.terms
    if not terms:
        return None
    return Tried(family, fit_regression(terms, *indexes(table, pairs), truth(table, target), table.run), selection)


def _spans(vehicle: Vehicle) -> Iterator[float]:
    return (high - low for low, high in (vehicle.payload_range_kg, vehicle.front_share_range_pct))
