"""Does the advice of a plan help? What came of each next run that could have been driven, in short. Pure."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

Errors = tuple[float, float]  # mean |error| of payload and front share, percent (12)


@dataclass(frozen=True, slots=True)
class Choice:
    """One set of runs driven so far and every run that could follow it.

    ``before`` and ``after`` (by the run's number) are errors over one and the same set of batches;
    ``advised`` and ``least`` are the runs that the plan expects most and least of. ``expected`` is what it
    expects of the loads the vehicle carries before any of them.
    """

    numbers: tuple[int, ...]
    advised: int
    least: int
    expected: Errors
    before: Errors
    after: Mapping[int, Errors]


@dataclass(frozen=True, slots=True)
class Comparison:
    """Means over all choices, payload and front share.

    ``others`` is the mean of the runs not advised, what a fitter without advice may expect; ``best``
    and ``worst`` are found by hindsight, by the sum of both errors. better_share (0..1): how often
    the advised run did better than the mean of the others.
    """

    n_choices: int
    expected: Errors
    before: Errors
    advised: Errors
    others: Errors
    least: Errors
    best: Errors
    worst: Errors
    better_share: tuple[float, float]


@dataclass(frozen=True, slots=True)
class AdviceStudy:
    """``with_misses`` counts a rejected batch as a mid-range answer; ``answered`` leaves it out, so that a
    calibration that refuses much looks better than it is."""

    campaign: str
    with_misses: Comparison
    answered: Comparison

    def to_json(self) -> dict[str, Any]:
        """Plain numbers for a file or a report; null where nothing was answered."""
        return {"campaign": self.campaign, "with_misses": _plain(self.with_misses), "answered": _plain(self.answered)}


def compared(choices: Sequence[Choice]) -> Comparison:
    """Sums up. Raises ValueError without any choice."""
    if not choices:
        raise ValueError("nothing to compare: no runs could follow")
    advised = _rows([choice.after[choice.advised] for choice in choices])
    others = _rows([_mean_of_others(choice) for choice in choices])
    by_hindsight = [sorted(choice.after.values(), key=_both) for choice in choices]
    return Comparison(
        n_choices=len(choices),
        expected=_mean([choice.expected for choice in choices]),
        before=_mean([choice.before for choice in choices]),
        advised=_mean(advised),
        others=_mean(others),
        least=_mean([choice.after[choice.least] for choice in choices]),
        best=_mean([ordered[0] for ordered in by_hindsight]),
        worst=_mean([ordered[-1] for ordered in by_hindsight]),
        better_share=_mean(_rows(advised) < _rows(others)),
    )


def _plain(comparison: Comparison) -> dict[str, Any]:
    return {
        name: found if isinstance(found, int) else [x if np.isfinite(x) else None for x in found]
        for name, found in asdict(comparison).items()
    }


def _mean_of_others(choice: Choice) -> Errors:
    return _mean([errors for number, errors in choice.after.items() if number != choice.advised])


def _both(errors: Errors) -> float:
    """Their sum, to order by; where nothing was answered, the last."""
    return sum(errors) if np.isfinite(errors).all() else float("inf")


def _rows(errors: Any) -> np.ndarray:
    return np.asarray(errors, dtype=float).reshape(-1, 2)


def _mean(errors: Any) -> Errors:
    """Column by column over what was answered; NaN where nothing was."""
    payload, share = (_mean_known(column[np.isfinite(column)]) for column in _rows(errors).T)
    return payload, share


def _mean_known(column: np.ndarray) -> float:
    return float(np.mean(column)) if column.size else float("nan")
