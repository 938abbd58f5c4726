"""A service that broadcasts: on the bus given for it, and never on the one that it listens to."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import can
import pytest
from can.interfaces.virtual import VirtualBus
from support.bus_drive import START_NS, white_noise
from support.calibrated import calibration_file
from support.estimates import make_record
from support.patience import wait_until
from support.running_service import Running, configuration, serve

from gateway.bus.logs import write_candump
from gateway.store import Store

ADDRESS = 66
VW = 65258
NOT_AVAILABLE = b"\xff\xff"


@contextmanager
def listening(channel: str) -> Iterator[list[can.Message]]:
    """What anyone on an in-process bus hears meanwhile."""
    heard: list[can.Message] = []
    with can.Bus(interface="virtual", channel=channel, ignore_config=True) as bus:
        notifier = can.Notifier(bus, [heard.append], timeout=0.05)
        try:
            yield heard
        finally:
            notifier.stop()


def broadcasting(folder: Path) -> str:
    return (
        f'[broadcast]\ninterface = "virtual"\nchannel = "{folder.name}-out"\n'
        f"source_address = {ADDRESS}\nevery_s = 0.1\n"
    )


def cargo(message: can.Message) -> bytes | None:
    """The bytes of the cargo's weight, where it is a VW."""
    return bytes(message.data[5:7]) if message.arbitration_id >> 8 & 0x3FFFF == VW else None


def test_the_service_sends_on_its_own_bus_and_never_on_the_one_it_listens_to(tmp_path: Path) -> None:
    calibration = calibration_file(payload_kg=12.0, front_share_pct=51.0).to_json()
    config = configuration(tmp_path, calibration, broadcasting(tmp_path))
    log = tmp_path / "drive.log"
    write_candump(white_noise(45.0, START_NS, seed=0), "can0", log)
    n_played = 0
    with listening(tmp_path.name) as where_it_listens, listening(f"{tmp_path.name}-out") as where_it_sends:

        def meet(running: Running) -> None:
            nonlocal n_played
            running.play(log)
            n_played = running.gateway.source.counts().frames
            n_before = len(where_it_sends)
            assert wait_until(lambda: len(where_it_sends) > n_before + 6)
            assert running.gateway.broadcaster.fault is None

        serve(config, meet)
    assert {message.arbitration_id & 0xFF for message in where_it_sends} == {ADDRESS}
    told = [weight for message in where_it_sends if (weight := cargo(message)) is not None]
    assert told[0] == NOT_AVAILABLE  # nothing was weighed yet
    assert int.from_bytes(told[-1], "little") * 2 == 12
    assert len(where_it_listens) == n_played > 0  # what the test sent, and no frame more


def test_a_service_that_is_not_asked_sends_nothing_anywhere(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    sent: list[Any] = []
    monkeypatch.setattr(VirtualBus, "send", lambda _self, message, timeout=None: sent.append(message))
    config = configuration(tmp_path, calibration_file().to_json())
    serve(config, lambda running: time.sleep(0.5))
    assert sent == []


def test_an_old_estimate_is_not_available(tmp_path: Path) -> None:
    """The page shows it as stale; a bus has no word for an age."""
    store = Store.open(tmp_path / "state")
    store.write_estimate(make_record(3))
    store.close()
    config = configuration(tmp_path, calibration_file().to_json(), broadcasting(tmp_path))
    config.write_text(config.read_text().replace("web.port = 0", "web.port = 0\nweb.stale_after_s = 0.001"))
    with listening(f"{tmp_path.name}-out") as heard:

        def meet(running: Running) -> None:
            assert running.gateway.board.shown().is_stale
            assert wait_until(lambda: len(heard) >= 3)

        serve(config, meet)
    assert [cargo(message) for message in heard[:2]] == [NOT_AVAILABLE] * 2
