"""Sensors without a CAN bus, fed onto one: an inertial unit of Linux IIO and a receiver behind gpsd become frames.

The frames are those of dbc/springscale_reference.dbc, so the pipeline behind the bus is the same. A thread reads each
sensor, another sends, with a bounded queue between them.

Kernel, Documentation/ABI/testing/sysfs-bus-iio and driver-api/iio/buffers.rst: scan_elements say which channels a scan
contains, in which order (_index) and how ([be|le]:[s|u]bits/storagebits[>>shift], _type); each is aligned to its own
size, and so is a whole scan. (raw + _offset) * _scale is in m/s2 and rad/s. A mount matrix turns the chip's axes to the
board's. gpsd_json(5): TPV has ``mode`` (2 and 3: a fix), ``speed`` in m/s, ``lat`` and ``lon``; SKY has ``uSat``.
"""

import contextlib
import json
import os
import queue
import re
import select
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from gateway.bus.frames import merge_frames
from gateway.bus.signals import SHIPPED_PREFIX, Encoder, load_signal_map
from gateway.bus.sink import BusSink
from gateway.errors import BusError, ConfigurationError
from gateway.records import F64, I64, Frames

SYSFS: Final = Path("/sys/bus/iio/devices")
NODES: Final = Path("/dev")
BUFFER_SCANS: Final = 512  # chosen: five seconds at 100 Hz: longer than a computer stalls
MOST_SCANS: Final = 256  # chosen: of one read
READ_S: Final = 0.5  # chosen: longest wait for a sensor: how soon a stop takes effect
HEAP_S: Final = 0.04  # chosen: length of a burst: a fifth of the work; the counter restores the samples' times
QUEUE: Final = 500  # chosen: bursts: ten seconds of two sensors
RETRY_S: Final = 2.0  # chosen: pause after a fault of the bus or of gpsd
CONNECT_S: Final = 3.0  # chosen: gpsd is on this computer or near
LONGEST_LINE: Final = 1 << 16  # chosen: far longer than a report of gpsd
HOLE: Final = 2.5  # chosen: periods without a sample after which samples count as lost, not late
USUAL_OF: Final = 101  # chosen: pauses whose median is the usual one: a second at 100 Hz
NO_PLACE_DEG: Final = -214.7483648  # value of the database for a position without a fix
AXES: Final = {
    f"{sign}{axis}": (-1.0 if sign else 1.0) * np.eye(3)[i] for sign in ("", "-") for i, axis in enumerate("xyz")
}
KINDS: Final = ("accel", "anglvel")
_TYPE: Final = re.compile(r"(be|le):([su])(\d+)/(\d+)(?:X1)?(?:>>(\d+))?\s*$")
_MESSAGES: Final = {  # message, signals, counter (of eight bits), valid bit, and the signals' unit
    "accel": ("IMU_ACCEL", ("AccelX", "AccelY", "AccelZ"), "AccelCounter", "AccelValid", 1.0),
    "anglvel": ("IMU_GYRO", ("RollRate", "PitchRate", "YawRate"), "GyroCounter", "GyroValid", np.pi / 180.0),
}


def turned(forward: str, up: str) -> F64:
    """Rows forward, left, up by the names of the device's axes. Raises ConfigurationError if they lie on one line."""
    ahead, upward = AXES[forward], AXES[up]
    if abs(float(ahead @ upward)) > 0.5:
        raise ConfigurationError(f"forward {forward} and up {up} are one line: name two axes of the sensor")
    rows: F64 = np.stack([ahead, np.cross(upward, ahead), upward])
    return rows


class _Channel(NamedTuple):
    """The position of one channel in a scan, and the meaning of its bits."""

    dtype: np.dtype[np.generic]
    at: int
    shift: int
    unused_bits: int
    add: float
    scale: float

    def raw(self, scans: np.ndarray) -> np.ndarray:
        """Whole numbers (n,) of scans (n, bytes)."""
        raw = np.ascontiguousarray(scans[:, self.at : self.at + self.dtype.itemsize]).view(self.dtype)[:, 0]
        raw = raw.astype(np.int64 if self.dtype.kind == "i" else np.uint64) >> self.shift
        whole: np.ndarray = (raw << self.unused_bits) >> self.unused_bits  # an arithmetic shift if it is signed
        return whole if self.unused_bits else raw


