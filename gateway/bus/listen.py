"""The live source: a thread that listens to a CAN channel, survives its faults, and fills an inbox.

Time is each frame's own: the kernel's stamp on SocketCAN, the driver's elsewhere, the recorded one on an
in-process bus. An adapter that counts from its own start is dated by the system's clock (``receiver``); a frame
without any stamp is stamped on receipt.
"""

import errno
import logging
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from typing import Any, Final

import can

from gateway.bus.frames import join, take
from gateway.bus.receiver import Receiver, open_channel, packets_received, require_usable_interface
from gateway.bus.signals import SignalMap
from gateway.log import Event, log_event
from gateway.part import STOP_WITHIN_S, ThreadPart
from gateway.records import Frames, iso_utc
from gateway.words import counted

POLL_S: Final = 0.3  # chosen: longest wait inside a receiver: how soon a stop takes effect
ASLEEP_POLL_S: Final = 1.0  # chosen: likewise while the bus is silent; a frame ends the wait at once
FIRST_PAUSE_S: Final = 0.25  # chosen: before a channel that failed is opened again; doubles up to the longest
LONGEST_PAUSE_S: Final = 5.0  # chosen: how late a channel that came back is noticed
TALLIED: Final = ("frames", "error_frames", "remote_frames", "reconnects", "clock_sets")
START_WAIT_S: Final = 2.0  # chosen: for the first attempt to open the channel
DRAINED_FRAMES: Final = 4096
"""Chosen: at once. Stamps that jump at random end a window with every row, which costs up to 1 ms a frame: this bounds
one turn of the pipeline to 4 s, of the 20 s that the watchdog waits."""

OpenReceiver = Callable[[], Receiver]

_SYSTEM_REASONS: Final[Mapping[int, str]] = {
    errno.ENODEV: "the interface does not exist (not plugged in, or removed)",
    errno.ENXIO: "the interface does not exist (not plugged in, or removed)",
    errno.ENETDOWN: "the interface is down: ip link set {channel} up",
    errno.EAFNOSUPPORT: "this kernel has no CAN: modprobe can_raw",
    errno.EPERM: "no permission to open the interface",
    errno.EACCES: "no permission to open the interface",
}


class SourceState(StrEnum):
    """How the source stands. A silent bus is asleep; a fault needs a person, or time."""

    STARTING = "starting"
    RECEIVING = "receiving"
    BUS_SILENT = "bus_silent"
    READER_FAULT = "reader_fault"
    STOPPED = "stopped"


_EVENTS: Final[Mapping[SourceState, Event]] = {  # the service logs its stop itself
    SourceState.STARTING: Event.BUS_REOPENED,  # entered from a fault only: the first start is no change
    SourceState.RECEIVING: Event.BUS_RECEIVING,
    SourceState.BUS_SILENT: Event.BUS_SILENT,
    SourceState.READER_FAULT: Event.BUS_FAULT,
}


@dataclass(frozen=True, slots=True)
class SourceCounts:
    """Frames received and lost since the start."""

    frames: int
    dropped_inbox: int
    dropped_kernel: int
    error_frames: int
    remote_frames: int
    reconnects: int
    clock_sets: int = 0


