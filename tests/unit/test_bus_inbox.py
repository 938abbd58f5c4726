"""The inbox: bounded, in order, and nothing leaves it uncounted."""

import threading

import numpy as np
import pytest
from support.patience import PATIENCE_S

from gateway.bus.live.receiver import Inbox
from gateway.records import Frames


def burst(first, n):
    return Frames(
        np.arange(first, first + n, dtype=np.int64),
        np.zeros(n, np.uint32),
        np.zeros(n, np.uint8),
        np.zeros((n, 8), np.uint8),
    )


def test_what_was_put_comes_out_at_once_in_order():
    inbox = Inbox(100, 8)
    inbox.put(burst(0, 3))
    inbox.put(burst(3, 2))
    assert len(inbox) == 5
    assert inbox.drain(0.0).t_ns.tolist() == [0, 1, 2, 3, 4]
    assert inbox.drain(0.0) is None


def test_a_full_inbox_keeps_the_oldest_and_counts_the_rest():
    inbox = Inbox(5, 8)
    inbox.put(burst(0, 4))
    inbox.put(burst(4, 4))
    inbox.put(burst(8, 4))
    assert inbox.dropped == 7
    assert inbox.drain(0.0).t_ns.tolist() == [0, 1, 2, 3, 4]


def test_what_is_drained_makes_room_again():
    inbox = Inbox(5, 8)
    for first in range(0, 50, 5):
        inbox.put(burst(first, 5))
        inbox.drain(0.0)
    assert inbox.dropped == 0


def test_a_drain_waits_for_a_put():
    inbox = Inbox(5, 8)
    threading.Timer(0.05, inbox.put, [burst(7, 1)]).start()
    assert inbox.drain(PATIENCE_S).t_ns.tolist() == [7]


def test_a_closed_inbox_gives_what_it_holds_and_waits_no_more():
    inbox = Inbox(5, 8)
    inbox.put(burst(0, 2))
    inbox.close()
    assert len(inbox.drain(PATIENCE_S)) == 2
    assert inbox.drain(PATIENCE_S) is None


@pytest.mark.parametrize("n_bursts", [1, 40])
def test_a_sender_that_can_wait_loses_nothing(n_bursts):
    inbox = Inbox(8, 8, waits_for_room=True)
    sender = threading.Thread(target=lambda: [inbox.put(burst(10 * i, 10)) for i in range(n_bursts)])
    sender.start()
    drained = []
    while len(drained) < 10 * n_bursts:
        frames = inbox.drain(PATIENCE_S)
        assert frames is not None
        drained += frames.t_ns.tolist()
    sender.join()
    assert drained == list(range(10 * n_bursts))
    assert inbox.dropped == 0


def test_closing_frees_a_sender_that_waits():
    inbox = Inbox(1, 8, waits_for_room=True)
    inbox.put(burst(0, 1))
    sender = threading.Thread(target=inbox.put, args=[burst(1, 1)])
    sender.start()
    inbox.close()
    sender.join(PATIENCE_S)
    assert not sender.is_alive()
