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
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from gateway.bus.frames import merge_frames
from gateway.bus.signals import SHIPPED_PREFIX, Encoder, load_signal_map
from gateway.bus.sink import BusSink
from gateway.errors import BusError, ConfigurationError
from gateway.records import F64, I64
from gateway.units import STANDARD_GRAVITY_MPS2

BUFFER_SCANS: Final = 512  # chosen: five seconds at 100 Hz: longer than a computer stalls
MOST_SCANS: Final = 256  # chosen: of one read
READ_S: Final = 0.5  # chosen: longest wait for a sensor: how soon a stop takes effect
HEAP_S: Final = 0.04  # chosen: length of a burst: a fifth of the work; the counter restores the samples' times
RETRY_S: Final = 2.0  # chosen: pause after a fault of the bus or of gpsd
CONNECT_S: Final = 1.0  # chosen: gpsd is on this computer or near
RECEIVER_LOST_S: Final = 60.0
"""Chosen: without a speed, longer than in a tunnel. A receiver that is unplugged and plugged in has another path."""
LONGEST_LINE: Final = 1 << 16  # chosen: far longer than a report of gpsd
SETTLED: Final = 1000  # chosen: samples after which the mean of gravity is believed
MOST_OFF_MPS2: Final = 2.0  # chosen: of gravity: a mount tilted by 37 degrees, as batches allow
HOLE: Final = 2.5  # chosen: periods without a sample after which samples count as lost, not late
USUAL_OF: Final = 101  # chosen: pauses whose median is the usual one: a second at 100 Hz
NO_PLACE_DEG: Final = -214.7483648  # value of the database for a position without a fix
Samples = tuple[I64, I64, dict[str, F64]]  # t_ns, numbers (n,), and by kind m/s2 or rad/s (n, 3) in vehicle axes
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


