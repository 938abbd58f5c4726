"""Rows in, estimates out: the one path that the live service and the offline tools share."""

from collections.abc import Callable, Iterator
from copy import copy
from dataclasses import dataclass, replace

from gateway.core.batch import Traits
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.estimator import estimate
from gateway.core.fusion import STOP_THAT_ENDS_EPOCH_S, LoadEpoch, fused, summary
from gateway.core.scheduler import Scheduler
from gateway.core.settings import BatchSettings
from gateway.core.stated_share import told
from gateway.core.tare import Tare, Weighed, remembered, tared
from gateway.core.weights import NOT_CALIBRATED, weighed
from gateway.estimate import Epoch, Estimate
from gateway.records import Batch, Motion, Why


@dataclass(frozen=True, slots=True)
class Identity:
    """Whose estimates these are."""

    vehicle_id: str | None = None
    vin: str | None = None


OnBatch = Callable[[Batch, Estimate, Motion], None]


class Flow:
    """Scheduler and estimator in a row. Feed it decoded rows in order of arrival.

    ``tare`` may be set from any thread and counts from the next batch on; ``weighed`` is the last load
    epoch with a counted batch, in raw numbers: what a tare is made from. ``on_batch`` hears of every batch
    before its estimate leaves: with it, and with the rows it was made of.
    """

    def __init__(
        self,
        settings: BatchSettings,
        traits: Traits,
        calibrated: CalibratedVehicle | None,
        estimator: str,
        identity: Identity,
        tare: Tare | None = None,
    ) -> None:
        self.settings = settings
        self.scheduler = Scheduler(settings, traits)
        self._calibrated = calibrated
        self._estimator = estimator
        self._identity = identity
        self._epoch: LoadEpoch | None = None
        self._drive_start_ns: int | None = None
        self._is_epoch_over = False
        self.tare = tare
        self.weighed: Weighed | None = None
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
        shown = self._shown(replace(found, epoch=self._fused(batch, found)))
        self.weighed = remembered(self.weighed, self._epoch, shown, batch.drive_start_ns)
        self._is_epoch_over = self._epoch is None
        return shown

    def _shown(self, found: Estimate) -> Estimate:
        """As it leaves: less the zero, with the weights that follow; epochs and tares are made of what was measured."""
        vehicle, unsprung = None, NOT_CALIBRATED
        if self._calibrated:
            vehicle, unsprung = self._calibrated.vehicle, self._calibrated.unsprung
        return weighed(tared(told(found, vehicle), self.tare), vehicle, unsprung)

    def _fused(self, batch: Batch, found: Estimate) -> Epoch | None:
        """The load epoch that this batch belongs to; a new drive or a long stop opens a new one."""
        is_new_drive = batch.drive_start_ns != self._drive_start_ns
        self._drive_start_ns = batch.drive_start_ns
        could_have_changed = is_new_drive or batch.longest_stop_s >= STOP_THAT_ENDS_EPOCH_S
        self._epoch = fused(self._epoch, found, could_have_changed)
        return summary(self._epoch) if found.counted else None
