"""Signal maps: what they resolve to, and that every fault names the file, the key and the way out."""

import math

import numpy as np
import pytest

from gateway.bus.signals import load_signal_map
from gateway.errors import SignalMapError
from gateway.records import EXTENDED_ID

DBC = """VERSION ""
NS_ :
BS_:
BU_: A
BO_ 256 IMU: 8 A
 SG_ AccelZ : 0|16@1- (0.01,0) [-20|30] "m/s^2" A
 SG_ Rate : 16|16@1- (0.5,0) [0|0] "deg/s" A
 SG_ Odd : 32|16@1- (1,0) [0|0] "furlong" A
 SG_ Status : 48|2@1+ (1,0) [0|3] "" A
BO_ 2566844926 GROUP: 8 A
 SG_ Speed : 8|16@1+ (0.00390625,0) [0|250.99609375] "km/h" A
BO_ 2565799679 ADDRESSED: 8 A
 SG_ Speed : 8|16@1+ (0.00390625,0) [0|250.99609375] "km/h" A
BO_ 2566844672 GROUP_AGAIN: 8 A
 SG_ Speed : 24|16@1+ (0.00390625,0) [0|250.99609375] "km/h" A
BO_ 257 SHORT: 2 A
 SG_ TooFar : 8|16@1- (1,0) [0|0] "g" A
 SG_ Flat : 0|8@1- (0,0) [0|0] "g" A
BO_ 258 WIDE: 8 A
 SG_ Huge : 0|64@1+ (1,0) [0|0] "" A
VAL_ 256 Status 0 "off" 1 "starting" 2 "ready" ;
"""
ACCEL = '[signals.vertical_acceleration]\nmessage = "IMU"\nsignal = "AccelZ"\n'
RATE = '[signals.pitch_rate]\nmessage = "IMU"\nsignal = "Rate"\n'
SPEED = '[signals.speed]\nmessage = "GROUP"\nsignal = "Speed"\n'


@pytest.fixture
def write_map(tmp_path):
    (tmp_path / "car.dbc").write_text(DBC)

    def write(text, head='dbc = ["car.dbc"]\n'):
        path = tmp_path / "signals.toml"
        path.write_text(head + text)
        return path

    return write


def only_signal(signal_map):
    (message,) = signal_map.messages
    (mapped,) = message.signals
    return mapped


def test_units_and_sign_are_one_factor(write_map):
    assert only_signal(load_signal_map(write_map(RATE + "sign = -1\n"))).to_si == pytest.approx(-math.pi / 180)


def test_a_unit_in_the_map_overrides_the_databases(write_map):
    assert only_signal(load_signal_map(write_map(ACCEL + 'unit = "g"\n'))).to_si == 9.80665


RANGES = {  # (least, greatest) in SI
    "of the database, turned with the sign": (ACCEL + "sign = -1\n", (-30.0, 20.0)),
    "of the map before the database's": (ACCEL + "minimum = 5.0\n", (5.0, 30.0)),
    "of the bits, where the database states none": (RATE + 'unit = "rad/s"\n', (-16384.0, 16383.5)),
}


@pytest.mark.parametrize("kind", RANGES)
def test_the_valid_range_is(kind, write_map):
    text, expected = RANGES[kind]
    mapped = only_signal(load_signal_map(write_map(text)))
    assert (mapped.minimum, mapped.maximum) == expected


def test_conditions_are_given_by_number_name_or_list(write_map):
    conditions = [
        only_signal(load_signal_map(write_map(ACCEL + f"valid_when = {{ Status = {allowed} }}\n"))).valid_when
        for allowed in ("2", '"ready"', "[1, 2]")
    ]
    assert [condition.allowed_bits for (condition,) in conditions] == [(2,), (2,), (1, 2)]


X = EXTENDED_ID
MATCHED = {  # the map, and identifiers with whether each is one of its message
    "an identifier, whole": (SPEED, {0x18FEF1FE | X: True, 0x18FEF100 | X: False, 0x0CFEF1FE | X: False}),
    "a J1939 group of any priority and source": (
        "j1939 = true\n" + SPEED,
        {0x18FEF1FE | X: True, 0x0CFEF100 | X: True, 0x18FEF2FE | X: False, 0x19FEF1FE | X: False, 0x7F1: False},
    ),
    "an addressed J1939 group of any destination": (
        "j1939 = true\n" + SPEED.replace("GROUP", "ADDRESSED"),
        {0x18EEFFFF | X: True, 0x1CEE2103 | X: True, 0x18EFFFFF | X: False},
    ),
    "11 bits in a J1939 map, whole": ("j1939 = true\n" + ACCEL, {256: True, 257: False}),
}


@pytest.mark.parametrize("kind", MATCHED)
def test_a_map_matches(kind, write_map):
    text, expected = MATCHED[kind]
    (id_filter,) = load_signal_map(write_map(text)).filters
    assert id_filter.matches(np.array([*expected], np.uint32)).tolist() == [*expected.values()]


