"""The paper's estimator: R_a and R_g by (7), (8), then the static regression (9), (10) or (11).

Its gates are narrow, because the index moves with speed: the speed's spread within the batch and its
distance from the calibrated speeds are bounded. Beyond the indexes that calibration saw the regression is a guess,
and its interval the wider the worse the guess is, so that it would hold any load: the indexes are bounded too.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from gateway.core.ratio_index.index import RatioIndexCalibration, indexes_of
from gateway.core.ratio_index.regression import RegressionModel
from gateway.estimate import UNKNOWN, Estimate, Quantity
from gateway.records import Batch, Why

SPEED_MARGIN: Final = 0.15  # how far a batch's mean speed may lie outside those calibrated, as a share
INDEX_MARGIN: Final = 0.25  # likewise every term of the indexes, as a share of its span; that of payloads is the same


def by_ratio_index(batch: Batch, calibration: RatioIndexCalibration, blank: Estimate) -> Estimate:
    """``blank`` with the indexes and what they tell of payload and front share, or with the reason why not."""
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
    return replace(
        indexed,
        payload=_predicted(calibration.payload, ra, rg),
        front_share=_predicted(calibration.front_share, ra, rg),
    )


def _predicted(model: RegressionModel | None, ra: float, rg: float) -> Quantity:
    return Quantity(*model.predict(ra, rg)) if model else UNKNOWN
