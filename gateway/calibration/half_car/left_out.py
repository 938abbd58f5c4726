"""Batches of runs, or of vehicles, left out of a fit and weighed by what it taught: what they show of it."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Final

import numpy as np

from gateway.calibration.half_car.known_spectra import KnownSpectra
from gateway.calibration.half_car.model_error import RunError, model_error
from gateway.calibration.inheritance import Limits
from gateway.core.cross_spectrum.calibration import SCORE, CrossSpectrumCalibration
from gateway.core.cross_spectrum.drift import MOST_TENSION
from gateway.core.cross_spectrum.estimator import weigh
from gateway.core.cross_spectrum.reach import beyond
from gateway.posterior import Posterior, Source
from gateway.records import F64, Why

MISFIT_MARGIN: Final = 3.0
SCORE_MARGIN: Final = 1.5
"""For other roads and loads than those of calibration. Chosen; `benchmarks.accuracy sensitivity` tells what they do."""


@dataclass(frozen=True, slots=True, eq=False)
class LeftOut:
    """A batch of a run that the others weighed, as the service weighs it but for what such batches are to show.

    error (d,) is of payload (kg), front share (%) and, where roll shows it, the lateral place (m; NaN where nobody
    noted where the payload lay). reach is how far the load lies beyond the others'. The misfit is NaN where the run
    itself lies beyond.
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


def limits_shown_by(errors: Sequence[LeftOut], misfit_limit: float, empty_mass_kg: float) -> Limits:
    """What these ask for; ``misfit_limit`` is what the fit of all asks for."""
    of_model = model_error(
        [_of_run(list(batches)) for _, batches in groupby(errors, lambda one: one.run)], empty_mass_kg
    )
    return Limits(
        model_std=of_model.std,
        model_per_reach=of_model.per_reach,
        misfit_limit=max(misfit_limit, MISFIT_MARGIN * float(np.nanmax([0.0, *(one.misfit for one in errors)]))),
        most_position_score=max(SCORE, SCORE_MARGIN * max(one.position_score for one in errors)),
        most_noise_score=max(SCORE, SCORE_MARGIN * max(one.noise_score for one in errors)),
    )


def _of_run(batches: Sequence[LeftOut]) -> RunError:
    """Batches of one run are one witness: their own errors average out, what the calibration left open does not.

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
