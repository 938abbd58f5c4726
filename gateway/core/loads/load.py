"""Weighings of single batches, and loads made of several."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

from gateway.core.fusion import teaches
from gateway.estimate import Estimate
from gateway.posterior import Fusible, Posterior


@dataclass(frozen=True, slots=True)
class Weighing:
    """One counted batch: ``measured`` without known weights (they come and go without a change of load), ``shown`` with
    them. ``at`` is its index among all batches, ``by`` its calibration and estimator.
    """

    at: int
    by: tuple[str | None, str]
    measured: Posterior
    shown: Posterior


class Weighings:
    """Weighings in order; any consecutive ones can be fused as one load."""

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

    def load(self, first: int, last: int) -> "FusedLoad":
        """Weighings first to last (inclusive indexes) as one load."""
        return FusedLoad(first, last, self)


@dataclass(frozen=True)
class FusedLoad:
    """Weighings first to last (inclusive indexes), fused as one load."""

    first: int
    last: int
    weighings: Weighings = field(repr=False)

    @property
    def n_batches(self) -> int:
        return self.last - self.first + 1

    @cached_property
    def measured(self) -> Posterior:
        """The fused posterior without known weights."""
        return self.weighings.measured.fused(self.first, self.last + 1)

    @cached_property
    def shown(self) -> Posterior:
        return self.weighings.shown.fused(self.first, self.last + 1)


def weighings_of(estimates: Sequence[Estimate]) -> list[Weighing]:
    """The weighings of the batches that give a payload."""
    return [
        Weighing(at, (one.calibration_id, one.estimator), one.as_measured, one.posterior)
        for at, one in enumerate(estimates)
        if teaches(one) and one.as_measured is not None and one.posterior is not None
    ]
