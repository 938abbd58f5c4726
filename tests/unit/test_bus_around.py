"""Looking around on a bus for the sensor that was set to another identifier, on a bus that others may open too."""

import errno
import threading
from contextlib import contextmanager

import can
from support.patience import PATIENCE_S, wait_until

from gateway.bus.heard import similar_to
from gateway.bus.live import bus_survey as around_module
from gateway.bus.live.bus_survey import BusSurvey, bus_survey_of
from gateway.bus.signals import load_signal_map

MAP = load_signal_map("springscale:reference")
ACCELERATION = next(message for message in MAP.messages if message.frame_id == 0x120)


@contextmanager
def chatter(channel, *messages):
    """Others on the bus, each message a hundred times a second or so."""
    over = threading.Event()
    bus = can.Bus(interface="virtual", channel=channel)

    def talk():
        while not over.wait(0.01):
            for can_id, is_extended, length in messages:
                bus.send(can.Message(arbitration_id=can_id, is_extended_id=is_extended, data=bytes(length)))

    thread = threading.Thread(target=talk)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
        bus.shutdown()


def test_every_identifier_of_either_width_is_heard_and_the_nearest_named(request):
    channel = request.node.name
    around = bus_survey_of("virtual", channel, {})
    with chatter(channel, (0x122, False, 8), (0x120, True, 8), (0x7DF, False, 3), (0x121, False, 8)):
        around.look()
        assert wait_until(lambda: around.heard)
    assert [one.name for one in around.heard] == ["121", "122", "7DF", "00000120"]
    told = similar_to(ACCELERATION, MAP, around.heard)
    assert [words.split(",")[0] for words in told] == ["00000120", "122"]  # 121 is mapped, 7DF is no neighbour
    assert all("times a second, 8 bytes" in words for words in told)
    around.forget()
    assert around.heard == ()
    around.stop()


def test_one_look_at_a_time_and_one_a_minute(monkeypatch):
    monkeypatch.setattr(around_module, "LOOK_S", 0.05)
    n_opened = []

    def broken():
        n_opened.append(1)
        raise OSError(errno.ENETDOWN, "Network is down")

    around = BusSurvey(broken)
    for _ in range(5):
        around.look()
    around.stop()
    assert (len(n_opened), around.heard) == (1, ())
    around.look()  # stopped
    assert len(n_opened) == 1


def test_a_sensor_that_comes_and_goes_begins_no_second_look_beside_the_first():
    n_opened = []
    is_over = threading.Event()

    def slow():
        n_opened.append(1)
        is_over.wait(PATIENCE_S)
        raise OSError(errno.ENETDOWN, "Network is down")

    around = BusSurvey(slow)
    around.look()
    assert wait_until(lambda: n_opened)
    around.forget()
    around.look()
    is_over.set()
    around.stop()
    assert len(n_opened) == 1


def test_an_adapter_that_one_program_alone_may_open_is_left_alone():
    around = bus_survey_of("slcan", "/dev/ttyUSB0", {})
    around.look()
    around.stop()
    assert around.heard == ()
