"""The choice of bands, and of a structure if none is named, by errors on runs left out."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from gateway.calibration.ratio_index.bands import Pairs, indexes, ratios
from gateway.calibration.ratio_index.regression import (
    FittedRegression,
    fit_regression,
    held_out_errors,
    scaled_design,
    without_each_run,
)
from gateway.calibration.ratio_index.table import SpectrumTable
from gateway.core.ratio_index.regression import (
    MODEL_9_PAYLOAD,
    MODEL_10_FRONT_SHARE,
    MODEL_11_FRONT_SHARE,
    MODEL_11_PAYLOAD,
    RegressionModel,
)
from gateway.core.vehicle import Vehicle
from gateway.records import F64

Family = Literal["single", "log", "joint"]
StructureChoice = Literal["auto", "single", "log", "joint"]

TERMS_OF: Final[dict[Family, tuple[tuple[str, ...], tuple[str, ...]]]] = {  # of payload, of front share
    "single": (MODEL_9_PAYLOAD, MODEL_10_FRONT_SHARE),  # each target from its own index
    "log": (("log_ra", "log_rg"), ("log_ra", "log_rg")),  # ours: linear in both logarithms
    "joint": (MODEL_11_PAYLOAD, MODEL_11_FRONT_SHARE),
}
"""The structures in the order of trial; of equals the first is taken."""


@dataclass(frozen=True, slots=True)
class Choice:
    """Bands, and one family's regressions of payload and of front share on them, None if there is none.

    ``score`` is the sum of mean square errors on runs left out of the regressions, with these bands, as shares of the
    ranges of (12).
    """

    family: Family
    pairs: Pairs
    regressions: tuple[FittedRegression | None, FittedRegression | None]
    score: float

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


def choose(table: SpectrumTable, candidates: Sequence[Pairs], family: Family, vehicle: Vehicle) -> Choice | None:
    """The bands among the candidates with the least error of ``family`` on runs left out.

    None if these runs do not allow a regression of this family.
    """
    scores = _scores(table, candidates, family, vehicle)
    best = int(np.argmin(scores))
    return _choice_on(table, candidates[best], family, vehicle) if np.isfinite(scores[best]) else None


def terms_of(family: Family, target: int, table: SpectrumTable) -> tuple[str, ...]:
    """The terms of payload (target 0) or front share (1); none if the campaign is too small for them.

    A regression needs its sensors, two runs more than terms, and three different front shares if the share is the
    target or both indexes take part.
    """
    absent = {index for index, spectra in zip(("ra", "rg"), table.spectra, strict=True) if spectra is None}
    terms = TERMS_OF[family][target]
    used = {index for index in ("ra", "rg") if any(index in term for term in terms)}
    needs_shares = target == 1 or len(used) > 1
    is_enough = table.n_runs >= len(terms) + 2 and (table.n_shares >= 3 or not needs_shares)
    return terms if is_enough and not used & absent else ()


def spans_of(vehicle: Vehicle) -> tuple[float, float]:
    """The ranges of (12): payload in kg, front share in percentage points."""
    payload_kg, share_pct = vehicle.payload_range_kg, vehicle.front_share_range_pct
    return payload_kg[1] - payload_kg[0], share_pct[1] - share_pct[0]


def _choice_on(table: SpectrumTable, pairs: Pairs, family: Family, vehicle: Vehicle) -> Choice | None:
    """One family's regressions with given bands; None if there is none."""
    ra, rg = indexes(table, pairs)
    regressions: list[FittedRegression | None] = []
    score = 0.0
    for target, (known, span) in enumerate(zip(table.targets, spans_of(vehicle), strict=True)):
        terms = terms_of(family, target, table)
        regression = fit_regression(terms, ra, rg, known, table.run) if terms else None
        regressions.append(regression)
        if regression is not None:
            score += (float(np.sqrt(np.mean(regression.held_out_errors**2))) / span) ** 2
    choice = Choice(family, pairs, (regressions[0], regressions[1]), score)
    return choice if any(choice.answers) else None


def _scores(table: SpectrumTable, candidates: Sequence[Pairs], family: Family, vehicle: Vehicle) -> F64:
    """Score (c,) of a fixed family on each of the candidate bands; infinite if it cannot be fitted."""
    ra, rg = (_ratios_of_all(table, candidates, sensor) for sensor in (0, 1))
    parts = []
    for target, (known, span) in enumerate(zip(table.targets, spans_of(vehicle), strict=True)):
        terms = terms_of(family, target, table)
        if terms:
            columns, _, _ = scaled_design(terms, ra, rg)
            errors = held_out_errors(columns, without_each_run(columns, known, table.run)[0], known, table.run)
            parts.append(np.mean((errors / span) ** 2, axis=1))
    return np.sum(parts, axis=0) if parts else np.full(len(candidates), np.inf)


def _ratios_of_all(table: SpectrumTable, candidates: Sequence[Pairs], sensor: int) -> F64:
    """Indexes (c, n) of one sensor; each pair is computed once."""
    by_pair = {pair: ratios(table, sensor, pair) for pair in {pairs[sensor] for pairs in candidates}}
    return np.array([by_pair[pairs[sensor]] for pairs in candidates])
