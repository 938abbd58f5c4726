"""One suite over every kind of database: the same messages as DBC, KCD or ARXML are the same signal map."""

from dataclasses import replace

import cantools
import numpy as np
import pytest
from support.databases import SomeMessage, SomeSignal, arxml, dbc, kcd

from gateway.bus.signals import Decoder, load_signal_map
from gateway.errors import SignalMapError
from gateway.records import EXTENDED_ID, Frames, Signal

AXES = {"is_signed": True, "minimum": -30.0, "maximum": 30.0}
MESSAGES = (
    SomeMessage(
        "IMU",
        0x120,
        8,
        [
            SomeSignal("AccelZ", 7, 16, "m/s^2", 0.001, is_big_endian=True, **AXES),
            SomeSignal("RateY", 16, 12, "deg/s", 0.25, **AXES),
            SomeSignal("Valid", 30, 1, ""),
            SomeSignal("Counter", 32, 4, "", maximum=15.0),
        ],
    ),
    SomeMessage("GPS", 0x18FEE8, 8, [SomeSignal("Speed", 3, 13, "km/h", 0.05, 1.5, maximum=300.0)], is_extended=True),
    SomeMessage("WIDE", 0x300, 64, [SomeSignal("Roll", 320, 32, "rad/s", is_float=True, **AXES)]),
)
WRITERS = {"dbc": dbc, "kcd": kcd, "arxml": arxml}
MAP = """
[signals.vertical_acceleration]
message = "IMU"
signal = "AccelZ"
valid_when = { Valid = 1 }
counter = "Counter"
[signals.pitch_rate]
message = "IMU"
signal = "RateY"
sign = -1
[signals.roll_rate]
message = "WIDE"
signal = "Roll"
[signals.speed]
message = "GPS"
signal = "Speed"
"""


@pytest.fixture
def load(tmp_path):
    def load(kind, content=None):
        (tmp_path / f"car.{kind}").write_text(WRITERS[kind](MESSAGES) if content is None else content)
        (tmp_path / "signals.toml").write_text(f'dbc = ["car.{kind}"]\n{MAP}')
        return load_signal_map(tmp_path / "signals.toml")

    return load


@pytest.mark.parametrize("kind", ["kcd", "arxml"])
def test_every_kind_of_database_gives_the_map_that_a_dbc_gives(kind, load):
    assert load(kind).messages == load("dbc").messages
    assert load(kind).payload_width == 64


@pytest.mark.parametrize("kind", WRITERS)
def test_every_number_is_the_one_cantools_gives(kind, load, tmp_path):
    signal_map = load(kind)
    database = cantools.database.load_file(tmp_path / f"car.{kind}")
    rng = np.random.default_rng(5)
    n = 50
    for message, columns in (
        ("IMU", {Signal.VERTICAL_ACCELERATION: ("AccelZ", 1.0), Signal.PITCH_RATE: ("RateY", -np.pi / 180)}),
        ("GPS", {Signal.SPEED: ("Speed", 1 / 3.6)}),
    ):
        asked = database.get_message_by_name(message)
        payload = np.zeros((n, 64), np.uint8)
        payload[:, :8] = rng.integers(0, 256, (n, 8))
        can_id = np.full(n, asked.frame_id | (EXTENDED_ID if asked.is_extended_frame else 0), np.uint32)
        motion = Decoder(signal_map).decode(Frames(np.arange(n), can_id, np.full(n, 8, np.uint8), payload))
        decoded = [asked.decode(row[:8].tobytes(), decode_choices=False) for row in payload]
        for signal, (name, to_si) in columns.items():
            ours = motion.columns[:, signal_map.signals.index(signal)]
            truth = np.array([float(each[name]) for each in decoded]) * to_si
            kept = np.isfinite(ours)
            np.testing.assert_allclose(ours[kept], truth[kept], rtol=1e-12)
            assert 0 < np.count_nonzero(kept) <= n
            is_valid = np.array([each.get("Valid", 1) == 1 for each in decoded]) | (
                signal is not Signal.VERTICAL_ACCELERATION
            )
            limit = 300 / 3.6 if signal is Signal.SPEED else 30 * abs(to_si)
            np.testing.assert_array_equal(kept, is_valid & (np.abs(truth) <= limit + 1e-9))


@pytest.mark.parametrize("kind", ["kcd", "arxml"])
def test_a_database_that_is_cut_off_is_refused_by_name(kind, load):
    whole = WRITERS[kind](MESSAGES)
    with pytest.raises(SignalMapError, match=rf"car\.{kind}"):
        load(kind, whole[: len(whole) // 2])


def test_the_same_message_on_two_buses_of_one_file_is_told(load):
    twice = [*MESSAGES, replace(MESSAGES[0], can_id=0x121)]
    with pytest.raises(SignalMapError, match=r"message 'IMU' is twice in car\.dbc"):
        load("dbc", dbc(twice))


def test_an_arxml_without_a_bus_says_that_it_has_no_message(load):
    empty = arxml(())
    with pytest.raises(SignalMapError, match="no message 'IMU'"):
        load("arxml", empty)
