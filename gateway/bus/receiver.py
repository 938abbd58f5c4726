"""An open channel of any interface of python-can (SocketCAN, slcan, pcan, virtual, ...), only listened to.

Whether a SocketCAN controller itself stays silent on the wire (not even acknowledging) is the interface's setting:
``ip link set can0 type can bitrate 500000 listen-only on``.
"""

import importlib.util
import socket
import struct
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import can

from gateway.bus.frames import LAST_SECOND, ExactStamp, frames_of, has_possible_id
from gateway.bus.signals.mapping import CAN_FD_BYTES, IdFilter
from gateway.errors import BusError
from gateway.records import EXTENDED_ID, FIRST_DATED_NS, Frames
from gateway.units import NS_PER_S, S_PER_DAY

BURST_FRAMES: Final = 4096  # chosen: taken before they are handed on
GATHER_S: Final = 0.05  # chosen: frames are left to gather in the kernel this long: few wake-ups
RECEIVE_BUFFER_BYTES: Final = 4 << 20  # chosen: for what comes while this process does not get the processor
VIRTUAL_QUEUE_FRAMES: Final = 4096  # chosen: an in-process sender waits when it is full
PAUSE_S: Final = 5.0  # chosen: between two stamps: longer than any message's period, shorter than what ends a drive
MOST_OFF_S: Final = 10.0  # chosen: more than an adapter drifts in a day (50 ppm: 4 s) and than a computer stalls

_BUS_OFF: Final = 0x40  # CAN_ERR_BUSOFF of linux/can/error.h, in the identifier of an error frame
_SO_RCVBUFFORCE: Final = 33  # linux/asm-generic/socket.h, as the next; the socket module names neither
_SO_MEMINFO: Final = 55
_MEMINFO: Final = struct.Struct("=9I")  # linux/sock_diag.h; the last is SK_MEMINFO_DROPS

# The options that make an interface acknowledge nothing and send nothing, if python-can has a name for it
_LISTEN_ONLY: Final[Mapping[str, Mapping[str, Any]]] = {
    "slcan": {"listen_only": True},
    "vector": {"listen_only": True},
    "nixnet": {"listen_only": True},
    "virtual": {"rx_queue_size": VIRTUAL_QUEUE_FRAMES},
    "socketcan": {"fd": True},
}


# The package that python-can's own code for an interface imports, by module and by the name to install
_PACKAGES: Final[Mapping[str, tuple[str, str]]] = {
    "canalystii": ("canalystii", "canalystii"),
    "cantact": ("cantact", "cantact"),
    "gs_usb": ("gs_usb", "gs-usb"),
    "neovi": ("ics", "python-ics"),
    "robotell": ("serial", "pyserial"),
    "seeedstudio": ("serial", "pyserial"),
    "serial": ("serial", "pyserial"),
    "slcan": ("serial", "pyserial"),
    "udp_multicast": ("msgpack", "msgpack"),
}
_WINDOWS_ONLY: Final = frozenset({"etas", "ixxat", "nican", "nixnet", "systec", "usb2can", "vector"})


@dataclass(frozen=True, slots=True)
class Burst:
    """Data frames that came together in order, the numbers of others, and whether bus-off came behind all frames.

    ``clock_sets`` tells how often the adapter's own clock was dated.
    """

    frames: Frames
    error_frames: int = 0
    is_bus_off: bool = False
    remote_frames: int = 0
    clock_sets: int = 0


