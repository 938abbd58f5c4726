"""Around the live source: its inbox, and adapters that send what their driver cannot read."""

import threading

import numpy as np
import pytest
from support.encoded import frames_of
from support.patience import PATIENCE_S

from gateway.bus.listen import DRAINED_FRAMES, Inbox


def burst(first, n):
    return frames_of((i, 0, b"") for i in range(first, first + n))


@pytest.mark.parametrize("sizes", [[DRAINED_FRAMES] * 3, [3 * DRAINED_FRAMES], [1000] * 13, [1, DRAINED_FRAMES, 5000]])
def test_one_drain_gives_no_more_than_a_turn_of_the_pipeline_can_take(sizes):
    """A full inbox of stamps that jump was half a minute of one turn; the watchdog waits for 20 s."""
    inbox = Inbox(20_000, 8)
    for n, first in zip(sizes, np.cumsum([0, *sizes[:-1]]), strict=True):
        inbox.put(burst(int(first), n))
    drained = []
    while (frames := inbox.drain(0.0)) is not None:
        assert 0 < len(frames) <= DRAINED_FRAMES
        drained += frames.t_ns.tolist()
        assert len(inbox) == sum(sizes) - len(drained)
    assert drained == list(range(sum(sizes)))


def test_a_full_inbox_keeps_the_oldest_and_counts_the_rest():
    inbox = Inbox(5, 8)
    inbox.put(burst(0, 4))
    inbox.put(burst(4, 4))
    inbox.put(burst(8, 4))
    assert inbox.dropped == 7
    assert inbox.drain(0.0).t_ns.tolist() == [0, 1, 2, 3, 4]


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
