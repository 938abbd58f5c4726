"""What was weighed, batch by batch, and batches of one load together."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

from gateway.core.fusion import teaches
from gateway.estimate import Estimate
from gateway.posterior import Fusible, Posterior


@dataclass(frozen=True, slots=True)
class Weighing:
    """One batch that counted: as measured, for known weights come and go and no load changes with them, and as shown.

    ``at`` is its place among all batches, ``by`` the calibration and the estimator.
    """

    at: int
    by: tuple[str | None, str]
    measured: Posterior
    shown: Posterior


class Weighings:
    """Weighings in their order, and any that follow one another taken as of one load."""

    def __init__(self, each: Sequence[Weighing]) -> None:
        self.each = each

    @cached_property
    def measured(self) -> Fusible:
        return Fusible([one.measured for one in self.each])

    @cached_property
    def shown(self) -> Fusible:
        return Fusible([one.shown for one in self.each])

    def __len__(self) -> int:
        return len(self.each)

    def load(self, first: int, last: int) -> "Load":
        """Weighings first to last (inclusive, by their number) together."""
        return Load(first, last, self)


@dataclass(frozen=True)
class Load:
    """Weighings first to last (inclusive, by their number), taken as of one load."""

    first: int
    last: int
    weighings: Weighings = field(repr=False)

    @property
    def n_batches(self) -> int:
        return self.last - self.first + 1

    @cached_property
    def measured(self) -> Posterior:
        """Without what known weights teach."""
        return self.weighings.measured.fused(self.first, self.last + 1)

    @cached_property
    def shown(self) -> Posterior:
        return self.weighings.shown.fused(self.first, self.last + 1)


def weighings_of(estimates: Sequence[Estimate]) -> list[Weighing]:
    """Those of the batches that tell a load."""
    return [
        Weighing(at, (one.calibration_id, one.estimator), one.as_measured, one.posterior)
        for at, one in enumerate(estimates)
        if teaches(one) and one.as_measured is not None and one.posterior is not None
    ]