class Receiver:
    """Messages of an open python-can bus as bursts of frames.

    A stamp before 1986 or a day off the system's clock counts from the adapter's own start, as with gs_usb, canalystii,
    serial and systec, with pcan without the package uptime, or with neovi without a clock (from 2007 on). The system's
    clock at the first of these dates it; from there on the adapter's clock counts, until a pause of the bus, a new
    start of the adapter or its counter, or a step of the system's clock.
    """

    def __init__(
        self,
        bus: can.BusABC,
        width: int,
        kernel_socket: socket.socket | None = None,
        *,
        has_error_classes: bool = False,
    ) -> None:
        """``kernel_socket`` is the bus's own, if the kernel receives into it (SocketCAN). ``has_error_classes`` is
        whether identifiers of error frames are the kernel's error classes.
        """
        self._bus, self._width, self._socket = bus, width, kernel_socket
        self._has_error_classes = has_error_classes
        streams = (one for one in vars(bus).values() if isinstance(one, socket.socket))
        self._stream = next((one for one in streams if one.type == socket.SOCK_STREAM), None)
        self._n_dropped = 0
        self._fault: Exception | None = None
        self._adapter_start_s = self._last_stamp_s = 0.0
        self._n_clock_sets = 0

    @property
    def dropped_kernel(self) -> int:
        """Frames that found the socket's buffer full; 0 for other interfaces, which do not tell."""
        if self._socket is not None:
            with suppress(OSError, struct.error):  # closed meanwhile, or a kernel before 4.12
                told = self._socket.getsockopt(socket.SOL_SOCKET, _SO_MEMINFO, _MEMINFO.size)
                self._n_dropped = _MEMINFO.unpack(told)[-1]
        return self._n_dropped

    def receive(self, timeout_s: float) -> Burst:
        """The received messages, waiting up to ``timeout_s`` for a first one. Raises can.CanError or OSError.

        Messages from before a fault are given first.
        """
        messages: list[can.Message] = []
        now_s = 0.0
        try:
            while self._fault is None and len(messages) < BURST_FRAMES:
                message = self._bus.recv(0.0 if messages else timeout_s)
                if message is None:
                    self._require_open_stream()
                    break
                if not messages:
                    now_s = time.time()
                    if self._socket is not None:
                        time.sleep(GATHER_S)
                messages.append(message)
        except (OSError, can.CanError) as fault:
            self._fault = fault
        except Exception as fault:  # noqa: BLE001 - python-can's parsers raise whatever they meet in noise
            self._fault = can.CanOperationError(
                f"what the adapter sends cannot be read ({fault!r}): check its cable and its speed"
            )
        if self._fault is not None and not messages:
            raise self._fault
        return self._burst(messages, now_s)

    def _require_open_stream(self) -> None:
        """Raise OSError if the bus is a TCP connection that the other end has closed: python-can calls it silent."""
        if self._stream is not None:
            with suppress(BlockingIOError):
                if not self._stream.recv(1, socket.MSG_PEEK | socket.MSG_DONTWAIT):
                    raise ConnectionResetError("the server of the bus has closed the connection")

    def _burst(self, messages: Sequence[can.Message], now_s: float) -> Burst:
        """``now_s`` is the system's clock at the first of them."""
        n_sets_before, data = self._n_clock_sets, list[can.Message]()
        n_errors, n_remote, is_bus_off = 0, 0, False
        for message in messages:
            if message.is_error_frame:
                n_errors += 1
                is_bus_off |= self._has_error_classes and bool(message.arbitration_id & _BUS_OFF)
            elif not has_possible_id(message) or len(message.data) > CAN_FD_BYTES:  # read in noise
                n_errors += 1
            elif message.is_remote_frame:
                n_remote += 1
            else:
                is_bus_off = False
                message.timestamp = self._dated(message.timestamp, now_s)
                data.append(message)
        frames = frames_of(data, self._width)
        return Burst(frames, n_errors, is_bus_off, n_remote, self._n_clock_sets - n_sets_before)

    def _dated(self, stamp_s: Any, now_s: float) -> float:
        """Seconds since 1970 of a stamp, unless it is the kernel's or the recorded one of a replay."""
        if isinstance(stamp_s, ExactStamp):
            return stamp_s
        if not isinstance(stamp_s, int | float) or not 0.0 < stamp_s <= LAST_SECOND:
            return ExactStamp(time.time_ns())
        is_date = stamp_s * NS_PER_S >= FIRST_DATED_NS and abs(stamp_s - now_s) < S_PER_DAY
        if self._socket is not None or is_date:
            return stamp_s
        is_off = abs(self._adapter_start_s + stamp_s - now_s) > MOST_OFF_S
        if is_off or abs(stamp_s - self._last_stamp_s) > PAUSE_S:
            self._adapter_start_s = now_s - stamp_s
            self._n_clock_sets += 1
        self._last_stamp_s = stamp_s
        return self._adapter_start_s + stamp_s

    def close(self) -> None:
        self._bus.shutdown()


