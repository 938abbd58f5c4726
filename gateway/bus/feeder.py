"""Sends the readings of an inertial unit of Linux IIO and of a receiver behind gpsd as CAN frames.

The frames are those of dbc/springscale_reference.dbc, so the pipeline behind the bus is the same. One loop waits for
the sensors and sends; the kernel's buffers hold the samples meanwhile. What comes while there is no bus is dropped and
counted: a kernel bus stamps at arrival, and old samples would have wrong times.

Kernel, Documentation/ABI/testing/sysfs-bus-iio and driver-api/iio/buffers.rst: scan_elements say which channels a scan
contains, in which order (_index) and how ([be|le]:[s|u]bits/storagebits[>>shift], _type); each is aligned to its own
size, and so is a whole scan. (raw + _offset) * _scale is in m/s2 and rad/s. A mount matrix turns the chip's axes to the
board's. gpsd_json(5): TPV has ``mode`` (2 and 3: a fix), ``speed`` in m/s, ``lat`` and ``lon``; SKY has ``uSat``; both
have ``device``, the receiver's path.
"""

import contextlib
import json
import math
import os
import re
import select
import socket
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

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
RETRY_S: Final = 2.0  # chosen: pause after a fault of the bus or of gpsd
CONNECT_S: Final = 1.0  # chosen: gpsd is on this computer or near
RECEIVER_LOST_S: Final = 60.0
"""Chosen: without a speed, longer than in a tunnel. A receiver that is unplugged and plugged in has another path."""
LONGEST_LINE: Final = 1 << 16  # chosen: far longer than a report of gpsd
HOLE: Final = 2.5  # chosen: periods without a sample after which samples count as lost, not late
USUAL_OF: Final = 101  # chosen: pauses whose median is the usual one: a second at 100 Hz
NO_PLACE_DEG: Final = -214.7483648  # value of the database for a position without a fix
Samples = tuple[I64, dict[str, F64]]  # t_ns (n,), and by kind m/s2 or rad/s (n, 3) in the vehicle's axes
Rows = dict[str, dict[str, float]]  # by message and signal
AXES: Final = {
    f"{sign}{axis}": (-1.0 if sign else 1.0) * np.eye(3)[i] for sign in ("", "-") for i, axis in enumerate("xyz")
}
KINDS: Final = ("accel", "anglvel")
_TYPE: Final = re.compile(r"(be|le):([su])(\d+)/(8|16|32|64)(?:X1)?(?:>>(\d+))?\s*$")
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


