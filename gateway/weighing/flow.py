"""Rows in, estimates out: the one path that the live service and the offline tools share."""

from collections.abc import Callable, Iterator
from copy import copy
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

from gateway.core.batch import Traits
from gateway.core.batch_settings import BatchSettings
from gateway.core.cargo import is_said
from gateway.core.change import Rules
from gateway.core.fusion import STOP_THAT_ENDS_EPOCH_S, LoadEpoch, epoch_of, fused_epoch
from gateway.core.journey import way_of
from gateway.core.pool import (
    LEAST_LOAD_S,
    MOST_DRIVEN_S,
    Part,
    Parts,
    can_be_pooled,
    changes_of,
    continued,
    driven_s,
    has_stretch,
    is_batch,
    missing_s,
    spanned,
    usable_s,
)
from gateway.core.scheduler import Scheduler
from gateway.core.weights.on_the_road import weighed
from gateway.estimates.batch_estimate import UNWATCHED, Estimate, Way
from gateway.estimates.budget import budget_of
from gateway.estimates.posterior import Posterior
from gateway.records import Batch, Motion, Why
from gateway.weighing.calibrated import CalibratedVehicle
from gateway.weighing.estimator import estimate


@dataclass(frozen=True, slots=True)
class Identity:
    """The vehicle that the estimates belong to."""

    vehicle_id: str | None = None
    vin: str | None = None


OnWindow = Callable[[Batch, Motion], None]
_TOO_LITTLE: Final = frozenset({Why.TOO_SHORT, Why.SPEED_SPREAD, Why.TOO_UNCERTAIN, Why.AMBIGUOUS})
"""Reasons that go away with more driving."""


