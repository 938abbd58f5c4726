"""The thread that stores batches for later calibrations, so that the pipeline never waits for the disk."""

import logging
import queue
import time
from contextlib import suppress
from typing import Final, NamedTuple

from gateway.bus.signals import SignalMap
from gateway.calibration.kept.batch_file import kept_batch_of
from gateway.calibration.kept.shelf import Shelf
from gateway.estimate import Estimate
from gateway.log import Event, log_event
from gateway.part import STOP_WITHIN_S, ThreadPart
from gateway.records import Batch, Motion
from gateway.service.commissioning.session import Commissioning

MOST_WAITING: Final = 4  # chosen: batches in the queue; each has some megabytes of rows, one comes every few minutes


class _Handed(NamedTuple):
    batch_id: str
    batch: Batch
    rows: Motion


class BatchKeeper(ThreadPart):
    """Stores every batch that an estimator could use on ``shelf``, and passes all batches to ``listener``.

    ``fault`` is the last fault of the disk, if any.
    """

    NAME = "batch keeper"
    fault: str | None = None

    def __init__(self, shelf: Shelf, signal_map: SignalMap) -> None:
        super().__init__("batch-keeper")
        self.shelf = shelf
        self.listener: Commissioning | None = None
        self.n_lost = 0  # batches that should have been kept and were not
        self._signal_map = signal_map
        self._waiting: queue.Queue[_Handed | None] = queue.Queue(MOST_WAITING)

    def keep(self, batch: Batch, found: Estimate, rows: Motion) -> None:
        """Queue a batch, from the pipeline's thread; if the queue is full the batch is lost and counted."""
        if not _counts(batch) and self._listening is None:
            return
        try:
            self._waiting.put_nowait(_Handed(found.id, batch, rows))
        except queue.Full:
            if _counts(batch):
                self._lose(f"{MOST_WAITING} batches wait for the disk already")

    def flush(self) -> None:
        """Wait until every queued batch is stored or lost."""
        self._waiting.join()

    def stop(self, within_s: float = STOP_WITHIN_S) -> None:
        """Store the queued batches, then end; those not stored in time are lost and counted."""
        end_s = time.monotonic() + within_s
        with suppress(queue.Full):
            self._waiting.put(None, timeout=within_s)
        super().stop(max(0.0, end_s - time.monotonic()))
        with suppress(queue.Empty):
            while True:
                handed = self._waiting.get_nowait()
                if handed is not None and _counts(handed.batch):
                    self._lose("the disk was too slow for the stop")

    def _work(self) -> None:
        while True:
            handed = self._waiting.get()
            try:
                if handed is None:
                    return
                self._put(handed)
            except Exception as failure:  # noqa: BLE001 - a failure with one batch must not stop the thread
                self._lose(repr(failure))
            finally:
                self._waiting.task_done()

    def _put(self, handed: _Handed) -> None:
        signal_map = self._signal_map
        kept = kept_batch_of(handed.batch_id, signal_map.id, handed.batch, handed.rows, signal_map.traits)
        if _counts(kept.batch):
            try:
                self.shelf.add(kept)
            except OSError as refusal:
                self._lose(str(refusal))
                return
            self.fault = None
        if (listener := self._listening) is not None:
            listener.hear(kept)

    @property
    def _listening(self) -> Commissioning | None:
        """The listener while it takes all batches, those that do not count too."""
        return self.listener if self.listener is not None and self.listener.wants_all else None

    def _lose(self, why: str) -> None:
        self.n_lost += 1
        if self.fault is None:  # log it once until it works again
            log_event(Event.BATCH_NOT_KEPT, level=logging.WARNING, fault=why)
        self.fault = f"batches cannot be kept for later calibrations: {why}; weighing goes on"


def _counts(batch: Batch) -> bool:
    """Whether an estimator could use the batch; provisional and rejected batches go to the listener only."""
    return not (batch.is_provisional or batch.rejected)
