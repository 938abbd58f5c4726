"""Feeds sensors onto a CAN bus: one thread reads each sensor, another sends, with a bounded queue between them."""

import queue
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from gateway.bus.feed.gpsd import Fix, Gpsd
from gateway.bus.feed.iio import IioDevice, Samples
from gateway.bus.frames import merge_frames
from gateway.bus.signals import SHIPPED_PREFIX, Encoder, load_signal_map
from gateway.bus.sink import BusSink
from gateway.errors import BusError
from gateway.records import F64, I64, Frames

MAP: Final = f"{SHIPPED_PREFIX}reference"
MODULUS: Final = 256  # of the counters, which have eight bits in the database
QUEUE: Final = 500  # chosen: bursts: ten seconds of two sensors
READ_S: Final = 0.5  # chosen: longest wait for a sensor: how soon a stop takes effect
HEAP_S: Final = 0.04  # chosen: length of a burst: a fifth of the work; the counter restores the samples' times
RETRY_S: Final = 2.0  # chosen: pause after a fault of the bus or of gpsd
HOLE: Final = 2.5  # chosen: periods without a sample after which samples count as lost, not late
USUAL_OF: Final = 101  # chosen: pauses whose median is the usual one: a second at 100 Hz
NO_PLACE_DEG: Final = -214.7483648  # value of the database for a position without a fix
_DEG: Final = np.pi / 180.0
_MESSAGES: Final = {
    "accel": ("IMU_ACCEL", ("AccelX", "AccelY", "AccelZ"), "AccelCounter", "AccelValid", 1.0),
    "anglvel": ("IMU_GYRO", ("RollRate", "PitchRate", "YawRate"), "GyroCounter", "GyroValid", _DEG),
}


@dataclass
class FeedState:
    """Counts since the start, each written by one thread; faults by sensor."""

    n_samples: dict[str, int] = field(default_factory=dict)
    n_lost: dict[str, int] = field(default_factory=dict)
    n_fixes: int = 0
    n_sent: int = 0
    n_dropped: int = 0
    last_sample_s: float = 0.0
    gravity_mps2: float = float("nan")
    faults: dict[str, str] = field(default_factory=dict)


class Numbering:
    """Numbers the samples of one sensor, and counts those that are missing by their time stamps."""

    def __init__(self, rate_hz: float) -> None:
        self.n_lost = 0
        self._number = -1
        self._last_ns: int | None = None
        self._usual_ns: deque[int] = deque([round(1e9 / rate_hz)], maxlen=USUAL_OF)

    def of(self, t_ns: I64) -> I64:
        """Sample numbers (n,) of these rising times; a gap counts as the samples that would have filled it."""
        numbers = np.empty(len(t_ns), np.int64)
        for i, now_ns in enumerate(t_ns.tolist()):
            wait_ns = now_ns - self._last_ns if self._last_ns is not None else 0
            period_ns = int(np.median(self._usual_ns))
            n_missing = round(wait_ns / period_ns) - 1 if wait_ns > HOLE * period_ns else 0
            if not n_missing and wait_ns > 0:
                self._usual_ns.append(wait_ns)
            self.n_lost += n_missing
            self._number += 1 + n_missing
            self._last_ns = now_ns
            numbers[i] = self._number
        return numbers