class IioDevice:
    """One device: opened, its buffer enabled, read until closed. turn (3, 3): rows forward, left, up in its axes."""

    def __init__(self, folder: Path, turn: F64, rate_hz: float, nodes: Path = NODES) -> None:
        """Raises ConfigurationError unless it is an inertial unit with a buffer."""
        self.folder, self._node = folder, nodes / folder.name
        self.name = self._text("name") or folder.name
        self._turn, self.rate_hz = turn, rate_hz
        self.kinds = tuple(k for k in KINDS if all(self._text(f"scan_elements/in_{k}_{axis}_en") for axis in "xyz"))
        if not self.kinds:
            raise ConfigurationError(
                f"{folder}: has no buffered accelerometer or gyroscope: is its driver loaded, and its interrupt wired?"
            )
        self.has_stamps = self._text("scan_elements/in_timestamp_en") is not None
        self._scan, self._turns, self._file, self._rest = np.dtype([]), dict[str, tuple[F64, F64]](), -1, b""
        self._shifts: dict[str, tuple[int, int]] = {}

    def open(self) -> None:
        """Choose the channels, set the rate and start the buffer.

        Raises BusError if the kernel refuses, ConfigurationError for a channel or a mount matrix that cannot be read.
        """
        channels = [f"in_{kind}_{axis}" for kind in self.kinds for axis in "xyz"] + ["in_timestamp"]
        rates = ["sampling_frequency", *(f"in_{kind}_sampling_frequency" for kind in self.kinds)]
        known = [path.name for path in (self.folder / "scan_elements").glob("*_en")]
        settings = {f"scan_elements/{name}": str(int(name.removesuffix("_en") in channels)) for name in known}
        settings |= {name: f"{self._nearest(name):g}" for name in rates}
        settings |= {"current_timestamp_clock": "realtime", "buffer/length": str(BUFFER_SCANS), "buffer/watermark": "1"}
        try:
            self._write({"buffer/enable": "0"} | settings)
            self._lay_out(name for name in channels if f"{name}_en" in known)
            self._turns = {kind: self._turn_of(kind) for kind in self.kinds}
            self.rate_hz = next((float(text) for name in rates if (text := self._text(name))), self.rate_hz)
            self._write({"buffer/enable": "1"})
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
            self._write({"buffer/enable": "0"})

    def fileno(self) -> int:
        return self._file

    def read(self) -> Samples | None:
        """The samples since the last read; None if there are none. Raises DeviceGoneError."""
        try:
            got = os.read(self._file, self._scan.itemsize * MOST_SCANS)
        except BlockingIOError:
            return None
        except OSError as fault:
            raise DeviceGoneError(f"{self._node}: {fault.strerror or fault}") from None
        if not got:
            raise DeviceGoneError(f"{self._node}: the device is gone")
        whole = self._rest + got
        n_bytes = len(whole) // self._scan.itemsize * self._scan.itemsize
        self._rest = whole[n_bytes:]
        return self.samples(whole[:n_bytes]) if n_bytes else None

    def samples(self, whole: bytes) -> Samples:
        """The samples of whole scans."""
        scans = np.frombuffer(whole, self._scan)
        columns = {}
        for name, (shift, unused_bits) in self._shifts.items():
            raw = scans[name].astype(np.int64 if scans[name].dtype.kind == "i" else np.uint64) >> shift
            columns[name] = (raw << unused_bits) >> unused_bits  # an arithmetic shift if it is signed
        now_ns = np.full(len(scans), time.time_ns(), np.int64)
        t_ns = columns["in_timestamp"].astype(np.int64) if self.has_stamps else now_ns
        vectors = {}
        for kind, (add, turn) in self._turns.items():
            chip = np.column_stack([columns[f"in_{kind}_{axis}"] for axis in "xyz"]).astype(np.float64)
            vectors[kind] = (chip + add) @ turn.T
        return t_ns, vectors

    def _turn_of(self, kind: str) -> tuple[F64, F64]:
        """What to add to the chip's numbers (3,), and what then turns them into the vehicle's axes and SI (3, 3)."""

        def told(what: str, default: str) -> F64:  # in_accel_x_scale, or in_accel_scale for all three
            return np.array(
                [self._text(f"in_{kind}_{axis}_{what}", f"in_{kind}_{what}") or default for axis in "xyz"], float
            )

        text = self._text(f"in_{kind}_mount_matrix", "in_mount_matrix") or "1,0,0;0,1,0;0,0,1"
        try:
            mount = np.array([float(x) for row in text.split(";") for x in row.split(",")]).reshape(3, 3)
        except ValueError:
            raise ConfigurationError(f"{self.folder}: mount matrix is {text!r}, which is no 3 by 3 numbers") from None
        return told("offset", "0"), self._turn @ mount * told("scale", "1")

    def _lay_out(self, enabled: Iterable[str]) -> None:
        """The scan as an aligned structure: every enabled channel in the order of its index."""
        fields = []
        for name in sorted(enabled, key=lambda each: int(self._text(f"scan_elements/{each}_index") or 0)):
            text = self._text(f"scan_elements/{name}_type") or ""
            found = _TYPE.match(text)
            if found is None:
                raise ConfigurationError(f"{self.folder}: scan_elements/{name}_type says {text!r}: not supported")
            order, sign, bits, storage_bits, shift = found.groups()
            fields.append(
                (name, f"{'>' if order == 'be' else '<'}{'i' if sign == 's' else 'u'}{int(storage_bits) // 8}")
            )
            self._shifts[name] = int(shift or 0), 64 - int(bits)
        self._scan = np.dtype(fields, align=True)

    def _nearest(self, name: str) -> float:
        """The requested rate, or the lowest available one above it, else the highest."""
        told = self._text(f"{name}_available") or ""
        if not told or told.startswith("["):
            return self.rate_hz
        rates = sorted(float(each) for each in told.split())
        return next((rate for rate in rates if rate >= 0.99 * self.rate_hz), rates[-1])

    def _text(self, *names: str) -> str | None:
        """The content of the first of these files that exists."""
        paths = (self.folder / name for name in names)
        return next((path.read_text().strip() for path in paths if path.is_file()), None)

    def _write(self, texts: dict[str, str]) -> None:
        """Write those files that the driver has."""
        for path, text in ((self.folder / name, text) for name, text in texts.items()):
            if path.is_file():
                path.write_text(text)