class Inbox:
    """Frames in order of arrival; one thread puts, one drains.

    When it is full, new frames are dropped and counted. With ``waits_for_room`` the putting thread waits instead: right
    for an in-process bus, whose sender can wait, wrong for a real one.
    """

    def __init__(self, capacity_frames: int, width: int, *, waits_for_room: bool = False) -> None:
        self._capacity = capacity_frames
        self._width = width
        self._waits_for_room = waits_for_room
        self._bursts: list[Frames] = []
        self._n_waiting = 0
        self._n_dropped = 0
        self._is_closed = False
        self._changed = threading.Condition()

    @property
    def dropped(self) -> int:
        """Frames lost because the pipeline did not keep up."""
        return self._n_dropped

    def __len__(self) -> int:
        return self._n_waiting

    def put(self, frames: Frames) -> None:
        """Add a burst; frames without room are dropped and counted."""
        with self._changed:
            if self._waits_for_room:
                self._changed.wait_for(lambda: self._n_waiting < self._capacity or self._is_closed)
            elif len(frames) > self._capacity - self._n_waiting:
                room = self._capacity - self._n_waiting
                self._n_dropped += len(frames) - room
                frames = take(frames, slice(room))
            if len(frames):
                self._bursts.append(frames)
                self._n_waiting += len(frames)
                self._changed.notify_all()

    def drain(self, timeout_s: float) -> Frames | None:
        """The waiting frames, at most DRAINED_FRAMES of them; None if there are none within ``timeout_s``."""
        deadline = time.monotonic() + timeout_s
        with self._changed:
            while not self._bursts and not self._is_closed:
                left_s = deadline - time.monotonic()
                if left_s <= 0 or not self._changed.wait(left_s):
                    break
            room, n_bursts = DRAINED_FRAMES, 0
            while n_bursts < len(self._bursts) and (room := room - len(self._bursts[n_bursts])) >= 0:
                n_bursts += 1
            bursts, self._bursts = self._bursts[:n_bursts], self._bursts[n_bursts:]
            if self._bursts and not bursts:
                bursts = [take(self._bursts[0], slice(DRAINED_FRAMES))]
                self._bursts[0] = take(self._bursts[0], slice(DRAINED_FRAMES, None))
            self._n_waiting -= sum(map(len, bursts))
            self._changed.notify_all()
        return join(bursts, self._width) if bursts else None

    def close(self) -> None:
        """Close for new frames and wake the waiting thread. The frames inside can still be drained."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()


class LiveSource(ThreadPart):
    """Listens to one channel in a thread of its own until stopped; never sends.

    A channel that is down, removed, or not there yet is tried again and again with growing pauses; meanwhile the state
    and its reason say so.
    """

    NAME = "bus reader"
    IS_VITAL = True

    def __init__(
        self,
        interface: str,
        channel: str,
        signal_map: SignalMap,
        *,
        options: Mapping[str, Any] | None = None,
        inbox_frames: int = 65_536,
        silence_s: float = 2.0,
        open_receiver: OpenReceiver | None = None,
    ) -> None:
        """``open_receiver`` replaces the interface (tests). Raises BusError if it cannot be used here."""
        super().__init__("can-receiver")
        require_usable_interface(interface)
        self._interface, self._channel = interface, channel
        self._silence_s = silence_s
        width = signal_map.payload_width
        self._open = open_receiver or partial(
            open_channel, interface, channel, signal_map.filters, width, options or {}
        )
        self.inbox = Inbox(inbox_frames, width, waits_for_room=interface == "virtual")
        self._packets_received = packets_received if interface == "socketcan" else lambda channel: 0
        self._tally: Counter[str] = Counter()
        self._dropped_before = 0  # by receivers already closed
        self._receiver: Receiver | None = None
        self._state = SourceState.STOPPED
        self._reason: str | None = None
        self._seen_at_silence = 0
        self._has_tried = threading.Event()

    @property
    def state(self) -> SourceState:
        return self._state

    @property
    def reason(self) -> str | None:
        """Why the bus is silent or the reader at fault, for people; after a stop, why it was until then."""
        return self._reason

    def start(self) -> None:
        """Begin to listen; returns once the first attempt to open the channel has succeeded or failed."""
        self._state = SourceState.STARTING
        super().start()
        self._has_tried.wait(START_WAIT_S)

    def stop(self, within_s: float = STOP_WITHIN_S) -> None:
        """End the thread and close the channel. The frames in the inbox can still be drained."""
        self.inbox.close()
        super().stop(within_s)

    def counts(self) -> SourceCounts:
        receiver = self._receiver
        return SourceCounts(
            dropped_inbox=self.inbox.dropped,
            dropped_kernel=self._dropped_before + (receiver.dropped_kernel if receiver else 0),
            **{name: self._tally[name] for name in TALLIED},
        )

    def _work(self) -> None:
        try:
            self._listen_until_stopped()
        except BaseException as failure:
            self.failure = failure
            self._enter(SourceState.READER_FAULT, f"the receive thread died: {failure!r}")
            raise
        else:
            self._enter(SourceState.STOPPED, self._reason)
        finally:
            self._has_tried.set()
            self.inbox.close()

    def _listen_until_stopped(self) -> None:
        pause_s = FIRST_PAUSE_S
        while not self._stopping.is_set():
            n_before = self._tally["frames"]
            try:
                with closing(self._open()) as receiver:
                    self._has_tried.set()
                    self._listen(receiver)
                return
            except (OSError, can.CanError) as fault:
                self._enter(SourceState.READER_FAULT, system_reason(fault, self._channel))
            self._has_tried.set()
            self._tally["reconnects"] += 1
            pause_s = FIRST_PAUSE_S if self._tally["frames"] > n_before else min(2.0 * pause_s, LONGEST_PAUSE_S)
            self._stopping.wait(pause_s)

    def _listen(self, receiver: Receiver) -> None:
        """Receive until stopped; OSError or can.CanError if the channel fails."""
        self._receiver = receiver
        heard_s = time.monotonic()
        is_bus_off = False
        others: Counter[str] = Counter()  # since the last data frame
        try:
            while not self._stopping.is_set():
                burst = receiver.receive(ASLEEP_POLL_S if self._state is SourceState.BUS_SILENT else POLL_S)
                others.update(error=burst.error_frames, remote=burst.remote_frames)
                self._tally.update(
                    frames=len(burst.frames),
                    error_frames=burst.error_frames,
                    remote_frames=burst.remote_frames,
                    clock_sets=burst.clock_sets,
                )
                if burst.clock_sets:
                    log_event(
                        Event.ADAPTER_CLOCK,
                        interface=self._interface,
                        channel=self._channel,
                        n_sets=burst.clock_sets,
                        first_frame=iso_utc(int(burst.frames.t_ns[0])),
                    )
                is_bus_off = burst.is_bus_off or (is_bus_off and not len(burst.frames))
                if len(burst.frames):
                    heard_s = time.monotonic()
                    others.clear()
                    self.inbox.put(burst.frames)
                    self._enter(SourceState.RECEIVING, None)
                if is_bus_off:
                    self._enter(
                        SourceState.READER_FAULT, f"bus-off: ip link set {self._channel} type can restart-ms 100"
                    )
                elif len(burst.frames):
                    continue
                elif time.monotonic() - heard_s > self._silence_s:
                    self._enter(SourceState.BUS_SILENT, self._silence(others))
                elif self._state is SourceState.READER_FAULT:
                    self._enter(SourceState.STARTING, None)
        finally:
            self._dropped_before += receiver.dropped_kernel
            self._receiver = None

    def _enter(self, state: SourceState, reason: str | None) -> None:
        is_new_fault = state is SourceState.READER_FAULT and reason != self._reason
        if (state is not self._state or is_new_fault) and state in _EVENTS:
            level = logging.WARNING if state is SourceState.READER_FAULT else logging.INFO
            log_event(_EVENTS[state], level=level, interface=self._interface, channel=self._channel, reason=reason)
        self._state, self._reason = state, reason

    def _silence(self, others: Counter[str]) -> str:
        """Why no data frames come: the bus is asleep, or it carries others only. ``others`` came since the last one."""
        n_seen = self._packets_received(self._channel)
        if self._state is not SourceState.BUS_SILENT:
            self._seen_at_silence = n_seen
        if came := " and ".join(counted(n, f"{kind} frame") for kind, n in sorted(others.items()) if n):
            is_never_heard = others["error"] and not self._tally["frames"]
            hint = "; check the bit rate and the wiring" if is_never_heard else ""
            return f"no data frame for {self._silence_s:g} s, only {came}{hint}"
        if n_seen > self._seen_at_silence:
            return f"the bus is awake ({n_seen - self._seen_at_silence} frames), none has a mapped identifier"
        return f"no frame for {self._silence_s:g} s: the vehicle is asleep or the channel is not connected"


def system_reason(fault: Exception, channel: str) -> str:
    """Why ``channel`` cannot be used, with what to do if the system's own words do not say it."""
    number = fault.errno if isinstance(fault, OSError) else getattr(fault, "error_code", None)
    told = str(fault).partition("\n")[0].partition("Traceback")[0].strip()  # python-can's may end in a traceback
    reason = _SYSTEM_REASONS.get(number or 0, told or type(fault).__name__)
    return reason.format(channel=channel)
