"""Weights as J1939 frames on a bus of their own; on the bus that is listened to nothing is ever sent."""

import ast
import json
import math
import time
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import can
import cantools
import pytest
from support.commands import called
from support.estimates import make_estimate
from support.log import names
from support.patience import wait_until

import gateway
from gateway.bus import broadcast as broadcaster_module
from gateway.bus.broadcast import Broadcaster, Sender, WeightFrames
from gateway.bus.frames import message_of
from gateway.bus.sink import BusSink
from gateway.errors import ConfigurationError
from gateway.estimate import Estimate, Quantity, Weight, Weights
from gateway.log import Event

# By SAE J1939-71, written down a second time: bytes, kg a bit
VW, CVW, ERROR, UNKNOWN = 65258, 65136, "error", "not available"
PLACES = {
    (VW, "axle"): (1, 0.5),
    (VW, "trailer"): (3, 2.0),
    (VW, "cargo"): (5, 2.0),
    (CVW, "powered"): (0, 10.0),
    (CVW, "combination"): (2, 10.0),
}


def told(message: can.Message) -> dict[str, Any]:
    """What a receiver reads in a frame, by the standard's own table."""
    pgn = message.arbitration_id >> 8 & 0x3FFFF
    found: dict[str, Any] = {"pgn": pgn}
    if pgn == VW:
        found |= {"axle_location": message.data[0] >> 4, "tire_location": message.data[0] & 0xF}
    for (group, name), (byte, kg_per_bit) in PLACES.items():
        raw = int.from_bytes(message.data[byte : byte + 2], "little")
        if group == pgn:
            found[name] = UNKNOWN if raw >= 0xFF00 else ERROR if raw >= 0xFE00 else raw * kg_per_bit
    return found


def messages_of(estimate: Estimate | None, sender: Sender) -> list[can.Message]:
    frames = WeightFrames(sender).of(estimate, time.time_ns())
    return [message_of(frames, row) for row in range(len(frames))]


def weighed(gross_kg: float = 1711.3, front_kg: float = 1006.1, payload_kg: float = 270.6) -> Estimate:
    weights = Weights(
        gross=Weight(gross_kg, 6.1), front_axle=Weight(front_kg, 5.4), rear_axle=Weight(gross_kg - front_kg, 5.4)
    )
    return replace(make_estimate(3), payload=Quantity.normal(payload_kg, 6.0), weights=weights)


def test_weights_are_what_a_receiver_reads_by_the_standard() -> None:
    front, rear, combination = map(told, messages_of(weighed(), Sender(0x42)))
    shared = {"pgn": VW, "tire_location": 15, "trailer": UNKNOWN, "cargo": 270.0}
    assert front == shared | {"axle_location": 1, "axle": 1006.0}
    assert rear == shared | {"axle_location": 2, "axle": 705.0}
    assert combination == {"pgn": CVW, "powered": 1710.0, "combination": 1710.0}


def test_the_shipped_database_reads_the_same() -> None:
    database: Any = cantools.database.load_string(files("gateway.dbc").joinpath("j1939_weights.dbc").read_text(), "dbc")
    front, _, combination = messages_of(weighed(), Sender(0xFE))
    read = database.decode_message(front.arbitration_id, front.data)
    assert (read["AxleLocation"], read["AxleWeight"], read["CargoWeight"]) == (1, 1006.0, 270.0)
    assert database.decode_message(combination.arbitration_id, combination.data) == {
        "PoweredVehicleWeight": 1710.0,
        "GrossCombinationVehicleWeight": 1710.0,
    }


def test_address_priority_and_first_axle_are_as_set() -> None:
    front, rear, combination = messages_of(weighed(), Sender(0x42, priority=3, first_axle=0))
    assert [message.arbitration_id for message in (front, rear, combination)] == [0x0CFEEA42, 0x0CFEEA42, 0x0CFE7042]
    assert all(message.is_extended_id and message.dlc == 8 for message in (front, rear, combination))
    assert [told(front)["axle_location"], told(rear)["axle_location"]] == [0, 1]


def test_what_a_vehicle_draws_is_not_weighed() -> None:
    *_, combination = messages_of(weighed(), Sender(0x42, draws_trailers=True))
    assert told(combination) == {"pgn": CVW, "powered": 1710.0, "combination": UNKNOWN}


