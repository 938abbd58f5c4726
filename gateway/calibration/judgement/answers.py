"""Weighed batches as columns, and their errors compared with their intervals."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import ndtri, stdtr, stdtrit

from gateway.calibration.judgement.coverage import coverage_of
from gateway.calibration.judgement.evaluation import Judged, Target
from gateway.records import F64, I64

LEVELS: Final = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99])  # chosen: even, and the tail


@dataclass(frozen=True, slots=True, eq=False)
class Answers:
    """Weighed batches of one set, for one quantity: everything (n,) in its unit; ``half95`` halves the interval."""

    run: I64
    true: F64
    estimated: F64
    half95: F64
    speed_mps: F64

    @property
    def error(self) -> F64:
        """Estimated minus true."""
        return self.estimated - self.true


def answers_of(judged: Sequence[Judged], target: Target) -> Answers:
    """Payload in kg or front share in percent; batches without an answer or a known truth are left out."""
    compared = [(one, one.compared(target)) for one in judged]
    answered = [(one, row) for one, row in compared if math.isfinite(row.estimated) and math.isfinite(row.true)]
    rows = np.array([row for _, row in answered], dtype=float).reshape(-1, 4)
    return Answers(
        run=np.array([one.run for one, _ in answered], dtype=np.int64),
        true=rows[:, 0],
        estimated=rows[:, 1],
        half95=0.5 * (rows[:, 3] - rows[:, 2]),
        speed_mps=np.array([one.estimate.mean_speed_mps for one, _ in answered], dtype=float),
    )


def standardised(answers: Answers, dof: float | None) -> F64:
    """Errors (n,) as the normal deviates that are as improbable: intervals are Student's with ``dof``, or normal."""
    if dof is None:
        return np.asarray(answers.error / answers.half95 * ndtri(0.975))
    scaled = answers.error / answers.half95 * stdtrit(dof, 0.975)
    return np.asarray(ndtri(np.clip(stdtr(dof, scaled), 1e-12, 1.0 - 1e-12)))


def observed_coverage(answers: Answers, dof: float | None) -> F64:
    """Share, and its lower and upper 95 % limit (k, 3), of intervals of each of LEVELS that contain the truth."""
    reach = np.abs(standardised(answers, dof))
    rows = []
    for level in LEVELS:
        coverage = coverage_of((reach <= ndtri(0.5 + 0.5 * level)).tolist(), answers.run.tolist())
        rows.append((coverage.share, coverage.low, coverage.high))
    return np.array(rows)
