"""An inertial unit of the Linux kernel: Industrial I/O, read through its buffer with its own time stamps.

Documentation/ABI/testing/sysfs-bus-iio and Documentation/driver-api/iio/buffers.rst of the kernel: scan_elements say
which channels a scan contains, in which order (_index) and how ([be|le]:[s|u]bits/storagebits[>>shift], _type); each is
aligned to its own size, and so is a whole scan. (raw + _offset) * _scale is in m/s2 and rad/s. A mount matrix turns the
chip's axes to the board's. in_timestamp is in nanoseconds of the clock that current_timestamp_clock names.
"""

import contextlib
import os
import re
import select
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from gateway.errors import BusError, ConfigurationError
from gateway.records import F64, I64

SYSFS: Final = Path("/sys/bus/iio/devices")
NODES: Final = Path("/dev")
BUFFER_SCANS: Final = 512  # chosen: five seconds at 100 Hz: longer than a computer stalls
MOST_SCANS: Final = 256  # chosen: of one read
AXES: Final = {
    f"{sign}{axis}": (-1.0 if sign else 1.0) * np.eye(3)[i] for sign in ("", "-") for i, axis in enumerate("xyz")
}
KINDS: Final = ("accel", "anglvel")
_TYPE: Final = re.compile(r"(be|le):([su])(\d+)/(\d+)(?:X1)?(?:>>(\d+))?\s*$")


@dataclass(frozen=True, slots=True)
class _Element:
    """The position of one channel in a scan, and the meaning of its bits."""

    name: str
    dtype: np.dtype[np.generic]
    offset: int
    shift: int
    unused_bits: int
    is_signed: bool
    add: float
    scale: float

    def read(self, scans: np.ndarray) -> F64:
        """SI values (n,) of scans (n, bytes)."""
        raw = self._whole(scans)
        return (raw.astype(np.float64) + self.add) * self.scale

    def stamps(self, scans: np.ndarray) -> I64:
        """Whole numbers (n,): nanoseconds have more digits than a double."""
        return self._whole(scans).astype(np.int64)

    def _whole(self, scans: np.ndarray) -> np.ndarray:
        size = self.dtype.itemsize
        raw = np.ascontiguousarray(scans[:, self.offset : self.offset + size]).view(self.dtype)[:, 0]
        raw = raw.astype(np.int64 if self.is_signed else np.uint64) >> self.shift
        if not self.unused_bits:
            return raw
        left = self.unused_bits
        whole: np.ndarray = (raw << left) >> left  # an arithmetic shift if it is signed
        return whole


@dataclass(frozen=True, slots=True)
class Samples:
    """One read of a device: t_ns (n,), and m/s2 and rad/s (n, 3) if the device has such a sensor."""

    t_ns: I64
    accel_mps2: F64 | None
    gyro_radps: F64 | None


