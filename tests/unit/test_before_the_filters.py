"""Frames that reach a SocketCAN socket between its opening and its filters."""

import socket
from collections import deque

import can
import pytest

from gateway.bus.receiver import open_channel
from gateway.bus.signals import IdFilter


class OpenedSocket:
    """A bus whose socket took two frames before its filters were set."""

    def __init__(self, **_: object) -> None:
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.queue = deque([can.Message(arbitration_id=0x7A), can.Message(arbitration_id=0x7B)])

    def recv(self, timeout: float | None = None) -> can.Message | None:
        return self.queue.popleft() if self.queue else None

    def shutdown(self) -> None:
        self.socket.close()


def test_a_frame_that_came_before_the_filters_is_not_taken_for_one_of_ours(monkeypatch: pytest.MonkeyPatch) -> None:
    """The status would say that the bus fell silent, where no sensor was ever heard."""
    bus = OpenedSocket()
    monkeypatch.setattr(can, "Bus", lambda **_: bus)
    receiver = open_channel("socketcan", "vcan0", [IdFilter(0x130, 0x7FF)], 8, {})
    try:
        assert len(receiver.receive(0.0).frames) == 0
        bus.queue.append(can.Message(arbitration_id=0x130, is_extended_id=False, data=bytes(8), timestamp=1.79e9))
        assert receiver.receive(0.0).frames.can_id.tolist() == [0x130]
    finally:
        receiver.close()