FAULTS = {
    "no such key": (ACCEL + "typo = 1\n", ["signals.vertical_acceleration.typo", "unknown key"]),
    "no such signal of ours": (
        ACCEL.replace("vertical_acceleration", "vertical_aceleration"),
        ["signals.vertical_aceleration: unknown key; did you mean vertical_acceleration?"],
    ),
    "nothing like a signal of ours": (ACCEL.replace("vertical_acceleration", "xyz"), ["signals.xyz: unknown key"]),
    "no message": (ACCEL.replace("IMU", "IMV"), ["vertical_acceleration.message", "'IMV'", "did you mean 'IMU'"]),
    "no signal": (ACCEL.replace("AccelZ", "AccelY"), ["'AccelY'", "did you mean 'AccelZ'"]),
    "unit unknown": (ACCEL.replace("AccelZ", "Odd"), ["vertical_acceleration.unit", "'furlong'", "m/s^2"]),
    "unit missing": (ACCEL.replace("AccelZ", "Status"), ["vertical_acceleration.unit", "no unit", "m/s^2"]),
    "sign not one": (ACCEL + "sign = 2\n", ["vertical_acceleration.sign", "it says 2"]),
    "latency negative": (ACCEL + "latency_s = -1.0\n", ["latency_s"]),
    "condition of no signal": (ACCEL + "valid_when = { Statu = 1 }\n", ["valid_when", "did you mean 'Status'"]),
    "condition never true": (ACCEL + "valid_when = { Status = 7 }\n", ["valid_when.Status", "never be 7"]),
    "condition of nothing": (ACCEL + "valid_when = { Status = [] }\n", ["valid_when.Status", "empty list"]),
    "condition of no number": (ACCEL + "valid_when = { Status = nan }\n", ["valid_when.Status", "never be nan"]),
    "condition without end": (ACCEL + "valid_when = { Status = inf }\n", ["valid_when.Status", "never be inf"]),
    "condition of no name": (ACCEL + 'valid_when = { Status = "redy" }\n', ["'redy'", "did you mean 'ready'"]),
    "range turned round": (ACCEL + "minimum = 99.0\n", ["minimum 99", "maximum 30"]),
    "beyond the message": ('[signals.speed]\nmessage = "SHORT"\nsignal = "TooFar"\n', ["byte 3", "has 2", "car.dbc"]),
    "scale zero": ('[signals.speed]\nmessage = "SHORT"\nsignal = "Flat"\n', ["scale 0", "car.dbc"]),
    "too wide": ('[signals.ignition]\nmessage = "WIDE"\nsignal = "Huge"\n', ["2^53"]),
    "no signals": ("signals = {}\n", ["signals"]),
    "broken TOML": ("[signals\n", ["not valid TOML", "line"]),
    "same frames twice": (
        "j1939 = true\n" + SPEED + '[signals.wheel_speed]\nmessage = "GROUP_AGAIN"\nsignal = "Speed"\n',
        ["'GROUP'", "'GROUP_AGAIN'", "same frames"],
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_every_fault_names_its_place_and_the_way_out(fault, write_map):
    text, expected = FAULTS[fault]
    path = write_map(text)
    with pytest.raises(SignalMapError) as raised:
        load_signal_map(path)
    assert str(path) in str(raised.value)
    for piece in expected:
        assert piece in str(raised.value)


def test_a_missing_map_is_named(tmp_path):
    with pytest.raises(SignalMapError, match=r"nowhere\.toml: no such file"):
        load_signal_map(tmp_path / "nowhere.toml")


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("lorry.dbc", r"signals\.toml: dbc: no such file: .*lorry\.dbc; paths are relative"),
        ("photo.dbc", r"photo\.dbc cannot be read as a CAN database"),
        ("photo.kcd", r"photo\.kcd: is no \.dbc; cantools convert photo\.kcd photo\.dbc"),
    ],
)
def test_a_database_that_is_missing_or_none_is_named(name, said, write_map, tmp_path):
    for photo in ("photo.dbc", "photo.kcd"):
        (tmp_path / photo).write_bytes(b"\xff\xd8\xff\xe0 no database")
    with pytest.raises(SignalMapError, match=said):
        load_signal_map(write_map(ACCEL, head=f'dbc = ["{name}"]\n'))


def test_a_message_in_two_databases_is_refused(write_map, tmp_path):
    (tmp_path / "copy.dbc").write_text(DBC)
    with pytest.raises(SignalMapError, match=r"'IMU' is in car\.dbc and in copy\.dbc"):
        load_signal_map(write_map(ACCEL, head='dbc = ["car.dbc", "copy.dbc"]\n'))


def test_an_unknown_shipped_map_names_those_there_are():
    with pytest.raises(SignalMapError, match=r"springscale:referenz: no such map; known are .*reference"):
        load_signal_map("springscale:referenz")
