"""The SocketCAN receiver over a loopback socket: the same datagrams, the same kernel stamps, no CAN hardware."""

import errno
import socket
import struct
import time

import numpy as np
import pytest
from support.patience import PATIENCE_S

from gateway.bus.live.socketcan import (
    SocketCanReceiver,
    ask_for_stamps,
    open_socketcan,
    packed_filters,
    packets_received,
)
from gateway.bus.signals.mapping import exact_filter, j1939_filter
from gateway.records import EXTENDED_ID

SO_RXQ_OVFL = 40


def classic(can_id, payload):
    return struct.pack("=IB3x8s", can_id, len(payload), payload)


def can_fd(can_id, payload):
    return struct.pack("=IB3x64s", can_id, len(payload), payload)


@pytest.fixture
def wire():
    """(send, receiver): what is sent reaches the receiver's socket as one CAN datagram each."""
    receiving = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiving.bind(("127.0.0.1", 0))
    ask_for_stamps(receiving)
    sending = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sending.connect(receiving.getsockname())
    receivers = []

    def receiver(width=8):
        receivers.append(SocketCanReceiver(receiving, width))
        return receivers[0]

    yield sending.send, receiver, receiving
    sending.close()
    receiving.close()


def test_frames_come_in_order_with_kernel_stamps(wire):
    send, make_receiver, _ = wire
    receiver = make_receiver()
    before_ns = time.time_ns()
    for i in range(20):
        send(classic(0x100 + i, bytes([i] * (i % 9))))
    burst = receiver.receive(PATIENCE_S)
    assert burst.frames.can_id.tolist() == [0x100 + i for i in range(20)]
    assert burst.frames.length.tolist() == [i % 9 for i in range(20)]
    assert burst.frames.payload[10].tolist() == [10, 0, 0, 0, 0, 0, 0, 0]
    assert (np.diff(burst.frames.t_ns) >= 0).all()
    assert before_ns <= burst.frames.t_ns[0] <= burst.frames.t_ns[-1] <= time.time_ns()
    assert (burst.error_frames, burst.is_bus_off) == (0, False)


def test_what_came_before_the_interface_went_down_is_given_first(wire):
    """The kernel tells of it once, in the middle of a burst: the frames that were read by then were lost."""
    send, _, receiving = wire

    class GoesDown:
        n_read = 0

        def fileno(self):
            return receiving.fileno()

        def recvmsg(self, *how):
            self.n_read += 1
            if self.n_read == 3:
                raise OSError(errno.ENETDOWN, "Network is down")
            return receiving.recvmsg(*how)

    for i in range(3):
        send(classic(0x100 + i, b""))
    receiver = SocketCanReceiver(GoesDown(), 8)
    assert receiver.receive(PATIENCE_S).frames.can_id.tolist() == [0x100, 0x101]
    with pytest.raises(OSError, match="Network is down"):
        receiver.receive(PATIENCE_S)


def test_bytes_beyond_the_length_are_zero(wire):
    send, make_receiver, _ = wire
    send(struct.pack("=IB3x8s", 0x100, 2, b"\xff" * 8))
    assert make_receiver().receive(PATIENCE_S).frames.payload.tolist() == [[255, 255, 0, 0, 0, 0, 0, 0]]


def test_error_and_remote_frames_are_not_handed_on(wire):
    send, make_receiver, _ = wire
    send(classic(0x20000000 | 0x040 | 0x004, bytes(8)))
    send(classic(0x40000000 | 0x100, b""))
    send(classic(0x12345678 | EXTENDED_ID, b"\1"))
    burst = make_receiver().receive(PATIENCE_S)
    assert burst.frames.can_id.tolist() == [0x12345678 | EXTENDED_ID]
    assert (burst.error_frames, burst.is_bus_off) == (1, True)


def test_another_error_frame_is_no_bus_off(wire):
    send, make_receiver, _ = wire
    send(classic(0x20000000 | 0x004, bytes(8)))
    burst = make_receiver().receive(PATIENCE_S)
    assert (len(burst.frames), burst.error_frames, burst.is_bus_off) == (0, 1, False)


@pytest.mark.parametrize(("width", "kept"), [(64, 12), (8, 8)])
def test_can_fd_frames_among_classic_ones(width, kept, wire):
    send, make_receiver, _ = wire
    send(classic(0x100, b"\1\2"))
    send(can_fd(0x101, b"\7" * 12))
    frames = make_receiver(width).receive(PATIENCE_S).frames
    assert frames.length.tolist() == [2, 12]
    assert frames.payload.shape == (2, width)
    assert frames.payload[1].tolist() == [7] * kept + [0] * (width - kept)


def test_nothing_comes_of_silence(wire):
    assert len(wire[1]().receive(0.01).frames) == 0


def test_the_kernels_count_of_lost_frames_is_kept(wire):
    send, make_receiver, receiving = wire
    receiver = make_receiver()
    receiving.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    n_sent = 200
    for _ in range(n_sent):
        send(classic(0x100, bytes(8)))
    n_received = len(receiver.receive(PATIENCE_S).frames)
    send(classic(0x100, bytes(8)))  # the count travels with the next frame
    n_received += len(receiver.receive(PATIENCE_S).frames)
    assert receiver.dropped_kernel > 0
    assert n_received + receiver.dropped_kernel == n_sent + 1


def test_without_kernel_stamps_frames_are_stamped_on_receipt(wire):
    send, make_receiver, receiving = wire
    receiving.setsockopt(socket.SOL_SOCKET, 35, 0)
    before_ns = time.time_ns()
    send(classic(0x100, b"\1"))
    burst = make_receiver().receive(PATIENCE_S)
    assert before_ns <= burst.frames.t_ns[0] <= time.time_ns()


def test_a_closed_socket_is_an_os_error(wire):
    receiver = wire[1]()
    receiver.close()
    with pytest.raises((OSError, ValueError)):
        receiver.receive(0.1)


def test_filters_ask_for_data_frames_of_one_format():
    packed = packed_filters((exact_filter(0x120), j1939_filter(0x18FEF1FE | EXTENDED_ID)))
    assert struct.unpack("=4I", packed) == (0x120, 0xC00007FF, 0x80FEF100, 0xC3FFFF00)


def test_an_interface_that_is_not_there_has_no_statistics():
    assert packets_received("no-such-interface") == 0
    assert packets_received("lo") >= 0


def test_opening_a_missing_interface_is_an_os_error():
    with pytest.raises(OSError, match=r"No such device|not supported"):
        open_socketcan("nocan9", (exact_filter(0x120),), 8)
