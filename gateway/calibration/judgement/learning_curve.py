"""The accuracy of a calibration with few known loads: the subsets of runs to try, and their results.

Runs are left out, and the calibration from the rest is compared with them. Every trial calibrates from its own runs
only, as ``springscale calibrate --runs`` would.
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from itertools import combinations
from math import comb
from typing import Any, Final

import numpy as np

from gateway.calibration.half_car.fit import calibrate_cross_spectrum
from gateway.calibration.inspection.log import SplitRun
from gateway.calibration.judgement.evaluation import TARGETS, Errors, Judged, errors_of, judge
from gateway.calibration.known_run import KnownRun, sensor_rate_seen_hz
from gateway.calibration.ratio_index.fit import fit_ratio_index
from gateway.config import ESTIMATOR_NAMES
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.vehicle import Vehicle, payload_position_m
from gateway.errors import CalibrationImpossibleError

IN_MEMORY_ID = "study"

OnTrial = Callable[[int, int], None]  # (trials done, trials in all)
SIZES: Final = (2, 3, 4, 6, 10)  # chosen: numbers of runs to calibrate with
MOST_SUBSETS: Final = 6  # chosen: subsets per size; each takes seconds
SEED: Final = 1  # arbitrary

SAME_POSITION_M: Final = 0.05  # chosen: the precision of a stated position


@dataclass(frozen=True, slots=True)
class Score:
    """The error table (12) of some batches in short: percent of the ranges; None without an answer."""

    n_batches: int
    n_rejected: int
    payload_mean_abs_pct: float | None
    payload_coverage95: float | None
    front_share_mean_abs_pct: float | None
    front_share_coverage95: float | None
    payload_half_width_pct: float | None = None
    payload_interval_score_pct: float | None = None
    front_share_half_width_pct: float | None = None
    front_share_interval_score_pct: float | None = None

    @classmethod
    def of(cls, errors: Errors) -> "Score":
        """The figures that a curve needs."""
        names = ("mean_abs_pct", "coverage95", "half_width_pct", "interval_score_pct")
        figures = {f"{target}_{name}": getattr(errors.of(target), name) for target in TARGETS for name in names}
        return cls(errors.n_batches, errors.n_rejected, **figures)


@dataclass(frozen=True, slots=True)
class Trial:
    """One estimator calibrated on the runs ``numbers``, scored on two sets of batches it has not seen.

    ``left_out``: every batch of the other runs, so loads that calibration never saw; None if no run is left out.
    ``validation``: the later part of all runs, so the calibrated loads are among them; None if the campaign has no such
    part. ``refused`` says why these runs allow no calibration.
    """

    numbers: tuple[int, ...]
    estimator: str
    left_out: Score | None = None
    validation: Score | None = None
    refused: str | None = None


@dataclass(frozen=True, slots=True)
class ScoreSpread:
    """A score over several trials: mean, standard deviation and worst of their mean errors, in percent (12).

    rejected_share is of all their batches. Figures are None if no trial gave one.
    """

    n_trials: int
    rejected_share: float | None
    payload_mean_pct: float | None
    payload_std_pct: float | None
    payload_worst_pct: float | None
    payload_coverage95: float | None
    payload_half_width_pct: float | None
    payload_interval_score_pct: float | None
    front_share_mean_pct: float | None
    front_share_std_pct: float | None
    front_share_worst_pct: float | None
    front_share_coverage95: float | None
    front_share_half_width_pct: float | None
    front_share_interval_score_pct: float | None


@dataclass(frozen=True, slots=True)
class Rung:
    """The accuracy of one estimator with ``n_runs`` known loads, over the subsets tried."""

    n_runs: int
    estimator: str
    n_subsets: int
    n_refused: int
    left_out: ScoreSpread
    validation: ScoreSpread


@dataclass(frozen=True, slots=True)
class LearningCurve:
    """All trials of one campaign.

    ``triples`` are the trials with the empty run and two loads at different positions: all there are.
    """

    campaign: str
    seed: int
    trials: tuple[Trial, ...]
    triples: tuple[Trial, ...]

    @property
    def rungs(self) -> tuple[Rung, ...]:
        """By number of runs, then estimator."""
        keys = sorted({(len(trial.numbers), trial.estimator) for trial in self.trials})
        return tuple(
            _rung(n, name, [t for t in self.trials if (len(t.numbers), t.estimator) == (n, name)]) for n, name in keys
        )

    @property
    def triple_rungs(self) -> tuple[Rung, ...]:
        """One per estimator, over all triples."""
        names = sorted({trial.estimator for trial in self.triples})
        return tuple(_rung(3, name, [t for t in self.triples if t.estimator == name]) for name in names)

    def to_json(self) -> dict[str, Any]:
        """Plain numbers for a file or a report."""
        return {
            "campaign": self.campaign,
            "seed": self.seed,
            "rungs": [asdict(rung) for rung in self.rungs],
            "triples": [asdict(rung) for rung in self.triple_rungs],
            "trials": [asdict(trial) for trial in dict.fromkeys((*self.trials, *self.triples))],
        }


def subsets_to_drive(runs: Sequence[KnownRun], n_runs: int, most: int, seed: int) -> list[tuple[int, ...]]:
    """Numbers of ``n_runs`` runs that a fitter might have driven, with an empty one if there is one.

    All such subsets if there are at most ``most``, otherwise ``most`` of them drawn by ``seed``.
    """
    empty = sorted(run.number for run in runs if run.payload_kg == 0.0)[:1]
    others = sorted(run.number for run in runs if run.number not in empty)
    n_chosen = n_runs - len(empty)
    if not 0 <= n_chosen <= len(others):
        return []
    if comb(len(others), n_chosen) <= most:
        return [(*empty, *chosen) for chosen in combinations(others, n_chosen)]
    rng = np.random.default_rng([seed, n_runs])
    drawn: set[tuple[int, ...]] = set()
    while len(drawn) < most:
        drawn.add(tuple(sorted(rng.choice(others, n_chosen, replace=False).tolist())))
    return [(*empty, *chosen) for chosen in sorted(drawn)]


def triples_at_different_positions(runs: Sequence[KnownRun], vehicle: Vehicle) -> list[tuple[int, ...]]:
    """Numbers of every triple of the empty run and two loads at different positions."""
    empty = [run for run in runs if run.payload_kg == 0.0][:1]
    loaded = [run for run in runs if run.payload_kg > 0.0]
    position_m = {run.number: payload_position_m(vehicle, run.payload_kg, run.front_share_pct) for run in loaded}
    return [
        (nothing.number, one.number, other.number)
        for nothing in empty
        for one, other in combinations(loaded, 2)
        if abs(position_m[one.number] - position_m[other.number]) > SAME_POSITION_M
    ]


def spread_of(scores: Sequence[Score]) -> ScoreSpread:
    """Statistics over trials; each trial counts once, however many batches it answered."""

    def known(name: str) -> list[float]:
        return [figure for score in scores if (figure := getattr(score, name)) is not None]

    n_batches = sum(score.n_batches for score in scores)
    spread: dict[str, float | None] = {}
    for target in TARGETS:
        errors_pct = known(f"{target}_mean_abs_pct")
        spread[f"{target}_mean_pct"] = _mean(errors_pct)
        spread[f"{target}_std_pct"] = float(np.std(errors_pct)) if errors_pct else None
        spread[f"{target}_worst_pct"] = max(errors_pct, default=None)
        for name in (f"{target}_coverage95", f"{target}_half_width_pct", f"{target}_interval_score_pct"):
            spread[name] = _mean(known(name))
    rejected_share = sum(score.n_rejected for score in scores) / n_batches if n_batches else None
    return ScoreSpread(len(scores), rejected_share, **spread)


def _rung(n_runs: int, estimator: str, trials: Sequence[Trial]) -> Rung:
    return Rung(
        n_runs=n_runs,
        estimator=estimator,
        n_subsets=len(trials),
        n_refused=sum(trial.refused is not None for trial in trials),
        left_out=spread_of([trial.left_out for trial in trials if trial.left_out]),
        validation=spread_of([trial.validation for trial in trials if trial.validation]),
    )


def _mean(figures: Sequence[float]) -> float | None:
    return float(np.mean(figures)) if figures else None


def curve_of(
    split: Sequence[SplitRun],
    vehicle: Vehicle,
    *,
    name: str,
    estimators: Sequence[str] = ESTIMATOR_NAMES,
    most_subsets: int = MOST_SUBSETS,
    on_trial: OnTrial = lambda done, of: None,
) -> LearningCurve:
    """The learning curve of runs already read, as ``Outcome.split`` of a calibration has them.

    Sizes are 2, 3, 4, 6 and 10 as far as there are runs, all runs, and all but one, the most that leave a run to judge
    by.
    """
    runs = [one.identification for one in split]
    if len(runs) < SIZES[1]:
        raise CalibrationImpossibleError(f"a learning curve needs at least three runs, there are {len(runs)}")
    sizes = sorted({*(size for size in SIZES if size <= len(runs)), len(runs) - 1, len(runs)})
    triples = triples_at_different_positions(runs, vehicle)
    subsets = [subset for size in sizes for subset in subsets_to_drive(runs, size, most_subsets, SEED)]
    asked = [(numbers, estimator) for numbers in dict.fromkeys((*triples, *subsets)) for estimator in estimators]
    trials: dict[tuple[tuple[int, ...], str], Trial] = {}
    for done, (numbers, estimator) in enumerate(asked):
        on_trial(done, len(asked))
        trials[numbers, estimator] = trial_of(split, vehicle, numbers, estimator)
    on_trial(len(asked), len(asked))
    return LearningCurve(
        campaign=name,
        seed=SEED,
        trials=tuple(trials[numbers, estimator] for numbers in subsets for estimator in estimators),
        triples=tuple(trials[numbers, estimator] for numbers in triples for estimator in estimators),
    )


def trial_of(split: Sequence[SplitRun], vehicle: Vehicle, numbers: tuple[int, ...], estimator: str) -> Trial:
    """Calibrate on the identification parts of the runs ``numbers`` and judge by the other data."""
    chosen = [one for one in split if one.identification.number in numbers]
    left_out = [one for one in split if one.identification.number not in numbers]
    try:
        calibrated = calibrated_on([one.identification for one in chosen], vehicle, estimator)
    except CalibrationImpossibleError as fault:
        return Trial(numbers, estimator, refused=str(fault))
    unseen = judge([one.identification for one in left_out], calibrated, estimator)
    later = judge([one.validation for one in left_out], calibrated, estimator)
    own_later = judge([one.validation for one in chosen], calibrated, estimator)
    return Trial(
        numbers,
        estimator,
        left_out=_score([*unseen, *later], vehicle),
        validation=_score([*later, *own_later], vehicle),
    )


def _score(judged: Sequence[Judged], vehicle: Vehicle) -> Score | None:
    return Score.of(errors_of(judged, vehicle)) if judged else None


def calibrated_on(runs: Sequence[KnownRun], vehicle: Vehicle, estimator: str) -> CalibratedVehicle:
    """The result of ``springscale calibrate`` on these runs for one estimator.

    Raises CalibrationImpossibleError if they allow no calibration.
    """
    with_batches = [run for run in runs if any(not batch.rejected for batch in run.batches)]
    if not with_batches:
        raise CalibrationImpossibleError("no batch of these runs can be used")
    payloads_kg = [run.payload_kg for run in with_batches]
    shares_pct = [run.front_share_pct for run in with_batches]
    is_ratio_index = estimator == "ratio_index"
    return CalibratedVehicle(
        id=IN_MEMORY_ID,
        vehicle=vehicle,
        payload_seen_kg=(min(payloads_kg), max(payloads_kg)),
        front_share_seen_pct=(min(shares_pct), max(shares_pct)),
        ratio_index=fit_ratio_index(runs, vehicle).calibration if is_ratio_index else None,
        cross_spectrum=None if is_ratio_index else calibrate_cross_spectrum(runs, vehicle),
        sensor_rate_seen_hz=sensor_rate_seen_hz(with_batches),
    )