class IioDevice:
    """One device: opened, its buffer enabled, read until closed. turn (3, 3): rows forward, left, up in its axes."""

    def __init__(self, folder: Path, turn: F64, rate_hz: float, nodes: Path = NODES) -> None:
        """Raises ConfigurationError unless it is an inertial unit with a buffer."""
        self.folder = folder
        self.name = self._text("name") or folder.name
        self._node = nodes / folder.name
        self._turn = turn
        self._wanted_hz = rate_hz
        self.kinds = tuple(
            kind for kind in KINDS if all(self._has(f"scan_elements/in_{kind}_{axis}_en") for axis in "xyz")
        )
        if not self.kinds:
            raise ConfigurationError(
                f"{folder}: has no buffered accelerometer or gyroscope: is its driver loaded, and its interrupt wired?"
            )
        self.has_stamps = self._has("scan_elements/in_timestamp_en")
        self._elements: dict[str, _Element] = {}
        self._turns: dict[str, F64] = {}
        self._scan_bytes = 0
        self._file = -1
        self._rest = b""

    @property
    def rate_hz(self) -> float:
        """As the driver reports it, else as requested."""
        for name in ("sampling_frequency", *(f"in_{kind}_sampling_frequency" for kind in self.kinds)):
            with contextlib.suppress(ValueError):
                return float(self._text(name) or "")
        return self._wanted_hz

    def open(self) -> None:
        """Choose the channels, set the rate and start the buffer.

        Raises BusError if the kernel refuses, ConfigurationError for a channel or a mount matrix that cannot be read.
        """
        try:
            self._write("buffer/enable", "0")
            for each in sorted((self.folder / "scan_elements").glob("*_en")):
                wanted = any(each.name.startswith(f"in_{kind}_") and each.name[-4] in "xyz" for kind in self.kinds)
                self._write(f"scan_elements/{each.name}", "1" if wanted or each.name == "in_timestamp_en" else "0")
            for name in ("sampling_frequency", *(f"in_{kind}_sampling_frequency" for kind in self.kinds)):
                if self._has(name):
                    self._write(name, f"{self._nearest(name):g}")
            if self._has("current_timestamp_clock"):
                self._write("current_timestamp_clock", "realtime")
            self._write("buffer/length", str(BUFFER_SCANS))
            if self._has("buffer/watermark"):
                self._write("buffer/watermark", "1")
            self._elements, self._scan_bytes = self._laid_out()
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
        """The samples since the last read, in the vehicle's axes; None if there are none. Raises BusError at its
        end.
        """
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
        n = len(whole) // self._scan_bytes
        self._rest = whole[n * self._scan_bytes :]
        return self._samples(whole[: n * self._scan_bytes]) if n else None

    def _samples(self, whole: bytes) -> Samples:
        scans = np.frombuffer(whole, np.uint8).reshape(-1, self._scan_bytes)
        stamps = self._elements["in_timestamp"].stamps(scans) if self.has_stamps else np.zeros(len(scans), np.int64)
        return Samples(stamps, *(self._vectors(kind, scans) if kind in self.kinds else None for kind in KINDS))

    def _vectors(self, kind: str, scans: np.ndarray) -> F64:
        chip = np.column_stack([self._elements[f"in_{kind}_{axis}"].read(scans) for axis in "xyz"])
        vehicle: F64 = chip @ self._turns[kind].T
        return vehicle

    def _mount(self, kind: str) -> F64:
        """The mount matrix (3, 3); the identity if the driver has none. Raises ConfigurationError."""
        text = self._text(f"in_{kind}_mount_matrix") or self._text("in_mount_matrix") or "1,0,0;0,1,0;0,0,1"
        try:
            return np.array([float(x) for row in text.split(";") for x in row.split(",")]).reshape(3, 3)
        except ValueError:
            raise ConfigurationError(
                f"{self.folder}: its mount matrix is {text!r}, which is no 3 by 3 numbers"
            ) from None

    def _laid_out(self) -> tuple[dict[str, _Element], int]:
        """Every enabled channel in the order of its index, and the bytes of a scan."""
        enabled = [
            path.name.removesuffix("_en")
            for path in (self.folder / "scan_elements").glob("*_en")
            if path.read_text().strip() == "1"
        ]
        at, widest, elements = 0, 1, {}
        for name in sorted(enabled, key=lambda each: int(self._text(f"scan_elements/{each}_index") or 0)):
            text = self._text(f"scan_elements/{name}_type") or ""
            found = _TYPE.match(text)
            if found is None or int(found[4]) not in (8, 16, 32, 64):
                raise ConfigurationError(f"{self.folder}: scan_elements/{name}_type says {text!r}: not supported")
            n_bytes, shift = int(found[4]) // 8, int(found[5] or 0)
            at += -at % n_bytes
            order, signed = (">" if found[1] == "be" else "<"), found[2] == "s"
            dtype = np.dtype(f"{order}{'i' if signed else 'u'}{n_bytes}")
            add, scale = self._number(name, "offset", 0.0), self._number(name, "scale", 1.0)
            unused = 64 - int(found[3])
            elements[name] = _Element(name, dtype, at, shift, unused, signed, add, scale)
            at, widest = at + n_bytes, max(widest, n_bytes)
        return elements, at + -at % widest

    def _number(self, name: str, what: str, default: float) -> float:
        """in_accel_x_scale, or in_accel_scale for all three."""
        for each in (f"{name}_{what}", f"{name.rpartition('_')[0]}_{what}"):
            if self._has(each):
                return float(self._text(each) or default)
        return default

    def _nearest(self, name: str) -> float:
        """The requested rate, or the lowest available one above it, else the highest."""
        told = self._text(f"{name}_available") or ""
        if not told or told.startswith("["):
            return self._wanted_hz
        rates = sorted(float(each) for each in told.split())
        return next((rate for rate in rates if rate >= 0.99 * self._wanted_hz), rates[-1])

    def _has(self, name: str) -> bool:
        return (self.folder / name).is_file()

    def _text(self, name: str) -> str | None:
        return (self.folder / name).read_text().strip() if self._has(name) else None

    def _write(self, name: str, text: str) -> None:
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


def turned(forward: str, up: str) -> F64:
    """Rows forward, left, up by the names of the device's axes. Raises ConfigurationError if they lie on one line."""
    ahead, upward = AXES[forward], AXES[up]
    if abs(float(ahead @ upward)) > 0.5:
        raise ConfigurationError(f"forward {forward} and up {up} are one line: name two axes of the sensor")
    rows: F64 = np.stack([ahead, np.cross(upward, ahead), upward])
    return rows