@pytest.mark.parametrize(
    "estimate", [None, replace(weighed(), is_provisional=True), make_estimate(3)], ids=["old", "provisional", "unknown"]
)
def test_what_is_not_known_is_not_available(estimate: Estimate | None) -> None:
    found = [told(message) for message in messages_of(estimate, Sender(0x42))]
    weights = [found[0]["axle"], found[1]["axle"], found[2]["powered"], found[2]["combination"]]
    assert weights == [UNKNOWN] * 4
    if estimate is None or estimate.is_provisional:
        assert found[0]["cargo"] == UNKNOWN


@pytest.mark.parametrize(
    ("front_kg", "read"), [(32_127.5, 32_127.5), (32_128.0, ERROR), (1e9, ERROR), (-1.0, ERROR), (math.nan, UNKNOWN)]
)
def test_what_two_bytes_cannot_say_is_an_error(front_kg: float, read: float | str) -> None:
    front, *_ = messages_of(weighed(100_000.0, front_kg), Sender(0x42))
    assert told(front)["axle"] == read


def test_a_payload_below_nothing_is_nothing() -> None:
    assert told(messages_of(weighed(payload_kg=-12.0), Sender(0x42))[0])["cargo"] == 0.0


def test_a_bus_that_fails_is_told_and_tried_again(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO", "gateway")
    monkeypatch.setattr(broadcaster_module, "RETRY_S", 0.01)
    fail = [OSError("no such device"), OSError("no such device")]
    make = can.Bus

    def failing(*arguments: Any, **options: Any) -> can.BusABC:
        if fail:
            raise fail.pop()
        return make(*arguments, **options)

    monkeypatch.setattr(can, "Bus", failing)
    sender = Broadcaster("virtual", "tried-again", {}, Sender(66), 0.1, lambda: None)
    sender.start()
    assert wait_until(lambda: sender.n_sent >= 3)
    sender.stop()
    assert not sender.is_alive()
    assert sender.fault is None
    assert [name for name in names(caplog) if name in (Event.BROADCASTING, Event.NOT_BROADCASTING)] == [
        Event.NOT_BROADCASTING,  # twice for one reason is one line
        Event.BROADCASTING,
    ]


@pytest.mark.parametrize(
    ("broadcast", "words"),
    [
        (
            'interface = "virtual"\nchannel = "X"\nsource_address = 66',
            "[broadcast] virtual X is the bus that the service listens to",
        ),
        ('interface = "virtual"\nsource_address = 66', "interface needs channel and source_address"),
        ('channel = "y"', "nothing is sent without interface"),
        ('interface = "socketcn"\nchannel = "y"\nsource_address = 66', "[broadcast] interface 'socketcn' is unknown"),
        ('interface = "virtual"\nchannel = "y"\nsource_address = 254', "broadcast.source_address: 254 is above 253"),
    ],
)
def test_check_config_refuses_what_could_disturb(broadcast: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "springscale.toml"
    path.write_text(
        'signals = "springscale:reference"\n[bus]\ninterface = "virtual"\nchannel = "x"\n[web]\nport = 0\n'
        f'[store]\ndirectory = "state"\n[broadcast]\n{broadcast}\n'
    )
    found = called("check-config", path)
    assert isinstance(found.exception, ConfigurationError)
    assert words in str(found.exception)


def test_check_config_says_where_weights_are_sent(tmp_path: Path) -> None:
    path = tmp_path / "springscale.toml"
    path.write_text(
        'signals = "springscale:reference"\n[bus]\ninterface = "virtual"\nchannel = "x"\n[web]\nport = 0\n'
        '[store]\ndirectory = "state"\n'
        '[broadcast]\ninterface = "virtual"\nchannel = "y"\nsource_address = 66\n'
    )
    assert "Sends weights on y" in called("check-config", path).output
    told = called("check-config", path, "--json").output
    assert json.loads(told)["broadcast"] == "y"


SENDING = {"send", "sendall", "sendto", "sendmsg", "send_periodic"}


def test_one_file_alone_can_send_on_a_bus() -> None:
    """What opens a bus to listen calls nothing that sends; whoever sends goes through BusSink, on its own channel."""
    bus = Path(BusSink.__module__.replace(".", "/")).parent
    senders = {
        path.name
        for path in (Path(gateway.__file__).parents[1] / bus).rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in SENDING
        if path.parent.name != "feed"  # a program of its own, which the service never loads
    }
    assert senders == {"sink.py", "broadcast.py"}
