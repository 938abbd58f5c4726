"""The model's own error, as drives left out of the fit show it: from both sides.

Too many misses widen the intervals; drives that all lie close to the middle of theirs reduce the model's error, down to
a part of the usual one. Runs are the witnesses, not batches: batches of one run repeat one error.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Final

import numpy as np

from gateway.core.late import special
from gateway.estimates.posterior import Posterior, Source
from gateway.estimates.quantity import Z95
from gateway.model.checks import MISFIT_ON_OTHER_ROADS, MISFIT_QUANTILE
from gateway.model.vehicle_model import VehicleModel
from gateway.records import F64

USUAL_PAYLOAD_SHARE: Final = 0.004  # of the empty mass, see below
USUAL_FRONT_SHARE_PCT: Final = 0.1  # likewise
USUAL_CG_LEFT_M: Final = 0.005
"""Model errors of simulated vans that serve no other purpose. That of the place is most of all an error of the empty
vehicle's middle, which runs that are left out have in common and do not show.
"""
PRIOR_RUNS: Final = 6  # chosen: number of runs that the other vans count for
LEAST_PART: Final = 0.25  # chosen: of the usual variance; a campaign on one road at one speed shows too little of it
MOST_SPREAD: Final = 2.0
"""Chosen: largest factor of the intervals; 1 is the least. Runs left out of a campaign share its day, road and speed:
on eight simulated vans, factors below 1 that they showed made the intervals of other drives too narrow.
"""
GROSS: Final = 4.0
"""Chosen: standard deviations of the other runs; a run that errs by more counts as if it erred by that. A search that
failed, or a load that moved, says nothing of the model; two runs that err so much vouch for one another.
"""
MISFIT_SCATTER: Final = 0.08
"""Standard deviation of the logarithm of the misfit among batches on one road, before a vehicle has shown its own."""


@dataclass(frozen=True, slots=True, eq=False)
class LeftOut:
    """A batch of a run weighed by the others, as the service weighs it.

    error (d,) is of payload (kg), front share (%) and, with a roll rate, the lateral place (m); NaN where it was not
    stated. stated_std (d,) is the doubt of the statement. The misfit is NaN if the run itself lies beyond the others.
    """

    run: str
    error: F64
    stated_std: F64
    posterior: Posterior
    reach: float
    misfit: float
    is_compact: bool


@dataclass(frozen=True, slots=True)
class ModelErrors:
    """How far the model errs on runs left out; fields as in VehicleModel."""

    model_std: tuple[float, float, float]
    spread: tuple[float, float, float]
    misfit_limit: float

    @classmethod
    def usual(cls, empty_mass_kg: float, misfit_limit: float) -> "ModelErrors":
        """Those of other vans, before any run is left out."""
        return cls(_model_std((), empty_mass_kg), (1.0, 1.0, 1.0), misfit_limit)

    @classmethod
    def of(cls, model: VehicleModel) -> "ModelErrors":
        """Those of one vehicle."""
        return cls(model.model_std, model.spread, model.misfit_limit)

    def on(self, model: VehicleModel) -> VehicleModel:
        """``model`` with these; its misfit on its own runs is always known."""
        most = max(self.misfit_limit, model.misfit_limit)
        return replace(model, model_std=self.model_std, spread=self.spread, misfit_limit=most)


def model_errors_shown_by(errors: Sequence[LeftOut], misfit_limit: float, empty_mass_kg: float) -> ModelErrors:
    """What these show; ``misfit_limit`` is the limit from the fit of all, should no misfit be among them."""
    runs = [_of_run(list(batches)) for _, batches in groupby(errors, lambda one: one.run)]
    shown = most_misfit([one.misfit for one in errors])
    model_std = _model_std(runs, empty_mass_kg)
    spread = tuple(_spread(runs, i, std) for i, std in enumerate(model_std))
    return ModelErrors(model_std, (spread[0], spread[1], spread[2]), shown if np.isfinite(shown) else misfit_limit)


def most_misfit(misfits: Sequence[float]) -> float:
    """The misfit that one healthy batch in a thousand exceeds, from those that calibration showed; NaN if it showed
    none.

    The misfit is log-normal: its logarithm has the mean of ``misfits``, their variance (MISFIT_SCATTER counts as
    PRIOR_RUNS of them) and beside it the variance that other roads add. The limit has six digits: a misfit's last ones
    depend on the order of sums.
    """
    logs = np.log([one for one in misfits if np.isfinite(one)])
    n = len(logs)
    if n == 0:
        return float("nan")
    scatter = (PRIOR_RUNS * MISFIT_SCATTER**2 + float(np.sum((logs - logs.mean()) ** 2))) / (PRIOR_RUNS + n - 1)
    std = np.sqrt(scatter * (1.0 + 1.0 / n) + MISFIT_ON_OTHER_ROADS**2)
    return float(f"{np.exp(logs.mean() + MISFIT_QUANTILE * std):.6g}")


@dataclass(frozen=True, slots=True, eq=False)
class _Run:
    """Mean error (3,) of a run's batches, NaN if unknown, and its variance (3,) predicted without model error."""

    error: F64
    predicted: F64


