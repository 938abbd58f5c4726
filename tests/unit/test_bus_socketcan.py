"""SocketCAN by python-can over a loopback socket: the same datagrams, the same kernel stamps, no CAN hardware."""

import socket
import struct
import time

import numpy as np
import pytest
from can.interfaces.socketcan import socketcan
from support.patience import PATIENCE_S

from gateway.bus.receiver import Receiver, open_channel, packets_received
from gateway.bus.signals.mapping import exact_filter, j1939_filter
from gateway.records import EXTENDED_ID

FILTERS = (exact_filter(0x120), j1939_filter(0x18FEF1FE | EXTENDED_ID))


def classic(can_id, payload):
    return struct.pack("=IB3x8s", can_id, len(payload), payload)


def can_fd(can_id, payload):
    return struct.pack("=IBB2x64s", can_id, len(payload), 4, payload)


class Wire:
    """What is sent reaches the receiver's socket as one CAN datagram each."""

    def __init__(self, monkeypatch):
        self.receiving = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.receiving.bind(("127.0.0.1", 0))
        self.sending = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.sending.connect(self.receiving.getsockname())
        self.send = self.sending.send
        self.filters = None
        monkeypatch.setattr(socketcan, "create_socket", lambda: self.receiving)
        monkeypatch.setattr(socketcan, "bind_socket", lambda sock, channel: None)
        self._opened = []

        def apply_filters(bus, filters):
            self.filters, bus._is_filtered = socketcan.pack_filters(filters), True

        monkeypatch.setattr(socketcan.SocketcanBus, "_apply_filters", apply_filters)

    def receiver(self, width=8) -> Receiver:
        self._opened.append(open_channel("socketcan", "can9", FILTERS, width, {}))
        return self._opened[-1]

    def close(self):
        for receiver in self._opened:
            receiver.close()
        self.receiving.close()
        self.sending.close()


@pytest.fixture
def wire(monkeypatch):
    wire = Wire(monkeypatch)
    yield wire
    wire.close()


def test_frames_come_in_order_with_kernel_stamps(wire):
    receiver = wire.receiver()
    before_ns = time.time_ns()
    for i in range(20):
        wire.send(classic(0x100 + i, bytes([i] * (i % 9))))
    burst = receiver.receive(PATIENCE_S)
    assert burst.frames.can_id.tolist() == [0x100 + i for i in range(20)]
    assert burst.frames.length.tolist() == [i % 9 for i in range(20)]
    assert burst.frames.payload[10].tolist() == [10, 0, 0, 0, 0, 0, 0, 0]
    assert (np.diff(burst.frames.t_ns) >= 0).all()
    assert before_ns - 1000 <= burst.frames.t_ns[0] <= burst.frames.t_ns[-1] <= time.time_ns()
    assert (burst.error_frames, burst.is_bus_off) == (0, False)


def test_a_frame_that_came_before_the_filters_is_not_taken_for_one_of_ours(wire):
    """The status would say that the bus fell silent, where no sensor was ever heard."""
    wire.send(classic(0x7A, b""))
    wire.send(classic(0x7B, b""))
    receiver = wire.receiver()
    assert len(receiver.receive(0.01).frames) == 0
    wire.send(classic(0x120, bytes(8)))
    assert receiver.receive(PATIENCE_S).frames.can_id.tolist() == [0x120]


@pytest.mark.parametrize(("width", "kept"), [(64, 12), (8, 8)])
def test_can_fd_frames_among_classic_ones(width, kept, wire):
    receiver = wire.receiver(width)
    wire.send(classic(0x100, b"\1\2"))
    wire.send(can_fd(0x101, b"\7" * 12))
    frames = receiver.receive(PATIENCE_S).frames
    assert frames.length.tolist() == [2, 12]
    assert frames.payload.shape == (2, width)
    assert frames.payload[1].tolist() == [7] * kept + [0] * (width - kept)


def test_the_kernels_count_of_lost_frames_is_kept(wire):
    receiver = wire.receiver()
    wire.receiving.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    n_sent = 200
    for _ in range(n_sent):
        wire.send(classic(0x100, bytes(8)))
    n_received = len(receiver.receive(PATIENCE_S).frames)
    assert receiver.dropped_kernel > 0
    assert n_received + receiver.dropped_kernel == n_sent
    n_dropped = receiver.dropped_kernel
    receiver.close()
    assert receiver.dropped_kernel == n_dropped


def test_filters_ask_for_frames_of_one_format(wire):
    wire.receiver()
    assert struct.unpack("=4I", wire.filters) == (0x120, 0x800007FF, 0x80FEF100, 0x83FFFF00)


def test_an_interface_that_is_not_there_has_no_statistics():
    assert packets_received("no-such-interface") == 0
    assert packets_received("lo") >= 0


def test_opening_a_missing_interface_is_an_os_error():
    with pytest.raises(OSError, match=r"No such device|not supported"):
        open_channel("socketcan", "nocan9", FILTERS, 8, {})
