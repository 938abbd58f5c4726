"""The paper's estimator: R_a and R_g by (7), (8), then the static regression (9), (10) or (11).

Its gates are narrow, because the index varies with speed: they bound the speed's spread within the batch and its
distance from the calibrated speeds. They also bound the indexes: outside the calibrated range the regression
extrapolates, and its interval grows so wide that it would contain any load.
"""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from gateway.core.ratio_index.index import RatioIndexCalibration, indexes_of
from gateway.core.ratio_index.regression import RegressionModel
from gateway.estimates.batch_estimate import UNKNOWN, Z95, Estimate, Quantity
from gateway.estimates.posterior import Posterior, Source
from gateway.records import Batch, Why

SPEED_MARGIN: Final = 0.15  # chosen: share by which a batch's mean speed may exceed the calibrated range
INDEX_MARGIN: Final = 0.25  # chosen: likewise for each term of the indexes, of its span; the same as for payloads


def by_ratio_index(batch: Batch, calibration: RatioIndexCalibration, blank: Estimate) -> Estimate:
    """``blank`` with the indexes, payload and front share, or with the reason for a refusal."""
    if float(np.std(batch.speed_mps[batch.usable])) > calibration.speed_std_max_mps:
        return replace(blank, rejected=(Why.SPEED_SPREAD,))
    slowest, fastest = calibration.speed_range_mps
    if not slowest * (1.0 - SPEED_MARGIN) <= batch.mean_speed_mps <= fastest * (1.0 + SPEED_MARGIN):
        return replace(blank, rejected=(Why.SPEED_UNCALIBRATED,))
    ra, rg = indexes_of(batch, calibration)
    indexed = replace(blank, ratio_index_acceleration=ra, ratio_index_pitch_rate=rg)
    wanted = [ra] * (calibration.acceleration_bands is not None) + [rg] * (calibration.pitch_rate_bands is not None)
    if not all(np.isfinite(wanted)):
        return replace(indexed, rejected=(Why.NOT_ENOUGH_EXCITATION,))
    models = [model for model in (calibration.payload, calibration.front_share) if model is not None]
    if any(model.extrapolates(ra, rg, INDEX_MARGIN) for model in models):
        return replace(indexed, rejected=(Why.OUT_OF_RANGE,))
    answer = replace(
        indexed,
        payload=_predicted(calibration.payload, ra, rg),
        front_share=_predicted(calibration.front_share, ra, rg),
    )
    return replace(answer, posterior=_posterior(answer.payload, answer.front_share))


def _predicted(model: RegressionModel | None, ra: float, rg: float) -> Quantity:
    return Quantity(*model.predict(ra, rg)) if model else UNKNOWN


def _posterior(payload: Quantity, front_share: Quantity) -> Posterior | None:
    """The posterior of both quantities; None without a payload.

    Half of each variance counts as the batch's own, half as the regression's, whose coefficients are wrong alike in
    every batch. Standard deviations are those of a normal error whose 95 % interval is as wide as Student's.
    """
    known = [one for one in (payload, front_share) if math.isfinite(one.number)]
    if not math.isfinite(payload.number):
        return None
    mean = np.array([one.number for one in known])
    std = np.array([0.5 * (one.interval95[1] - one.interval95[0]) / Z95 for one in known])
    return Posterior(mean, np.diag(0.5 * std**2), {Source.CALIBRATION: np.diag(np.sqrt(0.5) * std)})