class Flow:
    """Scheduler, pool and estimator in sequence. Feed it decoded rows in order of arrival.

    It yields estimates and refusals in order of time, and between them remainders: windows with too little driving,
    which wait in the pool (core.pool) for later windows.
    ``on_window`` is called for each window, with its rows, before it is weighed.
    """

    def __init__(
        self,
        settings: BatchSettings,
        traits: Traits,
        calibrated: CalibratedVehicle | None,
        estimator: str,
        identity: Identity,
    ) -> None:
        self.settings = settings
        self.scheduler = Scheduler(settings, traits)
        self._traits = traits
        self._calibrated = calibrated
        self._estimator = estimator
        self._identity = identity
        self._epoch: LoadEpoch | None = None
        self._drive_start_ns: int | None = None
        self._pool: Parts = ()
        self._open_s = 0.0  # usable time in the open window, by its last provisional estimate
        self._rules = Rules.of(calibrated.vehicle) if calibrated else Rules()
        self.on_window: OnWindow = lambda batch, rows: None

    @property
    def missing_s(self) -> float:
        """Usable driving (s) that the next batch still lacks, as of the last provisional estimate."""
        return max(0.0, missing_s(self._pool, self.settings) - self._open_s)

    def branch(self) -> "Flow":
        """An independent copy that continues from here."""
        other = copy(self)
        other.scheduler = self.scheduler.branch()
        return other

    def feed(self, motion: Motion) -> Iterator[Estimate]:
        """The estimates of the windows that end with these rows, provisional ones included."""
        for window in self.scheduler.feed(motion):
            yield from self.weigh(window)

    def flush(self, ended_by: Why | None = None) -> Iterator[Estimate]:
        """Close the open window, because the stream ended or broke, and yield its estimates."""
        for window in self.scheduler.flush(ended_by):
            yield from self.weigh(window)

    def weigh(self, window: Batch) -> list[Estimate]:
        """The estimates of a window of ``scheduler``, at least one, in order of time. :meth:`feed` and :meth:`flush`
        call it.
        """
        rows = self.scheduler.take_rows()
        self.on_window(window, rows)
        return [self._early(window)] if window.is_provisional else self._of_window(window, rows)

    def _early(self, window: Batch) -> Estimate:
        self._open_s = window.usable_s
        parts = continued(self._pool, window)
        if parts and can_be_pooled(window, self.settings):
            window = spanned((*parts, Part(window, Way())), parts[0].batch.t_start_ns, window.t_end_ns)
        return self._shown(self._named(estimate(window, self._calibrated, self._estimator)))

    def _of_window(self, window: Batch, rows: Motion) -> list[Estimate]:
        way, self._open_s = self.scheduler.way_of_last, 0.0
        parts = continued(self._pool, window)
        self._pool = ()
        is_short = Why.TOO_SHORT in window.rejected and Why.TIME_STAMPS not in window.rejected
        can_wait = self._calibrated is not None and can_be_pooled(window, self.settings)
        if not (is_short or (can_wait and (parts or has_stretch(window)))):
            return [self._counted(window, way, window.t_start_ns)]
        if not can_wait:
            return [self._remainder(window, way)]
        parts = (*parts, Part(window, way))
        if is_batch(parts, self.settings):
            return self._of_parts(parts, rows)
        if driven_s(parts) >= MOST_DRIVEN_S:
            whole = spanned(parts, parts[0].batch.t_start_ns, window.t_end_ns)
            return [self._counted(replace(whole, rejected=(Why.TOO_SLOW,)), way, window.t_start_ns)]
        self._pool = parts
        return [self._remainder(window, way)]

    def _of_parts(self, parts: Parts, rows: Motion) -> list[Estimate]:
        """The estimates once the pool holds enough for a batch: one, or one per load if the load changed at a stop.

        Loads that were gone before this window had too little driving for a batch, and get no estimate.
        """
        window, way = parts[-1].batch, parts[-1].way
        begin_ns, end_ns = parts[0].batch.t_start_ns, window.t_end_ns
        changes_ns = changes_of(parts, self._posterior, self._rules)
        if not changes_ns:
            found = self._counted(spanned(parts, begin_ns, end_ns), way, window.t_start_ns)
            may_wait = window.rejected and driven_s(parts) < MOST_DRIVEN_S
            if not (may_wait and found.rejected and _TOO_LITTLE.issuperset(found.rejected)):
                return [found]
            self._pool = parts
            return [self._remainder(window, way)]
        loads = pairwise([begin_ns, *changes_ns, end_ns])
        return [self._of_load(parts, rows, *load) for load in loads if load[1] > window.t_start_ns]

    def _of_load(self, parts: Parts, rows: Motion, begin_ns: int, end_ns: int) -> Estimate:
        """The estimate of one of several loads, from begin to end. If the last is too short, it waits in the pool."""
        window = parts[-1].batch
        batch, piece = (spanned(which, begin_ns, end_ns) for which in (parts, parts[-1:]))
        before = parts[-1].way.before if piece.t_start_ns == window.t_start_ns else UNWATCHED
        way = way_of(rows, piece, self.settings, self._traits, before)
        if usable_s(parts, begin_ns, end_ns) >= LEAST_LOAD_S:
            return self._counted(batch, way, piece.t_start_ns, is_new_load=begin_ns > parts[0].batch.t_start_ns)
        if end_ns < window.t_end_ns:
            return self._counted(replace(batch, rejected=(Why.LOAD_CHANGED,)), way, piece.t_start_ns)
        self._pool = tuple(
            Part(spanned((part,), begin_ns, end_ns), part.way) for part in parts if part.batch.t_end_ns > begin_ns
        )
        return self._remainder(piece, way)

    def _posterior(self, stretch: Batch) -> Posterior | None:
        """The posterior as measured; None if the stretch cannot be weighed."""
        found = estimate(stretch, self._calibrated, self._estimator)
        return found.posterior if found.counted else None

    def _remainder(self, window: Batch, way: Way) -> Estimate:
        """The result for a window, or a piece of one, that is not a batch."""
        blank = estimate(replace(window, rejected=window.rejected or (Why.TOO_SHORT,)), None, self._estimator)
        calibration_id = self._calibrated.id if self._calibrated else None
        found = replace(blank, rejected=window.rejected or (Why.TOO_SHORT,), calibration_id=calibration_id)
        return self._finished(window, replace(self._named(found), is_remainder=True, way=way, spectra=None))

    def _counted(self, batch: Batch, way: Way, way_start_ns: int, *, is_new_load: bool = False) -> Estimate:
        """An estimate or a refusal. Its distance may be counted from later than the batch's start."""
        since_ns = None if way_start_ns == batch.t_start_ns else way_start_ns
        found = self._named(estimate(batch, self._calibrated, self._estimator))
        return self._finished(batch, replace(found, way=replace(way, since_ns=since_ns)), is_new_load=is_new_load)

    def _finished(self, batch: Batch, found: Estimate, *, is_new_load: bool = False) -> Estimate:
        return self._shown(found, self._fused(batch, found, is_new_load))

    def _named(self, found: Estimate) -> Estimate:
        return replace(found, vehicle_id=self._identity.vehicle_id, vin=self._identity.vin)

    def _shown(self, found: Estimate, epoch: LoadEpoch | None = None) -> Estimate:
        """The estimate as published: with its load epoch, the weights on the road and the error budget."""
        if found.posterior is not None:
            found = replace(found, epoch=None if epoch is None else epoch_of(epoch.posterior, epoch.n_batches))
        if self._calibrated is None:
            return weighed(found, None)
        vehicle = self._calibrated.vehicle
        if found.posterior is not None:
            found = replace(found, error_budget=budget_of(found.posterior, is_shape_said=is_said(vehicle)))
        return weighed(found, vehicle, self._calibrated.unsprung)

    def _fused(self, batch: Batch, found: Estimate, is_new_load: bool) -> LoadEpoch | None:
        """The load epoch of this batch; a new drive, a long stop or a changed load opens a new one."""
        is_new_drive = batch.drive_start_ns != self._drive_start_ns
        self._drive_start_ns = batch.drive_start_ns
        could_have_changed = is_new_load or is_new_drive or batch.longest_stop_s >= STOP_THAT_ENDS_EPOCH_S
        self._epoch = fused_epoch(self._epoch, found, self._rules, could_have_changed)
        return self._epoch if found.counted else None
