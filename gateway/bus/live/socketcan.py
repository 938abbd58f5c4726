"""SocketCAN, listened to in bursts: one wake-up drains the socket, one numpy view reads the frames.

Nothing here can send. Whether the controller itself stays silent on the wire (not even acknowledging)
is the interface's setting: ``ip link set can0 type can bitrate 500000 listen-only on``.
"""

import select
import socket
import struct
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from gateway.bus.frames import empty_frames, payload_rows, take
from gateway.bus.live.receiver import Burst
from gateway.bus.signals import IdFilter
from gateway.errors import BusError
from gateway.records import I64, Frames
from gateway.units import NS_PER_S

GATHER_S: Final = 0.05  # chosen: frames are left to gather this long: few wake-ups, little work
BURST_FRAMES: Final = 4096  # chosen: a fully loaded bus sends a tenth of them in GATHER_S
RECEIVE_BUFFER_BYTES: Final = 4 << 20  # chosen: for what comes while this process does not get the processor

_REMOTE_FLAG: Final = 0x4000_0000  # CAN_RTR_FLAG of linux/can.h, as the next two: CAN_ERR_FLAG, CAN_ERR_MASK
_ERROR_FLAG: Final = 0x2000_0000
_BUS_OFF: Final = np.uint32(0x40)  # CAN_ERR_BUSOFF of linux/can/error.h
_NO_DATA_FLAGS: Final = np.uint32(_REMOTE_FLAG | _ERROR_FLAG)
_ALL_ERROR_CLASSES: Final = 0x1FFF_FFFF
_CAN_RAW_ERR_FILTER: Final = 2  # linux/can/raw.h; the socket module names neither this nor those below
_SO_RCVBUFFORCE: Final = 33  # linux/asm-generic/socket.h, as the next two
_SO_TIMESTAMPNS: Final = 35
_SO_RXQ_OVFL: Final = 40
_TIMESPEC: Final = np.dtype([("seconds", np.long), ("nanoseconds", np.long)])
_COUNT: Final = struct.Struct("=I")
_ANCILLARY_BYTES: Final = socket.CMSG_SPACE(_TIMESPEC.itemsize) + socket.CMSG_SPACE(_COUNT.size)
_CLASSIC: Final = np.dtype([("id", "=u4"), ("length", "u1"), ("reserved", "u1", 3), ("payload", "u1", 8)])
_FD: Final = np.dtype([("id", "=u4"), ("length", "u1"), ("reserved", "u1", 3), ("payload", "u1", 64)])


