"""The service's limits on itself, made as wide as a test's patience: what is slow here is the machine.

A stop that gives a thread one second, a sender that gives a full queue five: right on a vehicle, chance in a test.
``python -m support.unhurried run --config FILE`` is springscale with the same.
"""

import pytest

from gateway.bus import listen, sink
from gateway.bus.ring_log import RingLog
from gateway.cli import main
from gateway.cli import service as asked_service
from gateway.service.pipeline import Pipeline
from gateway.store import Store, StoreReader
from gateway.uplink import uplink
from gateway.uplink.uplink import Uplink
from support.patience import PATIENCE_S

CONSTANTS = (
    (listen, "START_WAIT_S"),
    (sink, "SEND_TIMEOUT_S"),
    (asked_service, "TIMEOUT_S"),
    (uplink, "CONNECT_TIMEOUT_S"),
)
ONLY_DEFAULT = (listen.LiveSource.stop, Pipeline.stop, RingLog.stop, Uplink.stop, Store.close, StoreReader.__init__)


def unhurry(patch: pytest.MonkeyPatch) -> None:
    """Widen every limit; a test that is about one of them sets it itself."""
    for room, name in CONSTANTS:
        patch.setattr(room, name, PATIENCE_S)
    for limited in ONLY_DEFAULT:
        assert len(limited.__defaults__ or ()) == 1, f"{limited} has more to it than its limit"
        patch.setattr(limited, "__defaults__", (PATIENCE_S,))


if __name__ == "__main__":
    unhurry(pytest.MonkeyPatch())
    main()