def find_devices(turn: F64, rate_hz: float, sysfs: Path = SYSFS, nodes: Path = NODES) -> Iterator[IioDevice]:
    """The default inertial units: the first accelerometer and the first gyroscope, which may be one device."""
    missing = set(KINDS)
    for folder in sorted(sysfs.glob("iio:device*")):
        with contextlib.suppress(ConfigurationError):
            device = IioDevice(folder, turn, rate_hz, nodes)
            if missing & set(device.kinds):
                missing -= set(device.kinds)
                yield device


class Gpsd:
    """One connection to gpsd; opened again by the next read after it broke.

    One receiver counts: ``device``, or the first that gives a speed, and another one only after that has given none for
    RECEIVER_LOST_S. The reports of fixes from others are left out: ``n_left_out``, by device.
    """

    def __init__(self, host: str, port: int, device: str | None = None) -> None:
        self.name = f"gpsd {host}:{port}"
        self.device = device  # the receiver that counts; None: none yet
        self.n_left_out: Counter[str] = Counter()
        self._is_chosen, self._last_speed_s = device is not None, -math.inf
        self._address = (host, port)
        self._socket: socket.socket | None = None
        self._rest = b""
        self._n_satellites = 0

    def fileno(self) -> int:
        """That of the connection; -1 while there is none."""
        return -1 if self._socket is None else self._socket.fileno()

    def read(self) -> list[Rows]:
        """The fixes that have come; of a new connection none. Raises BusError if gpsd does not answer or hangs up."""
        try:
            if self._socket is None:
                self._socket = socket.create_connection(self._address, CONNECT_S)
                self._socket.sendall(b'?WATCH={"enable":true,"json":true}\n')
                return []
            got = self._socket.recv(65_536)
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

    def fix_of(self, line: bytes) -> Rows | None:
        """The messages of a fix; None for other reports, and lines that are not JSON."""
        report: Any = None
        with contextlib.suppress(ValueError, RecursionError):
            report = json.loads(line)
        if not isinstance(report, dict):
            return None
        device = str(report.get("device", ""))
        if report.get("class") == "SKY" and isinstance(report.get("uSat"), int) and self.device in (None, device):
            self._n_satellites = min(max(report["uSat"], 0), 64)
        if report.get("class") != "TPV":
            return None
        known = report if report.get("mode") in (2, 3) else {}
        speed_mps = _within(known.get("speed"), 0.0, 200.0)
        if not self._counts(device, has_speed=speed_mps is not None):
            return None
        place = _within(known.get("lat"), -90.0, 90.0), _within(known.get("lon"), -180.0, 180.0)
        latitude, longitude = (NO_PLACE_DEG if None in place else float(x or 0.0) for x in place)
        mode = 0.0 if speed_mps is None else float(known["mode"])
        speed = {"Speed": speed_mps or 0.0, "Fix": mode, "Satellites": float(self._n_satellites)}
        return {"GPS_SPEED": speed, "GPS_POSITION": {"Latitude": latitude, "Longitude": longitude}}

    def _counts(self, device: str, *, has_speed: bool) -> bool:
        """Whether the reports of this receiver count; if not, this one is counted as left out."""
        now_s = time.monotonic()
        if has_speed and not self._is_chosen and now_s - self._last_speed_s > RECEIVER_LOST_S:
            self.device = device
        if has_speed and device == self.device:
            self._last_speed_s = now_s
        if self.device not in (None, device):
            self.n_left_out[device] += 1
        return self.device in (None, device)


