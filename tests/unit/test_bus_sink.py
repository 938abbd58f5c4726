"""Replay: every frame once, in order, paced by the stamps, with progress, and stopped when told."""

import errno
import threading

import can
import pytest
from support.encoded import frames_of

from gateway.bus import sink as sink_module
from gateway.bus.sink import BusSink, replay_frames
from gateway.errors import BusError


class RecordingSink:
    """Keeps what was sent and when, by a clock the test owns."""

    def __init__(self, clock):
        self.clock = clock
        self.sent = []

    def send(self, frames):
        self.sent += [(self.clock.now_s, int(t)) for t in frames.t_ns]


class Clock:
    """Virtual time: sleeping moves it on."""

    now_s = 100.0

    def monotonic(self):
        return self.now_s

    def wait(self, seconds):
        self.now_s += seconds


class ClockedEvent(threading.Event):
    def __init__(self, clock):
        super().__init__()
        self.clock = clock

    def wait(self, timeout=None):
        self.clock.wait(timeout)
        return self.is_set()


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(sink_module, "time", clock)
    return clock


def frames(*t_s):
    return frames_of((round(t * 1e9), i, b"") for i, t in enumerate(t_s))


@pytest.mark.parametrize("speed", [0.5, 1.0, 4.0])
def test_frames_are_sent_when_their_stamps_say(speed, clock):
    sink = RecordingSink(clock)
    replay_frames([frames(5.0, 5.25), frames(7.0)], sink, speed, stop=ClockedEvent(clock))
    due_s = [100.0 + (t - 5.0) / speed for t in (5.0, 5.25, 7.0)]
    assert [sent_s for sent_s, _ in sink.sent] == pytest.approx(due_s)


def test_at_full_speed_nothing_waits(clock):
    sink = RecordingSink(clock)
    assert replay_frames([frames(5.0, 9000.0), frames(1e6)], sink, "max", stop=ClockedEvent(clock)) == 3
    assert {sent_s for sent_s, _ in sink.sent} == {100.0}


def test_where_a_clock_was_set_nothing_waits_and_the_pace_stays(clock):
    """Behind a step back everything was sent at once, behind a leap of years nothing ever."""
    sink = RecordingSink(clock)
    t_s = (5.0, 6.0, 3.0, 7.0, 1e9, 1e9 + 1.0)
    replay_frames([frames(*t_s)], sink, 1.0, stop=ClockedEvent(clock))
    assert [t for _, t in sink.sent] == [round(1e9 * t) for t in t_s]
    assert [sent_s for sent_s, _ in sink.sent] == pytest.approx([100.0, 101.0, 101.0, 105.0, 105.0, 106.0])


def test_progress_tells_frames_and_recorded_time(clock):
    told = []
    replay_frames([frames(5.0, 6.0)], RecordingSink(clock), "max", lambda *progress: told.append(progress))
    assert told == [(1, 0.0), (2, 1.0)]


def test_a_stop_ends_the_replay(clock):
    stop = ClockedEvent(clock)
    sink = RecordingSink(clock)
    n_sent = replay_frames([frames(*range(100))], sink, 1.0, lambda n_sent, _: n_sent == 3 and stop.set(), stop)
    assert n_sent == 3
    assert len(sink.sent) == 3


def test_a_receiver_that_takes_nothing_is_told_not_waited_for_forever(monkeypatch):
    monkeypatch.setattr(sink_module, "SEND_TIMEOUT_S", 0.01)
    with (
        can.Bus(interface="virtual", channel="sink-4", rx_queue_size=2, ignore_config=True),
        BusSink("virtual", "sink-4") as sink,
        pytest.raises(BusError, match="cannot send on virtual sink-4"),
    ):
        sink.send(frames(1.0, 2.0, 3.0))


def test_a_channel_that_is_missing_is_explained_as_the_service_explains_it(monkeypatch):
    def missing(**_):
        raise OSError(errno.ENODEV, "No such device")

    monkeypatch.setattr(can, "Bus", missing)
    with pytest.raises(BusError, match=r"cannot send on socketcan vcan9: the interface does not exist"):
        BusSink("socketcan", "vcan9")