class IioDevice:
    """One device: opened, its buffer enabled, read until closed. turn (3, 3): rows forward, left, up in its axes."""

    def __init__(self, folder: Path, turn: F64, rate_hz: float, nodes: Path) -> None:
        """Raises ConfigurationError unless it is an inertial unit with a buffer."""
        self._folder, self._node = folder, nodes / folder.name
        self.name = self._text("name") or folder.name
        self._turn, self._rate_hz, self._file, self._rest = turn, rate_hz, -1, b""
        self.kinds = tuple(k for k in KINDS if all(self._text(f"scan_elements/in_{k}_{axis}_en") for axis in "xyz"))
        if not self.kinds or self._text("scan_elements/in_timestamp_en") is None:
            raise ConfigurationError(
                f"{folder}: has no buffered accelerometer or gyroscope: is its driver loaded, and its interrupt wired?"
            )
        self.n_samples, self.numbering = 0, Numbering(rate_hz)

    def open(self) -> None:
        """Choose the channels, set the rate and start the buffer.

        Raises BusError if the kernel refuses, ConfigurationError for a channel or a mount matrix that cannot be read.
        """
        channels = [f"in_{kind}_{axis}" for kind in self.kinds for axis in "xyz"] + ["in_timestamp"]
        rates = ["sampling_frequency", *(f"in_{kind}_sampling_frequency" for kind in self.kinds)]
        known = [path.name.removesuffix("_en") for path in (self._folder / "scan_elements").glob("*_en")]
        settings = {f"scan_elements/{name}_en": str(int(name in channels)) for name in known}
        settings |= {name: f"{self._nearest(name):g}" for name in rates}
        settings |= {"current_timestamp_clock": "realtime", "buffer/length": str(BUFFER_SCANS), "buffer/watermark": "1"}
        try:
            self._write({"buffer/enable": "0"} | settings)
            fields = [self._field(name) for name in channels if name in known]
            self._turns = {kind: self._turn_of(kind) for kind in self.kinds}
            self.numbering = Numbering(
                next((float(text) for name in rates if (text := self._text(name))), self._rate_hz)
            )
            self._write({"buffer/enable": "1"})
            self._file = os.open(self._node, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as fault:
            reason = f"{fault.strerror or fault}: {fault.filename}; may this user write it?"
            raise BusError(f"{self._folder}: {reason}") from None
        self._scan = np.dtype([(name, code) for _, name, code, _ in sorted(fields)], align=True)
        self._shifts = {name: shifts for _, name, _, shifts in fields}

    def close(self) -> None:
        if self._file >= 0:
            os.close(self._file)
            self._file = -1
        with contextlib.suppress(OSError):
            self._write({"buffer/enable": "0"})

    def fileno(self) -> int:
        return self._file

    def read(self) -> Samples | None:
        """The samples since the last read; None if there are none. Raises BusError if the device is gone."""
        try:
            got = os.read(self._file, self._scan.itemsize * MOST_SCANS)
        except BlockingIOError:
            return None
        except OSError as fault:
            raise BusError(f"{self._node}: {fault.strerror or fault}") from None
        if not got:
            raise BusError(f"{self._node}: the device is gone")
        whole = self._rest + got
        n_bytes = len(whole) // self._scan.itemsize * self._scan.itemsize
        self._rest = whole[n_bytes:]
        return self.samples(whole[:n_bytes]) if n_bytes else None

    def samples(self, whole: bytes) -> Samples:
        """The samples of whole scans."""
        scans, columns = np.frombuffer(whole, self._scan), {}
        for name, (shift, unused_bits) in self._shifts.items():
            raw = scans[name].astype(np.int64 if scans[name].dtype.kind == "i" else np.uint64) >> shift
            columns[name] = (raw << unused_bits) >> unused_bits  # an arithmetic shift if it is signed
        t_ns, vectors = columns["in_timestamp"].astype(np.int64), {}
        self.n_samples += len(scans)
        for kind, (add, turn) in self._turns.items():
            chip = np.column_stack([columns[f"in_{kind}_{axis}"] for axis in "xyz"]).astype(np.float64)
            vectors[kind] = (chip + add) @ turn.T
        return t_ns, self.numbering.of(t_ns), vectors

    def _turn_of(self, kind: str) -> tuple[F64, F64]:
        """What to add to the chip's numbers (3,), and what then turns them into the vehicle's axes and SI (3, 3)."""

        def told(what: str, default: str) -> F64:  # in_accel_x_scale, or in_accel_scale for all three
            each = ((f"in_{kind}_{axis}_{what}", f"in_{kind}_{what}") for axis in "xyz")
            return np.array([self._text(*names) or default for names in each], float)

        text = self._text(f"in_{kind}_mount_matrix", "in_mount_matrix") or "1,0,0;0,1,0;0,0,1"
        try:
            mount = np.array([float(x) for row in text.split(";") for x in row.split(",")]).reshape(3, 3)
        except ValueError:
            raise ConfigurationError(f"{self._folder}: mount matrix is {text!r}, which is no 3 by 3 numbers") from None
        return told("offset", "0"), self._turn @ mount * told("scale", "1")

    def _field(self, name: str) -> tuple[int, str, str, tuple[int, int]]:
        """Index of an enabled channel in the scan, its name, its numpy code, and its shift and unused bits."""
        text = self._text(f"scan_elements/{name}_type") or ""
        if (found := _TYPE.match(text)) is None:
            raise ConfigurationError(f"{self._folder}: scan_elements/{name}_type says {text!r}: not supported")
        order, sign, bits, storage_bits, shift = found.groups()
        code = f"{'>' if order == 'be' else '<'}{'i' if sign == 's' else 'u'}{int(storage_bits) // 8}"
        return int(self._text(f"scan_elements/{name}_index") or 0), name, code, (int(shift or 0), 64 - int(bits))

    def _nearest(self, name: str) -> float:
        """The requested rate, or the lowest available one above it, else the highest."""
        told = self._text(f"{name}_available") or ""
        rates = [] if told.startswith("[") else sorted(map(float, told.split()))
        return next((rate for rate in rates if rate >= 0.99 * self._rate_hz), rates[-1] if rates else self._rate_hz)

    def _text(self, *names: str) -> str | None:
        """The content of the first of these files that exists."""
        paths = (self._folder / name for name in names)
        return next((path.read_text().strip() for path in paths if path.is_file()), None)

    def _write(self, texts: dict[str, str]) -> None:
        """Write those files that the driver has."""
        for path, text in ((self._folder / name, text) for name, text in texts.items()):
            if path.is_file():
                path.write_text(text)


def find_devices(turn: F64, rate_hz: float, sysfs: Path, nodes: Path) -> Iterator[IioDevice]:
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
    RECEIVER_LOST_S. ``left_out`` are the others.
    """

    def __init__(self, host: str, port: int, device: str | None = None) -> None:
        self.name = f"gpsd {host}:{port}"
        self.device = device  # the receiver that counts; None: none yet
        self.left_out: set[str] = set()
        self._last_speed_s = -math.inf if device is None else math.inf  # a chosen one is never replaced
        self._address, self._rest, self._n_satellites = (host, port), b"", 0
        self._socket: socket.socket | None = None

    def fileno(self) -> int:
        """The connection's file descriptor; -1 while there is none."""
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
        device, kind = str(report.get("device", "")), report.get("class")
        if kind == "SKY" and isinstance(report.get("uSat"), int) and self.device in (None, device):
            self._n_satellites = min(max(report["uSat"], 0), 64)
        if kind != "TPV":
            return None
        known = report if report.get("mode") in (2, 3) else {}
        if (speed_mps := _within(known.get("speed"), 0.0, 200.0)) is not None:
            if time.monotonic() - self._last_speed_s > RECEIVER_LOST_S:
                self.device = device
            if device == self.device:
                self._last_speed_s = max(self._last_speed_s, time.monotonic())
        if self.device not in (None, device):
            self.left_out.add(device)
            return None
        place = _within(known.get("lat"), -90.0, 90.0), _within(known.get("lon"), -180.0, 180.0)
        latitude, longitude = (NO_PLACE_DEG if None in place else float(x or 0.0) for x in place)
        mode = 0.0 if speed_mps is None else float(known["mode"])
        speed = {"Speed": speed_mps or 0.0, "Fix": mode, "Satellites": float(self._n_satellites)}
        return {"GPS_SPEED": speed, "GPS_POSITION": {"Latitude": latitude, "Longitude": longitude}}


def _within(told: Any, least: float, most: float) -> float | None:
    return float(told) if isinstance(told, int | float) and least <= told <= most else None


class Feeder:
    """Feeds until :meth:`stop`. A failing bus or gpsd is tried again; a device that disappears ends the feeding."""

    def __init__(
        self,
        interface: str,
        channel: str,
        devices: Sequence[IioDevice],
        gps: Gpsd | None,
        say: Callable[[str], None] = lambda text: None,
    ) -> None:
        self.devices, self._place, self._gps, self._say = devices, (interface, channel), gps, say
        self.n_fixes = self.n_sent = self.n_dropped = 0
        self.last_sample_s, self.gravity_mps2 = 0.0, math.nan  # the slow mean of the axis that should point up
        self._encoder = Encoder(load_signal_map(f"{SHIPPED_PREFIX}reference"))
        self._bus: BusSink | None = None
        self._faults: dict[str, str] = {}
        self._next_try_s: dict[str, float] = {}
        self._stopping = threading.Event()

    def stop(self) -> None:
        self._stopping.set()

    def run(self, on_tick: Callable[[], None] = lambda: None) -> None:
        """Feed; on_tick at least twice a second. Raises BusError if a device cannot be opened or has gone."""
        with contextlib.ExitStack() as at_the_end:
            at_the_end.callback(self._close_bus)
            sources: list[IioDevice | Gpsd] = [*self.devices, *([self._gps] if self._gps else [])]
            for one in sources:
                at_the_end.callback(one.close)
            for device in self.devices:
                device.open()
            while not self._stopping.is_set():
                on_tick()
                self._send(np.empty(0, np.int64), {})  # opens the bus
                ready = select.select([one for one in sources if one.fileno() >= 0], [], [], min(READ_S, RETRY_S))[0]
                for device in self.devices:
                    if device in ready and (samples := device.read()) is not None:
                        self._feed_inertial(*samples)
                if self._gps is not None and (self._gps in ready or self._gps.fileno() < 0):
                    self._feed_fixes(self._gps)
                self._stopping.wait(HEAP_S if ready else 0.0)

    def _feed_inertial(self, t_ns: I64, numbers: I64, vectors_of: dict[str, F64]) -> None:
        rows = {}
        for kind, vectors in vectors_of.items():
            message, names, counter, valid, unit = _MESSAGES[kind]
            rows[message] = {name: vectors[:, i] / unit for i, name in enumerate(names)}
            rows[message] |= {counter: (numbers % 256).astype(np.float64), valid: np.ones(len(numbers))}
        for z in vectors_of["accel"][:, 2].tolist() if "accel" in vectors_of else []:
            self.gravity_mps2 = z if math.isnan(self.gravity_mps2) else 0.998 * self.gravity_mps2 + 0.002 * z
        self.last_sample_s = time.monotonic()
        self._send(t_ns, rows)
        is_off = abs(self.gravity_mps2 - STANDARD_GRAVITY_MPS2) > MOST_OFF_MPS2
        if is_off and "up" not in self._faults and max(device.n_samples for device in self.devices) > SETTLED:
            what = f"the axis that should be up reads {self.gravity_mps2:.1f} m/s2 and not 9.8"
            self._note("up", f"{what}: name it by --up, and the one that points ahead by --forward")

    def _feed_fixes(self, gps: Gpsd) -> None:
        """The fixes that have come; an attempt to reach gpsd if there is no connection and the last one is over."""
        if not (was_open := gps.fileno() >= 0) and time.monotonic() < self._next_try_s.get(gps.name, 0.0):
            return
        try:
            fixes = gps.read()
        except BusError as fault:
            self._note(gps.name, str(fault))
            return
        if was_open:
            self._note(gps.name, None)
        for rows in fixes:
            self.n_fixes += rows["GPS_SPEED"]["Fix"] > 0.0
            columns = {name: {k: np.array([x]) for k, x in row.items()} for name, row in rows.items()}
            self._send(np.array([time.time_ns()], np.int64), columns)
        for other in gps.left_out:
            self._note(other, f"{gps.name}: {other} is left out: {gps.device} counts; choose one by --gps-device")

    def _send(self, t_ns: I64, rows: dict[str, dict[str, F64]]) -> None:
        """Send messages of samples. While there is no bus they are dropped and counted."""
        frames = merge_frames([self._encoder.encode(name, t_ns, columns) for name, columns in rows.items()])
        try:
            if self._bus is None and time.monotonic() >= self._next_try_s.get("bus", 0.0):
                self._bus = BusSink(*self._place)
            if self._bus is not None:
                self._bus.send(frames)
                self.n_sent += len(frames)
                if len(frames):
                    self._note("bus", None)
                return
        except BusError as fault:
            self._close_bus()
            self._note("bus", str(fault))
        self.n_dropped += len(frames)

    def _close_bus(self) -> None:
        if self._bus is not None:
            self._bus.__exit__()
        self._bus = None

    def _note(self, what: str, fault: str | None) -> None:
        """Say a fault, and its end, once; after a fault a pause begins."""
        if fault != self._faults.get(what):
            self._say(fault or f"{what}: works again")
        if fault is None:
            self._faults.pop(what, None)
        else:
            self._faults[what], self._next_try_s[what] = fault, time.monotonic() + RETRY_S