class SocketCanReceiver:
    """Frames of one bound CAN socket, with the kernel's own stamps and its count of lost frames."""

    def __init__(self, sock: socket.socket, width: int) -> None:
        """``sock`` gives one struct can_frame or canfd_frame a datagram; this object owns it now."""
        self._socket = sock
        self._width = width
        self._n_dropped = 0
        self._fault: OSError | None = None
        self._readable = select.poll()
        self._readable.register(sock, select.POLLIN)

    @property
    def dropped_kernel(self) -> int:
        """Frames that found the socket's buffer full."""
        return self._n_dropped

    def receive(self, timeout_s: float) -> Burst:
        """One burst; empty if nothing came within ``timeout_s``. Raises OSError (ENETDOWN, ENODEV, ...).

        Frames from before a fault are given first.
        """
        if self._fault is not None:
            raise self._fault
        if not self._readable.poll(timeout_s * 1000.0):
            return Burst(empty_frames(self._width))
        time.sleep(GATHER_S)
        return self._burst(*self._drain())

    def close(self) -> None:
        self._socket.close()

    def _drain(self) -> tuple[list[bytes], list[bytes]]:
        """The waiting datagrams, and the kernel's stamp of each (empty if it gave none)."""
        receive = self._socket.recvmsg
        datagrams: list[bytes] = []
        stamps: list[bytes] = []
        for _ in range(BURST_FRAMES):
            try:
                datagram, ancillary, _flags, _address = receive(_FD.itemsize, _ANCILLARY_BYTES, socket.MSG_DONTWAIT)
            except BlockingIOError:
                break
            except OSError as fault:
                if not datagrams:
                    raise
                self._fault = fault  # the kernel reports it once
                break
            datagrams.append(datagram)
            stamp = b""
            for _level, kind, content in ancillary:
                if kind == _SO_TIMESTAMPNS:
                    stamp = content
                elif kind == _SO_RXQ_OVFL:
                    self._n_dropped = _COUNT.unpack(content)[0]
            stamps.append(stamp)
        return datagrams, stamps

    def _burst(self, datagrams: Sequence[bytes], stamps: Sequence[bytes]) -> Burst:
        if not datagrams:
            return Burst(empty_frames(self._width))
        is_classic = all(len(datagram) == _CLASSIC.itemsize for datagram in datagrams)
        layout = _CLASSIC if is_classic else _FD
        rows = np.frombuffer(b"".join(d.ljust(layout.itemsize, b"\0") for d in datagrams), layout)
        can_id, payload = rows["id"].copy(), payload_rows(rows["payload"], rows["length"], self._width)
        frames = Frames(_stamps_ns(stamps), can_id, rows["length"].copy(), payload)
        is_other = (can_id & _NO_DATA_FLAGS) != 0
        if not is_other.any():
            return Burst(frames)
        error_ids = can_id[(can_id & _ERROR_FLAG) != 0]
        return Burst(take(frames, ~is_other), len(error_ids), bool(np.any(error_ids & _BUS_OFF)))


def open_socketcan(channel: str, filters: Sequence[IdFilter], width: int) -> SocketCanReceiver:
    """Listen to a SocketCAN interface through kernel filters.

    Raises BusError if this system has no SocketCAN, OSError if the interface is absent or down.
    """
    try:
        sock = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    except AttributeError:
        raise BusError("SocketCAN exists on Linux only; choose another [bus] interface") from None
    try:
        sock.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, packed_filters(filters))
        sock.setsockopt(socket.SOL_CAN_RAW, _CAN_RAW_ERR_FILTER, _ALL_ERROR_CLASSES)
        sock.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FD_FRAMES, 1)
        ask_for_stamps(sock)
        sock.bind((channel,))
    except BaseException:
        sock.close()
        raise
    return SocketCanReceiver(sock, width)


def ask_for_stamps(sock: socket.socket) -> None:
    """Kernel time stamps in ns, a count of lost datagrams, and as large a buffer as we may have."""
    sock.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
    sock.setsockopt(socket.SOL_SOCKET, _SO_RXQ_OVFL, 1)
    try:
        sock.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, RECEIVE_BUFFER_BYTES)
    except PermissionError:  # wants CAP_NET_ADMIN; without it the system's limit holds
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)


def packed_filters(filters: Sequence[IdFilter]) -> bytes:
    """struct can_filter[]: data frames only, 11 and 29 bits kept apart."""
    return b"".join(struct.pack("=II", f.can_id, f.mask | _REMOTE_FLAG) for f in filters)


def packets_received(channel: str) -> int:
    """Number of frames the interface has received, before our filters; 0 if it does not say."""
    try:
        return int((Path("/sys/class/net") / channel / "statistics" / "rx_packets").read_text())
    except (OSError, ValueError):
        return 0


def _stamps_ns(stamps: Sequence[bytes]) -> I64:
    """Kernel stamps as ns (n,); the present time for frames without one."""
    times = np.frombuffer(b"".join(stamp or bytes(_TIMESPEC.itemsize) for stamp in stamps), _TIMESPEC)
    t_ns: I64 = times["seconds"].astype(np.int64) * NS_PER_S + times["nanoseconds"]
    return t_ns if all(stamps) else np.where([bool(stamp) for stamp in stamps], t_ns, time.time_ns())
