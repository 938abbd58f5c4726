"""Rows in, estimates out: the one path that the live service and the offline tools share."""

from collections.abc import Callable, Iterator
from copy import copy
from dataclasses import dataclass, replace

from gateway.budget import budget_of
from gateway.core.batch import Traits
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.cargo import is_said
from gateway.core.change import Rules
from gateway.core.estimator import estimate
from gateway.core.fusion import STOP_THAT_ENDS_EPOCH_S, LoadEpoch, WeighedLoad, epoch_of, fused_epoch, remembered
from gateway.core.known_weights import Knowledge
from gateway.core.scheduler import Scheduler
from gateway.core.settings import BatchSettings
from gateway.core.weights import weighed
from gateway.estimate import Estimate
from gateway.posterior import Posterior
from gateway.records import Batch, Motion, Why


@dataclass(frozen=True, slots=True)
class Identity:
    """Whose estimates these are."""

    vehicle_id: str | None = None
    vin: str | None = None


OnBatch = Callable[[Batch, Estimate, Motion], None]


class Flow:
    """Scheduler and estimator in a row. Feed it decoded rows in order of arrival.

    ``knowledge``, what known weights taught, may be set from any thread and counts from the next batch on; ``weighed``
    is the last load epoch with a counted batch, as measured: what a known weight is of. ``on_batch`` hears of every
    batch before its estimate leaves: with it, and with the rows it was made of.
    """

    def __init__(
        self,
        settings: BatchSettings,
        traits: Traits,
        calibrated: CalibratedVehicle | None,
        estimator: str,
        identity: Identity,
        knowledge: Knowledge | None = None,
    ) -> None:
        self.settings = settings
        self.scheduler = Scheduler(settings, traits)
        self._calibrated = calibrated
        self._estimator = estimator
        self._identity = identity
        self._epoch: LoadEpoch | None = None
        self._drive_start_ns: int | None = None
        self._is_epoch_over = False
        self.knowledge = knowledge
        self.weighed: WeighedLoad | None = None
        self._rules = Rules.of(calibrated.vehicle) if calibrated else Rules()
        self.on_batch: OnBatch = lambda batch, found, rows: None

    @property
    def load_may_have_changed(self) -> bool:
        """True where the vehicle has driven on since ``weighed`` after a stop long enough to load or unload."""
        weighed, drive_start_ns = self.weighed, self.scheduler.drive_start_ns
        if weighed is None or drive_start_ns is None:
            return False
        return self._is_epoch_over or drive_start_ns != weighed.drive_start_ns

    def branch(self) -> "Flow":
        """Another that goes on from here: what either is fed leaves no trace in the other."""
        other = copy(self)
        other.scheduler = self.scheduler.branch()
        return other

    def feed(self, motion: Motion) -> Iterator[Estimate]:
        """Estimates and rejections of the batches that end with these rows, provisional ones among them."""
        return map(self.weigh, self.scheduler.feed(motion))

    def flush(self, ended_by: Why | None = None) -> Iterator[Estimate]:
        """The stream has ended, or something has broken it: what the open window still tells."""
        return map(self.weigh, self.scheduler.flush(ended_by))

    def weigh(self, batch: Batch) -> Estimate:
        """What a batch of ``scheduler`` taught; they come in order, each once. :meth:`feed` and :meth:`flush` do it."""
        rows = self.scheduler.take_rows()
        shown = self._answer(batch)
        self.on_batch(batch, shown, rows)
        return shown

    def _answer(self, batch: Batch) -> Estimate:
        found = estimate(batch, self._calibrated, self._estimator)
        found = replace(found, vehicle_id=self._identity.vehicle_id, vin=self._identity.vin)
        if batch.is_provisional:
            self._is_epoch_over |= batch.longest_stop_s >= STOP_THAT_ENDS_EPOCH_S
            return self._shown(found)
        found = replace(found, way=self.scheduler.way_of_last)
        shown = self._shown(found, self._fused(batch, found))
        self.weighed = remembered(self.weighed, self._epoch, shown, batch.drive_start_ns)
        self._is_epoch_over = self._epoch is None
        return shown

    def _shown(self, found: Estimate, epoch: LoadEpoch | None = None) -> Estimate:
        """As it leaves: with what known weights taught, the weights that follow and the budget of the error."""
        if found.posterior is not None:
            found = self._with_knowledge(found, epoch)
        if self._calibrated is None:
            return weighed(found, None)
        vehicle = self._calibrated.vehicle
        if found.posterior is not None:
            found = replace(found, error_budget=budget_of(found.posterior, is_shape_said=is_said(vehicle)))
        return weighed(found, vehicle, self._calibrated.unsprung)

    def _with_knowledge(self, found: Estimate, epoch: LoadEpoch | None) -> Estimate:
        knowledge = self.knowledge
        if knowledge is None or not knowledge.is_for(found.calibration_id, found.estimator):
            return replace(found, epoch=None if epoch is None else epoch_of(epoch.posterior, epoch.n_batches))

        def known(posterior: Posterior) -> Posterior:
            return knowledge.applied(posterior, found.t_end_ns)

        assert found.posterior is not None
        answer = replace(
            found.answered(known(found.posterior)), measured=found.posterior, known_weights_id=knowledge.id
        )
        return replace(answer, epoch=None if epoch is None else epoch_of(known(epoch.posterior), epoch.n_batches))

    def _fused(self, batch: Batch, found: Estimate) -> LoadEpoch | None:
        """The load epoch that this batch belongs to; a new drive or a long stop opens a new one."""
        is_new_drive = batch.drive_start_ns != self._drive_start_ns
        self._drive_start_ns = batch.drive_start_ns
        could_have_changed = is_new_drive or batch.longest_stop_s >= STOP_THAT_ENDS_EPOCH_S
        self._epoch = fused_epoch(self._epoch, found, self._rules, could_have_changed)
        return self._epoch if found.counted else None
