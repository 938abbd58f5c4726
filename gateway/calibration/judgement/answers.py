"""Answered batches as columns, and how their errors compare with the intervals they came with."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import ndtri, stdtr, stdtrit

from gateway.calibration.judgement.coverage import coverage_of
from gateway.calibration.judgement.evaluation import Judged
from gateway.records import F64, I64

LEVELS: Final = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99])


@dataclass(frozen=True, slots=True, eq=False)
class Answers:
    """Answered batches of one set, for one quantity: everything (n,) in its unit; ``half95`` halves the interval."""

    quantity: str
    run: I64
    true: F64
    estimated: F64
    half95: F64
    speed_mps: F64

    @property
    def error(self) -> F64:
        """Estimated less true."""
        return self.estimated - self.true

    @property
    def notes(self) -> tuple[str, ...]:
        """What each is."""
        return tuple(f"run {number}" for number in self.run)


def answers_of(judged: Sequence[Judged], quantity: str) -> Answers:
    """Of "payload" in kg or "front_share" in percent; batches without an answer are left out."""
    is_payload = quantity == "payload"
    rows = [
        (one.payload_kg, e.payload_kg, *e.payload_interval95_kg)
        if is_payload
        else (one.front_share_pct, e.front_share_pct, *e.front_share_interval95_pct)
        for one in judged
        for e in [one.estimate]
    ]
    found = np.array(rows, dtype=float).reshape(-1, 4)
    kept = np.isfinite(found[:, 1])
    found = found[kept]
    return Answers(
        quantity,
        np.array([one.run for one in judged], dtype=np.int64)[kept],
        found[:, 0],
        found[:, 1],
        0.5 * (found[:, 3] - found[:, 2]),
        np.array([one.estimate.mean_speed_mps for one in judged], dtype=float)[kept],
    )


def standardised(answers: Answers, dof: float | None) -> F64:
    """Errors (n,) as the normal deviates that are as improbable: intervals are Student's with ``dof``, or normal."""
    if dof is None:
        return np.asarray(answers.error / answers.half95 * ndtri(0.975))
    scaled = answers.error / answers.half95 * stdtrit(dof, 0.975)
    return np.asarray(ndtri(np.clip(stdtr(dof, scaled), 1e-12, 1.0 - 1e-12)))


def observed_coverage(answers: Answers, dof: float | None, levels: F64 = LEVELS) -> F64:
    """Share, and its lower and upper 95 % limit (k, 3), of intervals of each nominal level that hold the truth."""
    reach = np.abs(standardised(answers, dof))
    rows = []
    for level in levels:
        found = coverage_of((reach <= ndtri(0.5 + 0.5 * level)).tolist(), answers.run.tolist())
        rows.append((found.share, found.low, found.high))
    return np.array(rows)
