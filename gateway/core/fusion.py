"""Load epochs: consecutive batches fused while the load cannot have changed.

    epoch = fused_epoch(epoch, estimate, rules)      # epoch is None at first
    replace(estimate, epoch=epoch_of(epoch.posterior, epoch.n_batches))

Only a batch's own error averages out. The error that batches of one load share remains, and cancels in a comparison of
two batches (gateway.estimates.posterior). A batch that does not fit opens a new epoch.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Final

from gateway.core.change import EVEN, ROLLING, Rules, probability
from gateway.estimates.batch_estimate import Epoch, Estimate
from gateway.estimates.posterior import CG_LEFT, FRONT_SHARE, PAYLOAD, Posterior, fused

STOP_THAT_ENDS_EPOCH_S: Final = 60.0  # chosen: time enough to load or unload


@dataclass(frozen=True)
class LoadEpoch:
    """The posteriors of the batches of one load since t_start_ns.

    ``is_change`` is true if a jump between batches opened the epoch.
    """

    t_start_ns: int
    batches: tuple[Posterior, ...]
    is_change: bool = False

    @cached_property
    def posterior(self) -> Posterior:
        """The posterior of all batches together."""
        return fused(self.batches)

    @property
    def n_batches(self) -> int:
        return len(self.batches)


def fused_epoch(
    epoch: LoadEpoch | None, estimate: Estimate, rules: Rules, could_have_changed: bool = False
) -> LoadEpoch | None:
    """The epoch after ``estimate``: continued, or a new one after a stop or at a jump.

    Rejected and provisional estimates, and those without payload and front share, add nothing; after a stop they still
    end the old epoch.
    """
    kept = None if could_have_changed else epoch
    posterior = estimate.posterior
    if posterior is None or not teaches(estimate):
        return kept
    if kept is None:
        return LoadEpoch(estimate.t_start_ns, (posterior,))
    if probability(kept.posterior, posterior, ROLLING, rules) > EVEN:
        return LoadEpoch(estimate.t_start_ns, (posterior,), is_change=True)
    return LoadEpoch(kept.t_start_ns, (*kept.batches, posterior), kept.is_change)


def epoch_of(posterior: Posterior, n_batches: int) -> Epoch:
    """The quantities of a posterior fused from ``n_batches``."""
    payload, front_share, cg_left = (posterior.quantity(i) for i in (PAYLOAD, FRONT_SHARE, CG_LEFT))
    return Epoch(payload, front_share, n_batches, cg_left, posterior)


def teaches(estimate: Estimate) -> bool:
    """Whether a load can be fused from this estimate: a whole batch with payload and front share."""
    posterior = estimate.posterior
    if not estimate.counted or estimate.is_provisional or posterior is None or posterior.size <= FRONT_SHARE:
        return False
    return all(math.isfinite(x) for x in posterior.mean.tolist()) and posterior.std(PAYLOAD) > 0.0
