"""What was weighed, batch by batch, and batches of one load together."""

from collections.abc import Sequence
from dataclasses import dataclass

from gateway.core.fusion import teaches
from gateway.estimate import Estimate
from gateway.posterior import Posterior, fused


@dataclass(frozen=True, slots=True)
class Weighing:
    """One batch that counted: as measured, for known weights come and go and no load changes with them, and as shown.

    ``at`` is its place among all batches, ``by`` the calibration and the estimator.
    """

    at: int
    by: tuple[str | None, str]
    measured: Posterior
    shown: Posterior


@dataclass(frozen=True, slots=True)
class Load:
    """Weighings first to last (inclusive, by their number), taken as of one load."""

    first: int
    last: int
    measured: Posterior
    shown: Posterior

    @property
    def n_batches(self) -> int:
        return self.last - self.first + 1


def weighings_of(estimates: Sequence[Estimate]) -> list[Weighing]:
    """Those of the batches that tell a load."""
    return [
        Weighing(at, (one.calibration_id, one.estimator), one.as_measured, one.posterior)
        for at, one in enumerate(estimates)
        if teaches(one) and one.as_measured is not None and one.posterior is not None
    ]


def load_of(weighings: Sequence[Weighing], first: int, last: int) -> Load:
    """Weighings first to last together."""
    parts = weighings[first : last + 1]
    return Load(first, last, fused([one.measured for one in parts]), fused([one.shown for one in parts]))
