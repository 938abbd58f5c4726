"""Adapters that send what their own driver cannot read: a fault of the line, and nothing is lost with it."""

import can
import pytest
from support.patience import wait_until

from gateway.bus.live import source as source_module
from gateway.bus.live.python_can import PythonCanReceiver
from gateway.bus.live.source import LiveSource, SourceState
from gateway.bus.signals import load_signal_map

GARBLED = [
    ValueError("invalid literal for int() with base 16: '1g0'"),
    IndexError("string index out of range"),
    UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid start byte"),
    can.CanOperationError("the adapter is gone"),
    OSError(5, "Input/output error"),
]


class FakeBus:
    """Gives what the script says, then nothing."""

    def __init__(self, *script: can.Message | Exception) -> None:
        self.script = list(script)
        self.is_shut_down = False

    def recv(self, timeout: float | None = None) -> can.Message | None:
        step = self.script.pop(0) if self.script else None
        if isinstance(step, Exception):
            raise step
        return step

    def shutdown(self) -> None:
        self.is_shut_down = True


def message(number: int) -> can.Message:
    return can.Message(timestamp=1.0 + number, arbitration_id=0x120 + number, is_extended_id=False, data=bytes(8))


@pytest.mark.parametrize("fault", GARBLED, ids=lambda fault: type(fault).__name__)
def test_what_came_before_a_fault_is_given_first(fault: Exception) -> None:
    receiver = PythonCanReceiver(FakeBus(message(0), message(1), fault), 8)  # type: ignore[arg-type] # as much as is asked
    assert receiver.receive(0.0).frames.can_id.tolist() == [0x120, 0x121]
    with pytest.raises((can.CanError, OSError)):
        receiver.receive(0.0)


@pytest.mark.parametrize("fault", GARBLED, ids=lambda fault: type(fault).__name__)
def test_an_adapter_that_garbles_a_line_is_opened_anew(fault: Exception, monkeypatch: pytest.MonkeyPatch) -> None:
    """slcan's parser raises whatever noise on the line makes int() raise: it ended the thread and the service."""
    monkeypatch.setattr(source_module, "FIRST_PAUSE_S", 0.001)
    buses = [FakeBus(message(0), fault), FakeBus(message(1))]
    opened = iter(buses)
    signal_map = load_signal_map("springscale:reference")
    source = LiveSource(
        "virtual",
        "garbled",
        signal_map,
        open_receiver=lambda: PythonCanReceiver(next(opened), 8),  # type: ignore[arg-type] # as above
    )
    source.start()
    assert wait_until(lambda: source.counts().frames == 2)
    assert source.failure is None
    assert (source.counts().reconnects, buses[0].is_shut_down) == (1, True)
    source.stop()
    assert source.state is SourceState.STOPPED
