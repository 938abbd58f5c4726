"""The pipeline thread: inbox -> decoder -> batches -> estimates -> store and board."""

import contextlib
import logging
import math
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Final, ParamSpec

from gateway.bus.listen import Inbox
from gateway.bus.signals import Decoder
from gateway.estimates.batch_estimate import Estimate
from gateway.log import Event, log_event
from gateway.model.sensors import NOISE_RATIOS
from gateway.model.spectra import NOISY_RATIO
from gateway.part import STOP_WITHIN_S, ThreadPart
from gateway.records import Frames, Why
from gateway.service.signal_watch import SignalWatch, StandingWatch
from gateway.store import Store
from gateway.web.live.board import Board
from gateway.weighing.flow import Flow

DRAIN_S = 0.5  # chosen: longest wait for frames, and so the delay with which the end of a drive is noticed
ASLEEP_DRAIN_S = 2.0  # chosen: the same between drives
ROLL_RATE_KNOWN_SHARE: Final = 0.9  # chosen: of a batch's usable samples; with fewer the sensor is at fault
ROLL_RATE_LOST: Final = (
    "the roll rate is known in only {:.0%} of the last batch (silent, stuck, at the end of its range or too slow): "
    "check the sensor and the signal map; payload and front share go on"
)
NOISY: Final = (
    "{} {:.1f} times as noisy as expected in the last batch: look for a loose mount, a bad supply or a changed filter "
    "or range in the device; weighing goes on where possible"
)
P = ParamSpec("P")
LATE_S: Final = 1.0  # chosen: longest delay between the stamp of a frame and its arrival here


class Beside:
    """Calls the pipeline's neighbours. What one raises is its own fault until it succeeds again; weighing goes on."""

    def __init__(self) -> None:
        self._faults: dict[str, str] = {}

    def call(self, name: str, neighbour: Callable[P, object], *args: P.args, **named: P.kwargs) -> None:
        try:
            neighbour(*args, **named)
        except Exception as failure:  # noqa: BLE001 - whatever it is, weighing does not depend on it
            if name not in self._faults:
                log_event(Event.PART_FAILED, level=logging.ERROR, part=name, failure=repr(failure))
            self._faults[name] = repr(failure)
        else:
            self._faults.pop(name, None)

    @property
    def fault(self) -> str | None:
        """Who failed with the last call, for people."""
        told = (f"the {name} failed: {failure}; weighing goes on" for name, failure in self._faults.copy().items())
        return "; ".join(told) or None