class Feeder:
    """Feeds until :meth:`stop`. A failing bus or gpsd is retried; a device that disappears ends the feeding."""

    def __init__(
        self, interface: str, channel: str, devices: Sequence[IioDevice], gps: Gpsd | None,
        say: Callable[[str], None] = lambda text: None,
    ) -> None:  # fmt: skip
        self.state = FeedState()
        self._place = (interface, channel)
        self._devices = devices
        self._gps = gps
        self._say = say
        self._encoder = Encoder(load_signal_map(MAP))
        self._queue: queue.Queue[Frames] = queue.Queue(QUEUE)
        self._stopping = threading.Event()
        self._ended: BusError | None = None

    def stop(self) -> None:
        self._stopping.set()

    def run(self, on_tick: Callable[[FeedState], None] = lambda state: None) -> None:
        """Feed; on_tick about twice a second. Raises BusError if a device cannot be opened or has gone."""
        threads = [threading.Thread(target=self._read_imu, args=(each,), name=each.name) for each in self._devices]
        threads += [threading.Thread(target=self._read_gps, args=(self._gps,), name="gpsd")] if self._gps else []
        try:
            for device in self._devices:
                device.open()
            for thread in threads:
                thread.start()
            self._send(on_tick)
        finally:
            self._stopping.set()
            for thread in threads:
                if thread.ident is not None:
                    thread.join()
            for device in self._devices:
                device.close()
        if self._ended is not None:
            raise self._ended

    def _send(self, on_tick: Callable[[FeedState], None]) -> None:
        while not self._stopping.is_set():
            on_tick(self.state)
            try:
                with BusSink(*self._place) as sink:
                    self._send_until_stopped(sink, on_tick)
            except BusError as fault:
                self._note("bus", str(fault))
                self._stopping.wait(RETRY_S)

    def _send_until_stopped(self, sink: BusSink, on_tick: Callable[[FeedState], None]) -> None:
        """Send queued frames until stopped; on_tick every READ_S. Raises BusError if the bus fails."""
        while not self._stopping.is_set():
            until_s = time.monotonic() + READ_S
            with suppress(queue.Empty):
                while not self._stopping.is_set() and (left_s := until_s - time.monotonic()) > 0.0:
                    frames = self._queue.get(timeout=left_s)
                    sink.send(frames)
                    self.state.n_sent += len(frames)
                    self._note("bus", None)
            on_tick(self.state)

    def _read_imu(self, device: IioDevice) -> None:
        numbering = Numbering(device.rate_hz)
        try:
            while not self._stopping.is_set():
                samples = device.read(READ_S)
                if samples is not None:
                    self._hand_on(self._inertial(device, samples, numbering))
                    self._stopping.wait(HEAP_S)
        except BusError as fault:
            self._ended = fault
            self._stopping.set()

    def _inertial(self, device: IioDevice, samples: Samples, numbering: Numbering) -> Frames:
        n, now_ns = len(samples.t_ns), time.time_ns()
        t_ns = samples.t_ns if device.has_stamps else np.full(n, now_ns)
        begun = self.state.n_samples.get(device.name, 0)
        numbers = numbering.of(t_ns) if device.has_stamps else begun + np.arange(n)
        parts = []
        for kind, vectors in (("accel", samples.accel_mps2), ("anglvel", samples.gyro_radps)):
            if vectors is not None:
                parts.append(self._vectors(kind, t_ns, vectors, numbers % MODULUS))
        if samples.accel_mps2 is not None:
            self._follow_gravity(samples.accel_mps2)
        self.state.n_samples[device.name] = begun + n
        self.state.n_lost[device.name] = numbering.n_lost
        self.state.last_sample_s = time.monotonic()
        return merge_frames(parts)

    def _vectors(self, kind: str, t_ns: I64, vectors: F64, counter: I64) -> Frames:
        message, names, counted, valid, unit = _MESSAGES[kind]
        columns = {name: vectors[:, i] / unit for i, name in enumerate(names)}
        more = {counted: counter.astype(np.float64), valid: np.ones(len(t_ns))}
        return self._encoder.encode(message, t_ns, {**columns, **more})

    def _follow_gravity(self, accel_mps2: F64) -> None:
        """Update the slow mean of the axis that should point up."""
        for z in accel_mps2[:, 2].tolist():
            before = self.state.gravity_mps2
            self.state.gravity_mps2 = z if before != before else before + (z - before) / 500.0  # noqa: PLR0124 # NaN

    def _read_gps(self, gps: Gpsd) -> None:
        while not self._stopping.is_set():
            try:
                for fix in gps.read(READ_S):
                    self._hand_on(self._fix(fix, np.array([time.time_ns()], np.int64)))
                    self.state.n_fixes += fix.mode > 0
                self._note(gps.name, None)
            except BusError as fault:
                self._note(gps.name, str(fault))
                self._stopping.wait(RETRY_S)
        gps.close()

    def _fix(self, fix: Fix, now_ns: I64) -> Frames:
        """Frames of speed with fix type, and of position."""
        mode = fix.mode if fix.speed_mps is not None else 0
        told = {"Speed": fix.speed_mps or 0.0, "Fix": float(mode), "Satellites": float(fix.n_satellites)}
        place = {"Latitude": fix.latitude_deg, "Longitude": fix.longitude_deg}
        here = {name: NO_PLACE_DEG if None in place.values() else float(x or 0.0) for name, x in place.items()}
        parts = [("GPS_SPEED", told), ("GPS_POSITION", here)]
        return merge_frames(
            [self._encoder.encode(name, now_ns, {k: np.array([x]) for k, x in row.items()}) for name, row in parts]
        )

    def _hand_on(self, frames: Frames) -> None:
        try:
            self._queue.put_nowait(frames)
        except queue.Full:
            self.state.n_dropped += len(frames)

    def _note(self, what: str, fault: str | None) -> None:
        """Log a fault, and its end, once."""
        if fault != self.state.faults.get(what):
            self._say(fault or f"{what}: works again")
        if fault is None:
            self.state.faults.pop(what, None)
        else:
            self.state.faults[what] = fault
