"""The learning curve of a campaign: calibrate on some of its runs, judge on the rest, for several sizes.

    learning_curve(campaign, settings) -> LearningCurve

Every trial calibrates from nothing but its own runs' identification parts, as ``springscale
calibrate --runs`` would; nothing is carried over from one trial to the next.
"""

from collections.abc import Sequence

from gateway.calibration.campaign import Campaign, OnRun
from gateway.calibration.judgement.learning_curve import (
    MOST_SUBSETS,
    SEED,
    LearningCurve,
    OnTrial,
    curve_of,
)
from gateway.config import ESTIMATOR_NAMES
from gateway.core.settings import BatchSettings
from gateway.offline.campaigns import inspect


def learning_curve(
    campaign: Campaign,
    settings: BatchSettings,
    *,
    estimators: Sequence[str] = ESTIMATOR_NAMES,
    most_subsets: int = MOST_SUBSETS,
    seed: int = SEED,
    on_run: OnRun = lambda done, of: None,
    on_trial: OnTrial = lambda done, of: None,
) -> LearningCurve:
    """Reads the logs, leaves out runs with a fault, then tries.

    Raises CalibrationImpossibleError with fewer than three runs.
    """
    split = inspect(campaign, settings, on_run=on_run).usable
    return curve_of(
        split,
        campaign.vehicle,
        name=campaign.vehicle.name,
        estimators=estimators,
        most_subsets=most_subsets,
        seed=seed,
        on_trial=on_trial,
    )
