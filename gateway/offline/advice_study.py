"""Does it help to drive what the plan advises? Tried on a campaign whose next runs were driven already.

From every triple of the empty run and two loads at different positions, each remaining run in turn is
taken as the fourth; the plan chooses among them knowing the triple alone. Judged on the validation part
of all runs, the same batches for every choice.
"""

import math
from collections.abc import Callable, Sequence
from typing import Final

from gateway.calibration.advice_study import AdviceStudy, Choice, Errors, compared
from gateway.calibration.campaign import Campaign, OnRun
from gateway.calibration.inspection.split_run import SplitRun
from gateway.calibration.judgement.evaluation import error_table
from gateway.calibration.judgement.learning_curve import calibrated_on, judged_all, triples_at_different_positions
from gateway.calibration.plan.design import Design, Spread
from gateway.calibration.plan.loads import PlacedLoad, weighed_loads
from gateway.calibration.plan.plan import usual_drive
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.cross_spectrum.estimator import CrossSpectrumCalibration
from gateway.core.settings import BatchSettings
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationImpossibleError
from gateway.offline.campaigns import inspect

ESTIMATOR: Final = "cross_spectrum"
LEAST_RUNS: Final = 5
OnFit = Callable[[int, int], None]  # (calibrations done, calibrations in all)
Scored = tuple[Errors, Errors]  # with misses, and of what was answered


def advice_study(
    campaign: Campaign,
    settings: BatchSettings,
    on_run: OnRun = lambda done, of: None,
    on_fit: OnFit = lambda done, of: None,
) -> AdviceStudy:
    """Reads the logs, leaves out runs with a fault, then tries.

    Raises CalibrationImpossibleError as :func:`advice_of`.
    """
    split = inspect(campaign, settings, on_run=on_run).usable
    return advice_of(split, campaign.vehicle, name=campaign.vehicle.name, on_fit=on_fit)


def advice_of(
    split: Sequence[SplitRun], vehicle: Vehicle, *, name: str, on_fit: OnFit = lambda done, of: None
) -> AdviceStudy:
    """The same for runs that were read already.

    Raises CalibrationImpossibleError where no such triple has runs to choose from.
    """
    runs = [one.identification for one in split]
    triples = triples_at_different_positions(runs, vehicle)
    if not triples or len(runs) < LEAST_RUNS:
        raise CalibrationImpossibleError(
            "needs an empty run, loads at two positions or more and five runs in all, so as to have a choice"
        )
    tried = _Tried(split, vehicle, on_fit, _n_calibrations(triples, [run.number for run in runs]))
    choices = [tried.choice(triple) for triple in triples]
    with_misses, answered = (compared([choice[which] for choice in choices]) for which in (0, 1))
    return AdviceStudy(name, with_misses, answered)


def _n_calibrations(triples: Sequence[tuple[int, ...]], numbers: Sequence[int]) -> int:
    """Triples, and the different quadruples that follow from them."""
    fours = {frozenset((*triple, number)) for triple in triples for number in numbers if number not in triple}
    return len(triples) + len(fours)


class _Tried:
    """Calibrations made so far, each once."""

    def __init__(self, split: Sequence[SplitRun], vehicle: Vehicle, on_fit: OnFit, n_fits: int) -> None:
        self._split = {one.identification.number: one for one in split}
        self._vehicle = vehicle
        self._on_fit, self._n_fits = on_fit, n_fits
        self._made: dict[frozenset[int], tuple[CalibratedVehicle, Scored]] = {}

    def choice(self, numbers: tuple[int, ...]) -> tuple[Choice, Choice]:
        """What could follow these runs, once with misses and once of what was answered."""
        calibrated, before = self._calibrated(numbers)
        advised, least, expected = self._advice(numbers, calibrated)
        after = {number: self._calibrated((*numbers, number))[1] for number in self._split if number not in numbers}
        both = [
            Choice(
                numbers,
                advised,
                least,
                expected,
                before[which],
                {number: errors[which] for number, errors in after.items()},
            )
            for which in (0, 1)
        ]
        return both[0], both[1]

    def _advice(self, numbers: tuple[int, ...], calibrated: CalibratedVehicle) -> tuple[int, int, Errors]:
        """The runs not driven yet that the plan expects most and least of, and the errors it expects so far."""
        found = calibrated.cross_spectrum
        if found is None:
            raise ValueError("a study of the advice needs the cross-spectral calibration")
        drive = usual_drive([self._split[number].identification for number in numbers])
        design = Design(self._vehicle, found.parameters, drive, weighed_loads(self._vehicle))
        number_of = {
            PlacedLoad(one.identification.payload_kg, None, one.identification.front_share_pct): number
            for number, one in self._split.items()
            if number not in numbers
        }
        loads = list(number_of)
        return (
            number_of[design.best(found.covariance, loads)],
            number_of[design.worst(found.covariance, loads)],
            _expected(design.spread(found.covariance), found, self._vehicle),
        )

    def _calibrated(self, numbers: tuple[int, ...]) -> tuple[CalibratedVehicle, Scored]:
        key = frozenset(numbers)
        if key not in self._made:
            runs = [self._split[number].identification for number in sorted(numbers)]
            calibrated = calibrated_on(runs, self._vehicle, ESTIMATOR)
            self._made[key] = calibrated, self._scored(calibrated)
            self._on_fit(len(self._made), self._n_fits)
        return self._made[key]

    def _scored(self, calibrated: CalibratedVehicle) -> Scored:
        judged = judged_all((one.validation for one in self._split.values()), calibrated, ESTIMATOR)
        table = error_table(judged, self._vehicle, ESTIMATOR)
        payload, share = table["payload"], table["front_share"]
        return (
            (payload["mean_abs_pct_with_misses"], share["mean_abs_pct_with_misses"]),
            (_or_nan(payload["mean_abs_pct"]), _or_nan(share["mean_abs_pct"])),
        )


def _expected(spread: Spread, found: CrossSpectrumCalibration, vehicle: Vehicle) -> Errors:
    """Mean |error| (12) of Gaussian errors with the standard deviations that the service would state."""
    (low_kg, high_kg), (low_pct, high_pct) = vehicle.payload_range_kg, vehicle.front_share_range_pct
    mean_of_std = 100.0 * math.sqrt(2.0 / math.pi)
    return (
        mean_of_std * found.payload_inflation * spread.payload_std_kg / (high_kg - low_kg),
        mean_of_std * found.front_share_inflation * spread.front_share_std_pct / (high_pct - low_pct),
    )


def _or_nan(x: float | None) -> float:
    return float("nan") if x is None else x