def _within(told: Any, least: float, most: float) -> float | None:
    return float(told) if isinstance(told, int | float) and least <= told <= most else None


@dataclass
class FeedState:
    """Counts since the start; faults of the bus and of gpsd."""

    n_samples: dict[str, int] = field(default_factory=dict)
    n_lost: dict[str, int] = field(default_factory=dict)
    n_fixes: int = 0
    n_left_out: dict[str, int] = field(default_factory=dict)  # reports of other receivers, by device
    n_read: int = 0  # frames
    n_sent: int = 0
    last_sample_s: float = 0.0
    gravity_mps2: float = float("nan")
    faults: dict[str, str] = field(default_factory=dict)

    @property
    def n_dropped(self) -> int:
        return self.n_read - self.n_sent


class DeviceGoneError(BusError):
    """A device has disappeared."""


class Numbering:
    """Numbers the samples of one sensor, and counts those that are missing by their time stamps."""

    def __init__(self, rate_hz: float) -> None:
        self.n_lost = 0
        self._number = -1
        self._last_ns: int | None = None
        self._usual_ns = np.array([1e9 / rate_hz])

    def of(self, t_ns: I64) -> I64:
        """Sample numbers (n,) of these rising times; a gap counts as the samples that would have filled it."""
        waits_ns = np.diff(t_ns, prepend=t_ns[0] if self._last_ns is None else self._last_ns)
        period_ns = np.median(self._usual_ns)
        n_missing = np.where(waits_ns > HOLE * period_ns, np.round(waits_ns / period_ns) - 1.0, 0.0).astype(np.int64)
        usual = waits_ns[(n_missing == 0) & (waits_ns > 0)]
        self._usual_ns = np.concatenate((self._usual_ns, usual))[-USUAL_OF:]
        numbers: I64 = self._number + np.cumsum(1 + n_missing)
        self.n_lost += int(n_missing.sum())
        self._number, self._last_ns = int(numbers[-1]), int(t_ns[-1])
        return numbers