class Pipeline(ThreadPart):
    """Runs until :meth:`stop`."""

    NAME = "pipeline"
    IS_VITAL = True

    def __init__(
        self,
        inbox: Inbox,
        decoder: Decoder,
        flow: Flow,
        store: Store,
        board: Board,
        on_frames: Callable[[Frames], None] = lambda frames: None,
    ) -> None:
        """``on_frames`` receives all decoded frames."""
        super().__init__("pipeline")
        self.decoder = decoder
        self.flow = flow
        self.watch = SignalWatch(decoder.signals)
        self.standing = StandingWatch(flow.settings.standstill_speed_mps)
        self.counts = dict.fromkeys(("n_estimates", "n_rejected", "n_provisional", "n_remainders"), 0)
        self.rejected_by_reason: Counter[str] = Counter()
        self.roll_rate_fault: str | None = None  # of the last batch, as people read it
        self.noise_fault: str | None = None  # likewise
        self.n_frames = 0  # frames whose estimates, if any, are handed over
        self.progress = 0  # increases with every turn of the loop; the watchdog checks it
        self._silent_s = 0.0
        self._inbox = inbox
        self._store = store
        self._board = board
        self._on_frames = on_frames
        self._beside = Beside()
        learn = flow.on_window
        flow.on_window = lambda batch, rows: self._beside.call("learner", learn, batch, rows)

    def stop(self, within_s: float = STOP_WITHIN_S) -> None:
        """Process the rest of the inbox, close the open window, and end."""
        super().stop(within_s)
        if self.is_alive():
            log_event(Event.PIPELINE_LATE, level=logging.ERROR, n_frames_waiting=len(self._inbox))

    def is_between_drives(self, silence_s: float) -> bool:
        """Whether the next frame begins another drive: this one is over, or its bus is silent. From any thread."""
        newest_s = max(self.watch.last_heard.values(), default=0.0)
        return self.flow.scheduler.drive_start_ns is None or time.monotonic() - newest_s > silence_s

    def _work(self) -> None:
        _name_this_thread("pipeline")
        while not self._stopping.is_set():
            self._turn(ASLEEP_DRAIN_S if self.flow.scheduler.drive_start_ns is None else DRAIN_S)
        while self._turn(0.0):
            pass
        self._hand_over(self.flow.flush())

    def _turn(self, timeout_s: float) -> bool:
        """One drain of the inbox; True if there were frames."""
        begun_s = time.monotonic()
        frames = self._inbox.drain(timeout_s)
        self.progress += 1
        if frames is None:
            self._hear_nothing(min(time.monotonic() - begun_s, timeout_s))
            return False
        self._silent_s = 0.0
        self._beside.call("recorder", self._on_frames, frames)
        motion = self.decoder.decode(frames)
        if len(motion):
            self._beside.call("watch of signals", self.watch.saw, motion)
            self._beside.call("watch of stops", self.standing.saw, motion)
            self._hand_over(self.flow.feed(motion))
        self.n_frames += len(frames)
        return True

    def _hear_nothing(self, for_s: float) -> None:
        """End the drive if the bus has been silent for long enough, as the next row would. Only time spent waiting for
        frames counts, so that a stalled machine first reads the frames that have gathered.
        """
        self._silent_s += for_s
        if self.flow.scheduler.drive_start_ns is not None and self._silent_s > self.flow.scheduler.silence_s + LATE_S:
            self._hand_over(self.flow.flush(Why.GAP))

    def _hand_over(self, estimates: Iterable[Estimate]) -> None:
        for found in estimates:
            self._count(found)
            if not found.is_remainder:  # before the journal, so that its readers find it on the board
                self._beside.call("board", self._board.publish, found)
            if not found.is_provisional:
                self._beside.call("journal", self._store.write_window, found)

    @property
    def fault(self) -> str | None:
        """Frames that the decoder refuses, and faults of sensors and neighbours that do not stop the weighing, for
        people.
        """
        refused = (remark.text for remark in self.decoder.causes())
        return "; ".join(filter(None, (*refused, self.roll_rate_fault, self.noise_fault, self._beside.fault))) or None

    def _count(self, found: Estimate) -> None:
        if math.isfinite(found.roll_usable_share) and not found.is_remainder:
            is_lost = found.roll_usable_share < ROLL_RATE_KNOWN_SHARE
            self.roll_rate_fault = ROLL_RATE_LOST.format(found.roll_usable_share) if is_lost else None
        if not NOISE_RATIOS.keys().isdisjoint(found.diagnostics):
            self.noise_fault = noise_fault(found)
        if found.is_provisional or found.is_remainder:
            self.counts["n_provisional" if found.is_provisional else "n_remainders"] += 1
        else:
            self.counts["n_estimates" if found.counted else "n_rejected"] += 1
            self.rejected_by_reason.update(map(str, found.rejected))


def noise_fault(found: Estimate) -> str | None:
    """Which sensor has become noisy and how much, as a sentence; None if none has."""
    ratio, name = max((found.diagnostics.get(key, 0.0), name) for key, name in NOISE_RATIOS.items())
    return NOISY.format(name, ratio) if ratio > NOISY_RATIO else None


def _name_this_thread(name: str) -> None:
    """Name the thread for `ps -L`, `top -H` and debuggers (Linux only)."""
    with contextlib.suppress(OSError):
        Path(f"/proc/self/task/{threading.get_native_id()}/comm").write_text(name)
