"""Load epochs: what consecutive batches show together while nobody can have changed the load.

    epoch = fused_epoch(epoch, estimate, rules)      # epoch is None at first
    replace(estimate, epoch=epoch_of(epoch.posterior, epoch.n_batches))

Only a batch's own error averages out; what batches of one load share stays, and cancels when two are compared
(gateway.posterior). A batch that does not fit opens a new epoch by itself.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Final

from gateway.core.change import EVEN, ROLLING, Rules, probability
from gateway.estimate import Epoch, Estimate
from gateway.posterior import CG_LEFT, FRONT_SHARE, PAYLOAD, Posterior, fused

STOP_THAT_ENDS_EPOCH_S: Final = 60.0
BATCH_IDS: Final = 20  # the newest that a weighed load names; it may rest on more


@dataclass(frozen=True)
class LoadEpoch:
    """All that is known of one load, since t_start_ns: the posteriors of its batches, as measured.

    ``is_change`` is true where a jump opened it.
    """

    t_start_ns: int
    batches: tuple[Posterior, ...]
    is_change: bool = False

    @cached_property
    def posterior(self) -> Posterior:
        """Of all batches together."""
        return fused(self.batches)

    @property
    def n_batches(self) -> int:
        return len(self.batches)


@dataclass(frozen=True, slots=True)
class WeighedLoad:
    """The last load that was weighed, and the batches it rests on: what a known weight is of.

    ``drive_start_ns`` and ``t_end_ns`` are of its last counted batch; ``batch_ids`` the newest, newest last.
    """

    epoch: LoadEpoch
    drive_start_ns: int
    t_end_ns: int
    batch_ids: tuple[str, ...]


def remembered(
    before: WeighedLoad | None, epoch: LoadEpoch | None, shown: Estimate, drive_start_ns: int
) -> WeighedLoad | None:
    """The load after one more full batch; ``shown`` is its estimate as it leaves, ``epoch`` the epoch after it.

    A batch that taught nothing changes nothing, nor does a stop: the last load stays until there is another.
    """
    if epoch is None or (before is not None and before.epoch is epoch):
        return before
    continues = before is not None and before.epoch.t_start_ns == epoch.t_start_ns
    earlier = before.batch_ids if before is not None and continues else ()
    return WeighedLoad(epoch, drive_start_ns, shown.t_end_ns, (*earlier, shown.id)[-BATCH_IDS:])


def fused_epoch(
    epoch: LoadEpoch | None, estimate: Estimate, rules: Rules, could_have_changed: bool = False
) -> LoadEpoch | None:
    """The epoch after ``estimate``: continued, or a new one after a stop or at a jump.

    Rejected and provisional estimates teach nothing; after a stop they still end the old epoch. So do estimates without
    payload and front share.
    """
    kept = None if could_have_changed else epoch
    posterior = estimate.as_measured
    if posterior is None or not teaches(estimate):
        return kept
    if kept is None:
        return LoadEpoch(estimate.t_start_ns, (posterior,))
    if probability(kept.posterior, posterior, ROLLING, rules) > EVEN:
        return LoadEpoch(estimate.t_start_ns, (posterior,), is_change=True)
    return LoadEpoch(kept.t_start_ns, (*kept.batches, posterior), kept.is_change)


def epoch_of(posterior: Posterior, n_batches: int) -> Epoch:
    """The quantities of a posterior that so many batches make up."""
    payload, front_share, cg_left = (posterior.quantity(i) for i in (PAYLOAD, FRONT_SHARE, CG_LEFT))
    return Epoch(payload, front_share, n_batches, cg_left, posterior)


def teaches(estimate: Estimate) -> bool:
    """Whether a load can be learned from it: a whole batch with payload and front share."""
    posterior = estimate.posterior
    if not estimate.counted or estimate.is_provisional or posterior is None or posterior.size <= FRONT_SHARE:
        return False
    return all(math.isfinite(x) for x in posterior.mean.tolist()) and posterior.std(PAYLOAD) > 0.0
