"""Load epochs: what consecutive batches tell together while nobody can have changed the load.

    epoch = fused(epoch, estimate, could_have_changed)      # epoch is None at first
    replace(estimate, epoch=summary(epoch))

Part of a batch's error is its own, part is shared by all batches of one vehicle and load (the model's
error, what calibration left open, and what the vehicle has changed since), and only the first averages out. What is
shared hides no change of load. A batch that does not fit opens a new epoch by itself.
"""

import math
from dataclasses import dataclass, replace
from typing import Final

from gateway.estimate import UNKNOWN, Epoch, Estimate, Quantity

LEAST_OWN_VARIANCE: Final = 0.25
"""Of a batch's variance: batches of one load scatter at least so much (the rest was measured as 0.73 to 0.82)."""
PAYLOAD_OWN_STD_KG: Final = "payload_own_std_kg"
FRONT_SHARE_OWN_STD_PCT: Final = "front_share_own_std_pct"
CG_LEFT_OWN_STD_M: Final = "cg_left_own_std_m"
"""Names in ``Estimate.diagnostics`` of what is a batch's own, by its length and its road; half of it if absent."""
CHANGE_THRESHOLD: Final = 13.8  # chi-squared of two degrees of freedom, one false alarm in a thousand
CHANGE_THRESHOLD_SIDEWAYS: Final = 16.3  # likewise of three, where the load's place across is known too
STOP_THAT_ENDS_EPOCH_S: Final = 60.0


@dataclass(frozen=True, slots=True)
class Found:
    """One batch's number with the variance that is its own, and the one it shares."""

    number: float
    own_var: float
    shared_var: float


@dataclass(frozen=True, slots=True)
class Fused:
    """A running precision-weighted mean of n estimates, in the unit of the quantity."""

    mean: float
    precision: float  # sum of inverse variances of the batches' own
    shared_var: float  # mean, weighted alike
    n: int

    @property
    def var(self) -> float:
        """What is shared stays whole, what is each batch's own averages out."""
        return self.shared_var + 1.0 / self.precision

    @property
    def quantity(self) -> Quantity:
        """The mean and its standard deviation."""
        return Quantity(self.mean, math.sqrt(self.var))

    def distance2(self, found: Found) -> float:
        """Squared distance of another estimate in standard deviations of the difference; shared errors cancel."""
        return (found.number - self.mean) ** 2 / (found.own_var + 1.0 / self.precision)

    def joined(self, found: Found) -> "Fused":
        """With one more estimate."""
        precision = self.precision + 1.0 / found.own_var
        weight = 1.0 / (found.own_var * precision)
        mean = self.mean + weight * (found.number - self.mean)
        shared_var = self.shared_var + weight * (found.shared_var - self.shared_var)
        return Fused(mean, precision, shared_var, self.n + 1)


@dataclass(frozen=True, slots=True)
class LoadEpoch:
    """All that is known of one load, since t_start_ns. ``is_change`` is true where a jump opened it.

    ``cg_left_m`` is of the batches that told it; None while none did.
    """

    t_start_ns: int
    payload_kg: Fused
    front_share_pct: Fused
    is_change: bool = False
    cg_left_m: Fused | None = None

    def distance2(self, payload: Found, share: Found, cg_left: Found | None) -> float:
        """How far another batch lies off, in parts of what would be a change."""
        planar = self.payload_kg.distance2(payload) + self.front_share_pct.distance2(share)
        if cg_left is None or self.cg_left_m is None:
            return planar / CHANGE_THRESHOLD
        return (planar + self.cg_left_m.distance2(cg_left)) / CHANGE_THRESHOLD_SIDEWAYS


def fused(epoch: LoadEpoch | None, estimate: Estimate, could_have_changed: bool = False) -> LoadEpoch | None:
    """The epoch after ``estimate``: continued, or begun anew after a stop or at a jump.

    Rejected and provisional estimates teach nothing; after a stop they still end the old epoch.
    Estimates without payload and front share and their standard deviations are passed over; the lateral place counts
    where a batch tells it.
    """
    kept = None if could_have_changed else epoch
    if not teaches(estimate):
        return kept
    payload = found_of(estimate, estimate.payload, PAYLOAD_OWN_STD_KG)
    share = found_of(estimate, estimate.front_share, FRONT_SHARE_OWN_STD_PCT)
    cg_left = found_of(estimate, estimate.cg_left, CG_LEFT_OWN_STD_M) if is_told(estimate.cg_left) else None
    begun = LoadEpoch(
        estimate.t_start_ns,
        begun_of(payload),
        begun_of(share),
        cg_left_m=None if cg_left is None else begun_of(cg_left),
    )
    if kept is None:
        return begun
    if kept.distance2(payload, share, cg_left) > 1.0:
        return replace(begun, is_change=True)
    return replace(
        kept,
        payload_kg=kept.payload_kg.joined(payload),
        front_share_pct=kept.front_share_pct.joined(share),
        cg_left_m=_joined(kept.cg_left_m, cg_left),
    )


def _joined(before: Fused | None, found: Found | None) -> Fused | None:
    if before is None or found is None:
        return before if found is None else begun_of(found)
    return before.joined(found)


def found_of(estimate: Estimate, quantity: Quantity, own_name: str) -> Found:
    """One quantity of an estimate, its variance split; ``own_name`` is that of the diagnostic which tells its own."""
    var = quantity.std**2
    own_var = estimate.diagnostics.get(own_name, math.sqrt(0.5 * var)) ** 2
    own_var = min(max(own_var, LEAST_OWN_VARIANCE * var), var)
    return Found(quantity.number, own_var, var - own_var)


def begun_of(found: Found) -> Fused:
    """The mean of one."""
    return Fused(found.number, 1.0 / found.own_var, found.shared_var, 1)


def summary(epoch: LoadEpoch | None) -> Epoch | None:
    """What ``Estimate.epoch`` holds; nothing without an epoch."""
    if epoch is None:
        return None
    cg_left = UNKNOWN if epoch.cg_left_m is None else epoch.cg_left_m.quantity
    return Epoch(epoch.payload_kg.quantity, epoch.front_share_pct.quantity, epoch.payload_kg.n, cg_left)


def teaches(estimate: Estimate) -> bool:
    """Whether a load can be learnt from it: a whole batch that tells payload and front share."""
    is_whole = estimate.counted and not estimate.is_provisional
    return is_whole and is_told(estimate.payload) and is_told(estimate.front_share)


def is_told(quantity: Quantity) -> bool:
    """Number and standard deviation are there."""
    return math.isfinite(quantity.number) and math.isfinite(quantity.std) and quantity.std > 0.0