def open_channel(
    interface: str, channel: str, filters: Sequence[IdFilter], width: int, options: Mapping[str, Any]
) -> Receiver:
    """Open a bus for listening, filtered as far as the interface can; SocketCAN filters in the kernel.

    Raises BusError if its driver is missing or an option is wrong, can.CanError or OSError if the device is absent or
    busy.
    """
    arguments = {**_LISTEN_ONLY.get(interface, {}), **options}
    can_filters = [
        {
            "can_id": one.can_id & ~EXTENDED_ID,
            "can_mask": one.mask & ~EXTENDED_ID,
            "extended": bool(one.can_id & EXTENDED_ID),
        }
        for one in filters
    ]
    try:
        bus = can.Bus(interface=interface, channel=channel, can_filters=can_filters, ignore_config=True, **arguments)
    except can.CanInterfaceNotImplementedError as fault:
        raise BusError(f"interface {interface!r} cannot be used here: {fault}; is its driver installed?") from fault
    except (TypeError, ValueError) as fault:
        raise BusError(f"interface {interface!r} does not take these options: {fault}") from fault
    if interface != "socketcan":
        # Where python-can itself filters, it drops error frames too: their identifiers are none of the mapped ones.
        is_wanted = bus._matches_filters
        bus._matches_filters = lambda msg: msg.is_error_frame or is_wanted(msg)  # type: ignore[method-assign]
        return Receiver(bus, width, has_error_classes=interface == "socketcand")
    kernel_socket: socket.socket = bus.socket  # type: ignore[attr-defined] # of SocketcanBus
    try:
        kernel_socket.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, RECEIVE_BUFFER_BYTES)
    except PermissionError:  # without CAP_NET_ADMIN the system's limit holds
        kernel_socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
    for _ in range(BURST_FRAMES):  # what came before python-can had set the filters of the socket that it had opened
        if bus.recv(0.0) is None:
            break
    return Receiver(bus, width, kernel_socket, has_error_classes=True)


def packets_received(channel: str) -> int:
    """Number of frames a SocketCAN interface has received, before our filters; 0 if it does not say."""
    try:
        return int((Path("/sys/class/net") / channel / "statistics" / "rx_packets").read_text())
    except (OSError, ValueError):
        return 0


def require_usable_interface(interface: str) -> None:
    """Raise BusError, saying what to install or to change, for an interface that cannot be used on this computer."""
    lacking = what_lacks(interface)
    if lacking is not None:
        raise BusError(lacking)


def what_lacks(interface: str) -> str | None:
    """Why this interface cannot be used on this computer, and how to mend it; None if nothing is known to be missing.

    Drivers of adapters are not checked: only opening the channel would show that.
    """
    if interface not in can.VALID_INTERFACES:
        return f"interface {interface!r} is unknown; known are {', '.join(sorted(can.VALID_INTERFACES))}"
    module, package = _PACKAGES.get(interface, ("can", "python-can"))
    if interface in _WINDOWS_ONLY and sys.platform != "win32":
        return f"interface {interface!r} exists on Windows only; choose another"
    if interface == "socketcan" and not hasattr(socket, "AF_CAN"):
        return "interface 'socketcan' exists on Linux only; choose another"
    if importlib.util.find_spec(module) is None:
        return f"interface {interface!r} needs the Python package {package}: pip install {package}"
    return None
