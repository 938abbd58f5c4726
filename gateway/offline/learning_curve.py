"""The learning curve of a campaign: calibrate on some of its runs, judge on the rest, for several sizes.

    learning_curve(campaign, settings) -> LearningCurve

Every trial calibrates from nothing but its own runs' identification parts, as ``springscale
calibrate --runs`` would; nothing is carried over from one trial to the next.
"""

from collections.abc import Callable, Sequence
from typing import Final

from gateway.calibration.campaign import Campaign
from gateway.calibration.evaluation import Judged, error_table
from gateway.calibration.learning_curve import (
    LearningCurve,
    Score,
    Trial,
    subsets_to_drive,
    triples_at_different_positions,
)
from gateway.config import ESTIMATOR_NAMES
from gateway.core.settings import BatchSettings
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationImpossibleError
from gateway.offline.inspect import inspect
from gateway.offline.known_runs import OnRun, SplitRun
from gateway.offline.trials import calibrated_on, judged_all

OnTrial = Callable[[int, int], None]  # (trials done, trials in all)

SIZES: Final = (2, 3, 4, 6, 10)
MOST_SUBSETS: Final = 6  # of one size: each costs seconds
SEED: Final = 1


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


def curve_of(
    split: Sequence[SplitRun],
    vehicle: Vehicle,
    *,
    name: str,
    estimators: Sequence[str] = ESTIMATOR_NAMES,
    most_subsets: int = MOST_SUBSETS,
    seed: int = SEED,
    on_trial: OnTrial = lambda done, of: None,
) -> LearningCurve:
    """The same for runs that were read already, as ``Outcome.split`` of a calibration holds them.

    Sizes are 2, 3, 4, 6 and 10 as far as there are runs, all runs, and all but one: the most that leave
    a run to judge by.
    """
    runs = [one.identification for one in split]
    if len(runs) < SIZES[1]:
        raise CalibrationImpossibleError(f"a learning curve needs at least three runs, there are {len(runs)}")
    sizes = sorted({*(size for size in SIZES if size <= len(runs)), len(runs) - 1, len(runs)})
    triples = triples_at_different_positions(runs, vehicle)
    subsets = [subset for size in sizes for subset in subsets_to_drive(runs, size, most_subsets, seed)]
    asked = [(numbers, estimator) for numbers in dict.fromkeys((*triples, *subsets)) for estimator in estimators]
    found: dict[tuple[tuple[int, ...], str], Trial] = {}
    for done, (numbers, estimator) in enumerate(asked):
        on_trial(done, len(asked))
        found[numbers, estimator] = trial_of(split, vehicle, numbers, estimator)
    on_trial(len(asked), len(asked))
    return LearningCurve(
        campaign=name,
        seed=seed,
        trials=tuple(found[numbers, estimator] for numbers in subsets for estimator in estimators),
        triples=tuple(found[numbers, estimator] for numbers in triples for estimator in estimators),
    )


def trial_of(split: Sequence[SplitRun], vehicle: Vehicle, numbers: tuple[int, ...], estimator: str) -> Trial:
    """Calibrate on the identification parts of the runs ``numbers`` and judge what that did not see."""
    chosen = [one for one in split if one.identification.number in numbers]
    left_out = [one for one in split if one.identification.number not in numbers]
    try:
        calibrated = calibrated_on([one.identification for one in chosen], vehicle, estimator)
    except CalibrationImpossibleError as fault:
        return Trial(numbers, estimator, refused=str(fault))
    unseen = judged_all([one.identification for one in left_out], calibrated, estimator)
    later = judged_all([one.validation for one in left_out], calibrated, estimator)
    own_later = judged_all([one.validation for one in chosen], calibrated, estimator)
    return Trial(
        numbers,
        estimator,
        left_out=_score([*unseen, *later], vehicle, estimator),
        validation=_score([*later, *own_later], vehicle, estimator),
    )


def _score(judged: Sequence[Judged], vehicle: Vehicle, estimator: str) -> Score | None:
    return Score.of(error_table(judged, vehicle, estimator)) if judged else None