class Feeder:
    """Feeds until :meth:`stop`. A failing bus or gpsd is tried again; a device that disappears ends the feeding."""

    def __init__(
        self, interface: str, channel: str, devices: Sequence[IioDevice], gps: Gpsd | None,
        say: Callable[[str], None] = lambda text: None,
    ) -> None:  # fmt: skip
        self.state = FeedState()
        self._place, self._devices, self._gps, self._say = (interface, channel), devices, gps, say
        self._encoder = Encoder(load_signal_map(f"{SHIPPED_PREFIX}reference"))
        self._numbering: dict[str, Numbering] = {}
        self._next_try_s: dict[str, float] = {}
        self._stopping = threading.Event()

    def stop(self) -> None:
        self._stopping.set()

    def run(self, on_tick: Callable[[FeedState], None] = lambda state: None) -> None:
        """Feed; on_tick at least twice a second. Raises BusError if a device cannot be opened or has gone."""
        with contextlib.ExitStack() as at_the_end:
            at_the_end.enter_context(contextlib.closing(self._gps) if self._gps else contextlib.nullcontext())
            for device in self._devices:
                at_the_end.callback(device.close)
                device.open()
                self._numbering[device.name] = Numbering(device.rate_hz)
            while not self._stopping.is_set():
                try:
                    with BusSink(*self._place) as sink:
                        while not self._stopping.is_set():
                            on_tick(self.state)
                            for frames in self._readings():
                                sink.send(frames)
                                self.state.n_sent += len(frames)
                                self._note("bus", None)
                except DeviceGoneError:
                    raise
                except BusError as fault:
                    self._note("bus", str(fault))
                while not self._may_try("bus") and not self._stopping.is_set():
                    on_tick(self.state)
                    for _ in self._readings():
                        """What nobody can take is read, and dropped."""

    def _readings(self) -> Iterator[Frames]:
        """What the sensors have to say, waiting for it for READ_S at most."""
        sources = [one for one in (*self._devices, self._gps) if one is not None and one.fileno() >= 0]
        ready = select.select(sources, [], [], min(READ_S, RETRY_S))[0]
        for device in self._devices:
            if device in ready and (samples := device.read()) is not None:
                yield self._inertial(device, samples)
        if self._gps is not None and (self._gps in ready or (self._gps.fileno() < 0 and self._may_try(self._gps.name))):
            yield from self._fixes(self._gps)
        self._stopping.wait(HEAP_S if ready else 0.0)

    def _inertial(self, device: IioDevice, samples: Samples) -> Frames:
        """Frames of samples, and their counts. Without stamps of the kernel they are numbered one by one."""
        (t_ns, vectors_of), begun = samples, self.state.n_samples.get(device.name, 0)
        n, numbering = len(t_ns), self._numbering[device.name]
        numbers = numbering.of(t_ns) if device.has_stamps else begun + np.arange(n)
        rows = {}
        for kind, vectors in vectors_of.items():
            message, names, counter, valid, unit = _MESSAGES[kind]
            rows[message] = {name: vectors[:, i] / unit for i, name in enumerate(names)}
            rows[message] |= {counter: (numbers % 256).astype(np.float64), valid: np.ones(n)}
        for z in vectors_of["accel"][:, 2].tolist() if "accel" in vectors_of else []:
            before = self.state.gravity_mps2  # the slow mean of the axis that should point up
            self.state.gravity_mps2 = z if np.isnan(before) else before + (z - before) / 500.0
        self.state.n_samples[device.name] = begun + n
        self.state.n_lost[device.name] = numbering.n_lost
        self.state.last_sample_s = time.monotonic()
        return self._encoded(t_ns, rows)

    def _fixes(self, gps: Gpsd) -> Iterator[Frames]:
        was_open = gps.fileno() >= 0
        try:
            fixes = gps.read()
        except BusError as fault:
            self._note(gps.name, str(fault))
            return
        if was_open:
            self._note(gps.name, None)
        for rows in fixes:
            columns = {name: {k: np.array([x]) for k, x in row.items()} for name, row in rows.items()}
            self.state.n_fixes += rows["GPS_SPEED"]["Fix"] > 0.0
            yield self._encoded(np.array([time.time_ns()], np.int64), columns)
        for other in gps.n_left_out.keys() - self.state.n_left_out.keys():
            self._say(f"{gps.name}: {other} is left out: {gps.device} counts; choose one by --gps-device")
        self.state.n_left_out = dict(gps.n_left_out)

    def _encoded(self, t_ns: I64, rows: dict[str, dict[str, F64]]) -> Frames:
        frames = merge_frames([self._encoder.encode(name, t_ns, columns) for name, columns in rows.items()])
        self.state.n_read += len(frames)
        return frames

    def _may_try(self, what: str) -> bool:
        """Whether the pause after the last fault is over."""
        return time.monotonic() >= self._next_try_s.get(what, 0.0)

    def _note(self, what: str, fault: str | None) -> None:
        """Log a fault, and its end, once; after a fault a pause begins."""
        if fault != self.state.faults.get(what):
            self._say(fault or f"{what}: works again")
        if fault is None:
            self.state.faults.pop(what, None)
        else:
            self.state.faults[what] = fault
            self._next_try_s[what] = time.monotonic() + RETRY_S
