"""The interface of all receivers: bursts of frames and counts of everything else."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Protocol

from gateway.records import Frames

# SocketCAN's error classes (linux/can/error.h)
_ERROR_CLASSES: Final[Mapping[int, str]] = {
    0x001: "tx_timeout",
    0x002: "lost_arbitration",
    0x004: "controller",
    0x008: "protocol",
    0x010: "transceiver",
    0x020: "no_ack",
    0x040: "bus_off",
    0x080: "bus_error",
    0x100: "restarted",
    0x200: "counters",
}
BUS_OFF: Final = "bus_off"


@dataclass(frozen=True, slots=True)
class Burst:
    """Frames that came together, in order of arrival, and the counts of other events between them."""

    frames: Frames
    error_classes: Mapping[str, int] = field(default_factory=dict)
    error_frames: int = 0
    remote_frames: int = 0
    stamped_at_receipt: int = 0


class Receiver(Protocol):
    """An open CAN channel that is only listened to."""

    @property
    def dropped_kernel(self) -> int:
        """Frames the kernel lost for us since opening."""
        ...

    def receive(self, timeout_s: float) -> Burst:
        """The received frames, waiting up to ``timeout_s`` for a first one. Raises OSError or can.CanError."""
        ...

    def close(self) -> None:
        """Give the channel back."""
        ...


def error_class_names(error_id: int) -> list[str]:
    """The classes an error frame's identifier states."""
    return [name for bit, name in _ERROR_CLASSES.items() if error_id & bit] or ["unspecified"]
