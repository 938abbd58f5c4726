"""Load epochs: what consecutive batches tell together while nobody can have changed the load.

    epoch = fused(epoch, estimate, could_have_changed)      # epoch is None at first
    replace(estimate, epoch=fields_of(epoch))

Part of a batch's error is its own, part is shared by all batches of one vehicle and load (the model's
error), and only the first averages out. A batch that does not fit opens a new epoch by itself.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from gateway.records import Estimate

SHARED_VARIANCE: Final = 0.5  # of a batch's variance: what the batches of an epoch have in common
CHANGE_THRESHOLD: Final = 13.8  # chi-squared of two degrees of freedom, one false alarm in a thousand
STOP_THAT_ENDS_EPOCH_S: Final = 60.0


@dataclass(frozen=True, slots=True)
class Fused:
    """A running precision-weighted mean of n estimates, in the unit of the quantity."""

    mean: float
    precision: float  # sum of inverse variances
    n: int

    @property
    def var(self) -> float:
        """Shared part whole, own part divided by n."""
        return self.n / self.precision * (SHARED_VARIANCE + (1.0 - SHARED_VARIANCE) / self.n)

    def distance2(self, found: float, var: float) -> float:
        """Squared distance of another estimate in standard deviations of the difference; shared errors cancel."""
        own = 1.0 - SHARED_VARIANCE
        return (found - self.mean) ** 2 / (own * (var + 1.0 / self.precision))

    def joined(self, found: float, var: float) -> "Fused":
        """With one more estimate."""
        precision = self.precision + 1.0 / var
        return Fused(self.mean + (found - self.mean) / (var * precision), precision, self.n + 1)


@dataclass(frozen=True, slots=True)
class LoadEpoch:
    """All that is known of one load, since t_start_ns. ``is_change`` is true where a jump opened it."""

    t_start_ns: int
    payload_kg: Fused
    front_share_pct: Fused
    is_change: bool = False


def fused(epoch: LoadEpoch | None, estimate: Estimate, could_have_changed: bool = False) -> LoadEpoch | None:
    """The epoch after ``estimate``: continued, or begun anew after a stop or at a jump.

    Rejected and provisional estimates teach nothing; after a stop they still end the old epoch.
    Estimates without both numbers and their standard deviations are passed over.
    """
    kept = None if could_have_changed else epoch
    if not _teaches(estimate):
        return kept
    payload_var, share_var = estimate.payload_std_kg**2, estimate.front_share_std_pct**2
    begun = LoadEpoch(
        estimate.t_start_ns,
        Fused(estimate.payload_kg, 1.0 / payload_var, 1),
        Fused(estimate.front_share_pct, 1.0 / share_var, 1),
    )
    if kept is None:
        return begun
    jump = kept.payload_kg.distance2(estimate.payload_kg, payload_var)
    jump += kept.front_share_pct.distance2(estimate.front_share_pct, share_var)
    if jump > CHANGE_THRESHOLD:
        return LoadEpoch(begun.t_start_ns, begun.payload_kg, begun.front_share_pct, is_change=True)
    return LoadEpoch(
        kept.t_start_ns,
        kept.payload_kg.joined(estimate.payload_kg, payload_var),
        kept.front_share_pct.joined(estimate.front_share_pct, share_var),
        kept.is_change,
    )


def fields_of(epoch: LoadEpoch | None) -> Mapping[str, float]:
    """What ``Estimate.epoch`` holds; empty without an epoch."""
    if epoch is None:
        return {}
    return {
        "payload_kg": epoch.payload_kg.mean,
        "payload_std_kg": math.sqrt(epoch.payload_kg.var),
        "front_share_pct": epoch.front_share_pct.mean,
        "front_share_std_pct": math.sqrt(epoch.front_share_pct.var),
        "n_batches": float(epoch.payload_kg.n),
    }


def _teaches(estimate: Estimate) -> bool:
    stds = (estimate.payload_std_kg, estimate.front_share_std_pct)
    numbers = (estimate.payload_kg, estimate.front_share_pct, *stds)
    return (
        estimate.counted
        and not estimate.is_provisional
        and all(math.isfinite(x) for x in numbers)
        and all(s > 0.0 for s in stds)
    )
