"""Batches of runs, or of vehicles, left out of a fit and weighed by it: the errors they show."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Final

import numpy as np

from gateway.calibration.half_car.known_spectra import KnownSpectra
from gateway.calibration.inheritance import ModelLimits
from gateway.core.cross_spectrum.calibration import SCORE, CrossSpectrumCalibration
from gateway.core.cross_spectrum.drift import MOST_TENSION
from gateway.core.cross_spectrum.estimator import MISFIT_ON_OTHER_ROADS, MISFIT_QUANTILE, weigh
from gateway.core.late import special
from gateway.core.reach import beyond
from gateway.posterior import Posterior, Source
from gateway.quantity import Z95
from gateway.records import F64, Why

USUAL_PAYLOAD_SHARE: Final = 0.004  # of the empty mass, see below
USUAL_FRONT_SHARE_PCT: Final = 0.1  # likewise
USUAL_CG_LEFT_M: Final = 0.005
"""Model errors of simulated vans that serve no other purpose. That of the place is most
of all an error of the empty vehicle's middle, which runs that are left out have in common and do not show: four vans
whose middle is on the centre line were calibrated with 1 to 19 mm.
"""
USUAL_PER_REACH: Final = 1.0  # chosen: growth of the error beyond the known loads; it doubles within an empty mass
USUAL_REACH: Final = 0.1  # chosen: of runs at the edge of a campaign, in parts of the empty mass
PRIOR_RUNS: Final = 6  # chosen: number of runs that the other vans count for
LEAST_PART: Final = 0.25  # chosen: of the usual variance; a campaign on one road at one speed shows too little of it


@dataclass(frozen=True, slots=True)
class RunError:
    """One left-out run: mean error (3,) of payload (kg), front share (%) and lateral place (m; NaN if unknown), the
    variances (3,) predicted for it without model error, and its load's distance beyond the others.
    """

    error: F64
    predicted: F64
    reach: float


@dataclass(frozen=True, slots=True)
class ModelError:
    """Standard deviations as in CrossSpectrumCalibration: what intervals of 95 % need, whatever the number of runs."""

    std: tuple[float, float, float]
    per_reach: tuple[float, float]


def model_error(runs: Sequence[RunError], empty_mass_kg: float) -> ModelError:
    """The model error by these runs; without any, that of other vans."""
    usual = np.array([USUAL_PAYLOAD_SHARE * empty_mass_kg, USUAL_FRONT_SHARE_PCT, USUAL_CG_LEFT_M]) ** 2
    stds, grown = [], []
    for i, variance in enumerate(usual):
        known = [one for one in runs if np.isfinite(one.error[i])]
        within = [one.error[i] ** 2 - one.predicted[i] for one in known if one.reach == 0.0]
        pooled = max((PRIOR_RUNS * variance + sum(within)) / (PRIOR_RUNS + len(within)), LEAST_PART * variance)
        heavier = float(special.stdtrit(PRIOR_RUNS + len(within), 0.975)) / Z95
        stds.append(heavier * float(np.sqrt(pooled)))
        excess = [max(0.0, (one.error[i] ** 2 - one.predicted[i]) / pooled - 1.0) for one in known if one.reach > 0.0]
        reach2 = [one.reach**2 for one in known if one.reach > 0.0]
        weight = PRIOR_RUNS * USUAL_REACH**2
        grown.append(float(np.sqrt((weight * USUAL_PER_REACH**2 + sum(excess)) / (weight + sum(reach2)))))
    return ModelError((stds[0], stds[1], stds[2]), (grown[0], grown[1]))


MISFIT_SCATTER: Final = 0.08
"""Standard deviation of the logarithm of the misfit among batches on one road, before a vehicle has shown its own."""
UNTESTED_MISFITS: Final = 3.0
"""Times the worst misfit of the fit itself, where no run was left out and no sister tells: another load may fit so much
worse. Chosen.
"""
SCORE_MARGIN: Final = 1.5
"""For other roads and loads than those of calibration. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class LeftOut:
    """A batch of a run weighed by the others, as the service weighs it except for the model error that such batches
    estimate.

    error (d,) is of payload (kg), front share (%) and, with a roll rate, the lateral place (m; NaN if the payload's was
    not stated). reach is the load's distance beyond the others'. The misfit is NaN if the run itself lies beyond.
    """

    run: int
    error: F64
    posterior: Posterior
    reach: float
    misfit: float
    position_score: float
    noise_score: float


def left_out_errors(one: KnownSpectra, calibration: CrossSpectrumCalibration) -> list[LeftOut]:
    """Every batch of a run that ``calibration`` has not seen."""
    errors = []
    truth = one.run.load
    is_among = beyond(truth, calibration.known_loads, calibration.empty_mass_kg) == 0.0
    for batch in one.run.batches:
        found = None if batch.rejected else weigh(batch, calibration, None)
        if found is None or isinstance(found, Why) or found.located.tension > MOST_TENSION:
            continue  # the service would refuse it
        located, posterior = found.located, found.posterior
        cg_left_m = one.placed(located.point.theta, 0.0).cg_left_m if posterior.size == 3 else np.nan
        is_placed = one.run.payload_kg == 0.0 or one.run.payload_left_m is not None
        true = np.array([truth.payload_kg, truth.front_share_pct, cg_left_m if is_placed else np.nan])
        errors.append(
            LeftOut(
                run=one.run.number,
                error=posterior.mean - true[: posterior.size],
                posterior=posterior,
                reach=found.reach,
                misfit=located.misfit if is_among else np.nan,
                position_score=abs(located.scores.position),
                noise_score=located.scores.noise,
            )
        )
    return errors


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


def limits_shown_by(errors: Sequence[LeftOut], misfit_limit: float, empty_mass_kg: float) -> ModelLimits:
    """The limits from these; ``misfit_limit`` is the limit from the fit of all, should no misfit be among them."""
    of_model = model_error(
        [_of_run(list(batches)) for _, batches in groupby(errors, lambda one: one.run)], empty_mass_kg
    )
    shown = most_misfit([one.misfit for one in errors])
    return ModelLimits(
        model_std=of_model.std,
        model_per_reach=of_model.per_reach,
        misfit_limit=shown if np.isfinite(shown) else misfit_limit,
        most_position_score=max(SCORE, SCORE_MARGIN * max(one.position_score for one in errors)),
        most_noise_score=max(SCORE, SCORE_MARGIN * max(one.noise_score for one in errors)),
    )


def _of_run(batches: Sequence[LeftOut]) -> RunError:
    """Batches of one run are correlated: their own errors average out, errors of the calibration do not.

    The day and the sensor are those of the campaign, which had no time to change.
    """
    n, known = len(batches), np.full((len(batches), 3), np.nan)
    predicted = np.zeros((n, 3))
    for row, one in enumerate(batches):
        shared = one.posterior.without(Source.DAY, Source.SENSOR, Source.LOAD_LENGTH).shared
        size = one.posterior.size
        known[row, :size] = one.error
        predicted[row, :size] = np.diag(shared) + np.diag(one.posterior.own) / n
    return RunError(known.mean(axis=0), predicted.mean(axis=0), max(one.reach for one in batches))