def _of_run(batches: Sequence[LeftOut]) -> _Run:
    """Batches of one run are correlated: their own errors average out, errors of the calibration do not.

    The day and the sensor are those of the campaign, which had no time to change; a compact load has the shape of the
    others.
    """
    n, known = len(batches), np.full((len(batches), 3), np.nan)
    predicted = np.zeros((n, 3))
    for row, one in enumerate(batches):
        constant = (Source.DAY, Source.SENSOR, Source.MODEL)
        shape = (Source.LOAD_LENGTH, Source.GOODS) if one.is_compact else ()
        size = one.posterior.size
        known[row, :size] = one.error
        shared = np.diag(one.posterior.without(*constant, *shape).shared)
        predicted[row, :size] = shared + np.diag(one.posterior.own) / n + one.stated_std**2
    return _Run(known.mean(axis=0), predicted.mean(axis=0))


def _model_std(runs: Sequence[_Run], empty_mass_kg: float) -> tuple[float, float, float]:
    usual = np.array([USUAL_PAYLOAD_SHARE * empty_mass_kg, USUAL_FRONT_SHARE_PCT, USUAL_CG_LEFT_M]) ** 2
    found = []
    for i, variance in enumerate(usual.tolist()):
        known = [one for one in runs if np.isfinite(one.error[i])]
        squared, predicted = np.array([(one.error[i] ** 2, one.predicted[i]) for one in known]).reshape(-1, 2).T
        excess = squared - predicted
        by_others = [_pooled(np.delete(excess, j), variance) for j in range(len(known))]
        excess = np.minimum(squared, GROSS**2 * (predicted + by_others)) - predicted
        heavier = float(special.stdtrit(PRIOR_RUNS + len(known), 0.975)) / Z95
        found.append(heavier * _pooled(excess, variance) ** 0.5)
    return found[0], found[1], found[2]


def _pooled(excess: F64, usual: float) -> float:
    """The variance of the model's error: from how far runs (n,) exceed what is predicted without it, and other vans."""
    return max((PRIOR_RUNS * usual + float(np.sum(excess))) / (PRIOR_RUNS + len(excess)), LEAST_PART * usual)


def _spread(runs: Sequence[_Run], i: int, model_std: float) -> float:
    """The factor of the intervals of one quantity by which these errors have the size that is predicted for them."""
    ratios = [float(one.error[i] ** 2 / (one.predicted[i] + model_std**2)) for one in runs if np.isfinite(one.error[i])]
    bounded = [min(one, GROSS**2) for one in ratios]
    factor = ((PRIOR_RUNS + sum(bounded)) / (PRIOR_RUNS + len(bounded))) ** 0.5
    return float(np.clip(factor, 1.0, MOST_SPREAD))