class Samples(NamedTuple):
    """One read of a device: t_ns (n,), and by kind m/s2 or rad/s (n, 3) in the vehicle's axes."""

    t_ns: I64
    vectors: dict[str, F64]


class IioDevice:
    """One device: opened, its buffer enabled, read until closed. turn (3, 3): rows forward, left, up in its axes."""

    def __init__(self, folder: Path, turn: F64, rate_hz: float, nodes: Path = NODES) -> None:
        """Raises ConfigurationError unless it is an inertial unit with a buffer."""
        self.folder, self._node = folder, nodes / folder.name
        self.name = self._text("name") or folder.name
        self._turn, self._wanted_hz = turn, rate_hz
        self.kinds = tuple(k for k in KINDS if all(self._text(f"scan_elements/in_{k}_{axis}_en") for axis in "xyz"))
        if not self.kinds:
            raise ConfigurationError(
                f"{folder}: has no buffered accelerometer or gyroscope: is its driver loaded, and its interrupt wired?"
            )
        self.has_stamps = self._text("scan_elements/in_timestamp_en") is not None
        self._rates = ("sampling_frequency", *(f"in_{kind}_sampling_frequency" for kind in self.kinds))
        self._channels: dict[str, _Channel] = {}
        self._turns: dict[str, F64] = {}
        self._scan_bytes, self._file, self._rest = 0, -1, b""

    @property
    def rate_hz(self) -> float:
        """As the driver reports it, else as requested."""
        for name in self._rates:
            with contextlib.suppress(ValueError):
                return float(self._text(name) or "")
        return self._wanted_hz

    def open(self) -> None:
        """Choose the channels, set the rate and start the buffer.

        Raises BusError if the kernel refuses, ConfigurationError for a channel or a mount matrix that cannot be read.
        """
        wanted = {f"in_{kind}_{axis}_en" for kind in self.kinds for axis in "xyz"} | {"in_timestamp_en"}
        try:
            self._write("buffer/enable", "0")
            for path in (self.folder / "scan_elements").glob("*_en"):
                path.write_text("1" if path.name in wanted else "0")
            for name in self._rates:
                self._write(name, f"{self._nearest(name):g}", is_optional=True)
            self._write("current_timestamp_clock", "realtime", is_optional=True)
            self._write("buffer/length", str(BUFFER_SCANS))
            self._write("buffer/watermark", "1", is_optional=True)
            self._channels, self._scan_bytes = self._laid_out()
            self._turns = {kind: self._turn @ self._mount(kind) for kind in self.kinds}
            self._write("buffer/enable", "1")
            self._file = os.open(self._node, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as fault:
            raise BusError(
                f"{self.folder}: {fault.strerror or fault}: {fault.filename}; may this user write it?"
            ) from None

    def close(self) -> None:
        if self._file >= 0:
            os.close(self._file)
            self._file = -1
        with contextlib.suppress(OSError):
            self._write("buffer/enable", "0")

    def read(self, timeout_s: float) -> Samples | None:
        """The samples since the last read; None if there are none. Raises BusError at the device's end."""
        if not select.select([self._file], [], [], timeout_s)[0]:
            return None
        try:
            got = os.read(self._file, self._scan_bytes * MOST_SCANS)
        except BlockingIOError:
            return None
        except OSError as fault:
            raise BusError(f"{self._node}: {fault.strerror or fault}") from None
        if not got:
            raise BusError(f"{self._node}: the device is gone")
        whole = self._rest + got
        n_bytes = len(whole) // self._scan_bytes * self._scan_bytes
        self._rest = whole[n_bytes:]
        return self.samples(whole[:n_bytes]) if n_bytes else None

    def samples(self, whole: bytes) -> Samples:
        """The samples of whole scans."""
        scans = np.frombuffer(whole, np.uint8).reshape(-1, self._scan_bytes)
        t_ns = np.full(len(scans), time.time_ns(), np.int64)
        if self.has_stamps:
            t_ns = self._channels["in_timestamp"].raw(scans).astype(np.int64)
        vectors = {}
        for kind in self.kinds:
            axes = [self._channels[f"in_{kind}_{axis}"] for axis in "xyz"]
            chip = np.column_stack([(each.raw(scans).astype(np.float64) + each.add) * each.scale for each in axes])
            vectors[kind] = chip @ self._turns[kind].T
        return Samples(t_ns, vectors)

    def _mount(self, kind: str) -> F64:
        """The mount matrix (3, 3); the identity if the driver has none. Raises ConfigurationError."""
        text = self._text(f"in_{kind}_mount_matrix") or self._text("in_mount_matrix") or "1,0,0;0,1,0;0,0,1"
        try:
            return np.array([float(x) for row in text.split(";") for x in row.split(",")]).reshape(3, 3)
        except ValueError:
            raise ConfigurationError(
                f"{self.folder}: its mount matrix is {text!r}, which is no 3 by 3 numbers"
            ) from None

    def _laid_out(self) -> tuple[dict[str, _Channel], int]:
        """Every enabled channel in the order of its index, and the bytes of a scan."""
        names = [path.name.removesuffix("_en") for path in (self.folder / "scan_elements").glob("*_en")]
        enabled = [name for name in names if self._text(f"scan_elements/{name}_en") == "1"]
        at, widest, channels = 0, 1, {}
        for name in sorted(enabled, key=lambda each: int(self._text(f"scan_elements/{each}_index") or 0)):
            text = self._text(f"scan_elements/{name}_type") or ""
            found = _TYPE.match(text)
            if found is None or int(found[4]) not in (8, 16, 32, 64):
                raise ConfigurationError(f"{self.folder}: scan_elements/{name}_type says {text!r}: not supported")
            n_bytes = int(found[4]) // 8
            at += -at % n_bytes
            dtype = np.dtype(f"{'>' if found[1] == 'be' else '<'}{'i' if found[2] == 's' else 'u'}{n_bytes}")
            add, scale = self._number(name, "offset", 0.0), self._number(name, "scale", 1.0)
            channels[name] = _Channel(dtype, at, int(found[5] or 0), 64 - int(found[3]), add, scale)
            at, widest = at + n_bytes, max(widest, n_bytes)
        return channels, at + -at % widest

    def _number(self, name: str, what: str, default: float) -> float:
        """in_accel_x_scale, or in_accel_scale for all three."""
        found = self._text(f"{name}_{what}") or self._text(f"{name.rpartition('_')[0]}_{what}")
        return default if found is None else float(found)

    def _nearest(self, name: str) -> float:
        """The requested rate, or the lowest available one above it, else the highest."""
        told = self._text(f"{name}_available") or ""
        if not told or told.startswith("["):
            return self._wanted_hz
        rates = sorted(float(each) for each in told.split())
        return next((rate for rate in rates if rate >= 0.99 * self._wanted_hz), rates[-1])

    def _text(self, name: str) -> str | None:
        path = self.folder / name
        return path.read_text().strip() if path.is_file() else None

    def _write(self, name: str, text: str, *, is_optional: bool = False) -> None:
        if not is_optional or (self.folder / name).is_file():
            (self.folder / name).write_text(text)


def find_devices(turn: F64, rate_hz: float, sysfs: Path = SYSFS, nodes: Path = NODES) -> Iterator[IioDevice]:
    """The default inertial units: the first accelerometer and the first gyroscope, which may be one device."""
    missing = set(KINDS)
    for folder in sorted(sysfs.glob("iio:device*")):
        with contextlib.suppress(ConfigurationError):
            device = IioDevice(folder, turn, rate_hz, nodes)
            if missing & set(device.kinds):
                missing -= set(device.kinds)
                yield device


class Fix(NamedTuple):
    """One report of gpsd; speed and position are finite or None. mode as in the database: 0, 2 or 3."""

    mode: int
    speed_mps: float | None
    latitude_deg: float | None
    longitude_deg: float | None
    n_satellites: int


class Gpsd:
    """One connection to gpsd; opened again by the next read after it broke."""

    def __init__(self, host: str, port: int) -> None:
        self.name = f"gpsd {host}:{port}"
        self._address = (host, port)
        self._socket: socket.socket | None = None
        self._rest = b""
        self._n_satellites = 0

    def read(self, timeout_s: float) -> list[Fix]:
        """Fixes that came within ``timeout_s``. Raises BusError if gpsd does not answer or hangs up."""
        try:
            if self._socket is None:
                self._socket = socket.create_connection(self._address, CONNECT_S)
                self._socket.sendall(b'?WATCH={"enable":true,"json":true}\n')
            self._socket.settimeout(timeout_s)
            got = self._socket.recv(65_536)
        except TimeoutError:
            if self._socket is None:
                raise BusError(f"{self.name}: does not answer") from None
            return []
        except (OSError, UnicodeError) as fault:  # UnicodeError: a name that the domain name system cannot have
            self.close()
            raise BusError(f"{self.name}: {getattr(fault, 'strerror', None) or fault}") from None
        if not got or len(self._rest) > LONGEST_LINE:
            self.close()
            raise BusError(f"{self.name}: hung up" if not got else f"{self.name}: sends something that is not JSON")
        *lines, self._rest = (self._rest + got).split(b"\n")
        return [fix for line in lines if (fix := self.fix_of(line)) is not None]

    def close(self) -> None:
        if self._socket is not None:
            self._socket.close()
        self._socket, self._rest = None, b""

    def fix_of(self, line: bytes) -> Fix | None:
        """None unless it is a fix: other reports, and lines that are not JSON."""
        report: Any = None
        with contextlib.suppress(ValueError, RecursionError):
            report = json.loads(line)
        if not isinstance(report, dict):
            return None
        if report.get("class") == "SKY" and isinstance(report.get("uSat"), int):
            self._n_satellites = min(max(report["uSat"], 0), 64)
        if report.get("class") != "TPV":
            return None
        mode = report["mode"] if report.get("mode") in (2, 3) else 0
        known = report if mode else {}
        speed_mps = _within(known.get("speed"), 0.0, 200.0)
        place = _within(known.get("lat"), -90.0, 90.0), _within(known.get("lon"), -180.0, 180.0)
        return Fix(mode, speed_mps, *place, self._n_satellites)


def _within(told: Any, least: float, most: float) -> float | None:
    return float(told) if isinstance(told, int | float) and least <= told <= most else None


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
        self._place, self._devices, self._gps, self._say = (interface, channel), devices, gps, say
        self._encoder = Encoder(load_signal_map(f"{SHIPPED_PREFIX}reference"))
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
            while not self._stopping.is_set():
                on_tick(self.state)
                try:
                    with BusSink(*self._place) as sink:
                        self._send_until_stopped(sink, on_tick)
                except BusError as fault:
                    self._note("bus", str(fault))
                    self._stopping.wait(RETRY_S)
        finally:
            self._stopping.set()
            for thread in threads:
                if thread.ident is not None:
                    thread.join()
            for device in self._devices:
                device.close()
        if self._ended is not None:
            raise self._ended

    def _send_until_stopped(self, sink: BusSink, on_tick: Callable[[FeedState], None]) -> None:
        """Send queued frames until stopped; on_tick every READ_S. Raises BusError if the bus fails."""
        while not self._stopping.is_set():
            until_s = time.monotonic() + READ_S
            with contextlib.suppress(queue.Empty):
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
                if (samples := device.read(READ_S)) is not None:
                    self._hand_on(self._inertial(device, samples, numbering))
                    self._stopping.wait(HEAP_S)
        except BusError as fault:
            self._ended = fault
            self._stopping.set()

    def _inertial(self, device: IioDevice, samples: Samples, numbering: Numbering) -> Frames:
        """Frames of samples, and their counts. Without stamps of the kernel they are numbered one by one."""
        begun, n = self.state.n_samples.get(device.name, 0), len(samples.t_ns)
        numbers = numbering.of(samples.t_ns) if device.has_stamps else begun + np.arange(n)
        parts = []
        for kind, vectors in samples.vectors.items():
            message, names, counter, valid, unit = _MESSAGES[kind]
            columns = {name: vectors[:, i] / unit for i, name in enumerate(names)}
            columns |= {counter: (numbers % 256).astype(np.float64), valid: np.ones(n)}
            parts.append(self._encoder.encode(message, samples.t_ns, columns))
        for z in samples.vectors["accel"][:, 2].tolist() if "accel" in samples.vectors else []:
            before = self.state.gravity_mps2  # the slow mean of the axis that should point up
            self.state.gravity_mps2 = z if np.isnan(before) else before + (z - before) / 500.0
        self.state.n_samples[device.name] = begun + n
        self.state.n_lost[device.name] = numbering.n_lost
        self.state.last_sample_s = time.monotonic()
        return merge_frames(parts)

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
