"""The decoder and the encoder, its mirror: what becomes a sample, and that each rejection is counted."""

import struct

import cantools
import numpy as np
import pytest
from support.encoded import frames_of

from gateway.bus.signals import Decoder, Encoder, load_signal_map
from gateway.bus.signals.bit_field import BitField
from gateway.bus.signals.decode import Rejected, is_j1939_code
from gateway.records import EXTENDED_ID, Signal

G = 9.80665


def frames(*rows, width=8):
    """Rows of (can_id, payload) a millisecond apart."""
    return frames_of([(n * 1_000_000, *row) for n, row in enumerate(rows)], width)


def gps(speed_raw=5000, satellites=9, fix=3):
    return 0x130, struct.pack("<HBB", speed_raw, satellites, fix)


def accel(z_raw=9810, is_valid=1):
    return 0x120, struct.pack("<hhhBB", 0, 0, z_raw, 0, is_valid)


@pytest.fixture
def reference():
    return Decoder(load_signal_map("springscale:reference"))


@pytest.mark.parametrize(
    ("frame", "signal", "reason"),
    [
        ((0x130, b"\1\2\3"), Signal.SPEED, Rejected.WRONG_LENGTH),
        ((0x130, b"\1\2\3\3\0"), Signal.SPEED, Rejected.WRONG_LENGTH),
        ((0x130, b""), Signal.SPEED, Rejected.WRONG_LENGTH),
        (gps(fix=2), Signal.SPEED, Rejected.INVALID),
        (gps(speed_raw=65535, fix=0), Signal.SPEED, Rejected.INVALID),
        (accel(is_valid=0), Signal.VERTICAL_ACCELERATION, Rejected.INVALID),
    ],
)
def test_a_rejected_frame_stays_as_a_row_of_nan_and_is_counted(reference, frame, signal, reason):
    motion = reference.decode(frames(frame))
    assert np.isnan(motion.columns).all()
    assert len(motion) == 1
    assert reference.counts[signal].samples == 0
    assert reference.counts[signal].rejected == {reason: 1}


@pytest.fixture
def write_map(tmp_path):
    def write(dbc, toml):
        (tmp_path / "a.dbc").write_text('VERSION ""\nNS_ :\nBS_:\nBU_: A\n' + dbc)
        (tmp_path / "a.toml").write_text('dbc = ["a.dbc"]\n' + toml)
        return load_signal_map(tmp_path / "a.toml")

    return write


def test_out_of_the_databases_range_is_no_sample(write_map):
    signal_map = write_map(
        'BO_ 1 M: 2 A\n SG_ S : 0|16@1- (0.1,0) [-50|50] "m/s" A\n', '[signals.speed]\nmessage = "M"\nsignal = "S"\n'
    )
    decoder = Decoder(signal_map)
    motion = decoder.decode(frames(*((1, struct.pack("<h", raw)) for raw in (-501, -500, 500, 501))))
    np.testing.assert_array_equal(motion.columns[:, 0], [np.nan, -50.0, 50.0, np.nan])
    assert decoder.counts[Signal.SPEED].rejected == {Rejected.OUT_OF_RANGE: 2}


def test_a_float_that_is_no_number_is_no_sample():
    decoder = Decoder(load_signal_map("springscale:pcan_gps"))
    numbers = [struct.pack("<f", number) for number in (36.0, float("nan"), float("inf"), 1e9)]
    signalling_nan = struct.pack("<I", 0x7F800001)
    motion = decoder.decode(frames(*((0x621, bytes(4) + number) for number in (*numbers, signalling_nan))))
    np.testing.assert_array_equal(motion.of(Signal.SPEED)[1], [10.0])
    rejected = decoder.counts[Signal.SPEED].rejected
    assert rejected == {Rejected.NOT_A_NUMBER: 3, Rejected.OUT_OF_RANGE: 1}


@pytest.mark.parametrize(("raw", "is_sample"), [(0xFAFF, True), (0xFB00, False), (0xFE00, False), (0xFFFF, False)])
def test_a_j1939_code_never_becomes_a_number(raw, is_sample):
    decoder = Decoder(load_signal_map("springscale:j1939"))
    motion = decoder.decode(frames((0x0CF02D21 | EXTENDED_ID, struct.pack("<HHHH", 32000, 32000, raw, 0xFFFF))))
    assert np.isfinite(motion.of(Signal.VERTICAL_ACCELERATION)[1]).any() == is_sample
    expected = {} if is_sample else {Rejected.NOT_AVAILABLE: 1}
    assert decoder.counts[Signal.VERTICAL_ACCELERATION].rejected == expected


@pytest.mark.parametrize(
    ("length", "codes", "last_number"),
    [(1, [], 1), (2, [2, 3], 1), (4, [0xE, 0xF], 0xD), (8, [0xFB, 0xFE, 0xFF], 0xFA), (16, [0xFB00, 0xFFFF], 0xFAFF),
     (32, [0xFB000000, 0xFFFFFFFF], 0xFAFFFFFF)],
)  # fmt: skip
def test_j1939_codes_by_length(length, codes, last_number):
    field = BitField(0, length)
    assert is_j1939_code(field, np.array(codes, np.uint64)).all()
    assert not is_j1939_code(field, np.array([0, last_number], np.uint64)).any()


def test_a_trailer_of_a_j1939_group_is_two_bits_and_their_codes(write_map):
    signal_map = write_map(
        'BO_ 2566844926 M: 8 A\n SG_ S : 0|2@1+ (1,0) [0|3] "" A\n',
        'j1939 = true\n[signals.trailer]\nmessage = "M"\nsignal = "S"\n',
    )
    motion = Decoder(signal_map).decode(frames(*((0x98FEF1C8, bytes([raw]) + bytes(7)) for raw in range(4))))
    np.testing.assert_array_equal(motion.columns[:, 0], [0.0, 1.0, np.nan, np.nan])
    assert motion.aside.all()


def test_a_signed_signal_of_a_j1939_map_keeps_its_negative_numbers(write_map):
    signal_map = write_map(
        'BO_ 2566844926 M: 8 A\n SG_ S : 0|16@1- (0.01,0) [0|0] "m/s" A\n',
        'j1939 = true\n[signals.speed]\nmessage = "M"\nsignal = "S"\n',
    )
    motion = Decoder(signal_map).decode(frames((0x98FEF1FE, struct.pack("<hhhh", -1, 0, 0, 0))))
    assert motion.columns[0, 0] == -0.01


MULTIPLEXED = """BO_ 5 M: 8 A
 SG_ Page m1M : 8|4@1+ (1,0) [0|15] "" A
 SG_ Bank M : 0|4@1+ (1,0) [0|15] "" A
 SG_ Speed m2 : 16|16@1+ (0.01,0) [0|0] "m/s" A
 SG_MUL_VAL_ 5 Page Bank 1-1;
"""


def test_a_signal_exists_only_under_its_multiplexers_as_cantools_sees_it(write_map, tmp_path):
    dbc = MULTIPLEXED.replace(" SG_MUL", "SG_MUL") + "SG_MUL_VAL_ 5 Speed Page 2-3, 7-7;\n"
    signal_map = write_map(dbc, '[signals.speed]\nmessage = "M"\nsignal = "Speed"\n')
    payloads = [bytes([bank, page, 100, 0, 0, 0, 0, 0]) for bank in (0, 1) for page in range(10)]
    message = cantools.database.load_file(tmp_path / "a.dbc").get_message_by_name("M")
    truth = []
    for payload in payloads:
        try:
            truth.append(message.decode(payload).get("Speed", np.nan))
        except cantools.database.DecodeError:
            truth.append(np.nan)
    decoder = Decoder(signal_map)
    motion = decoder.decode(frames(*((5, payload) for payload in payloads)))
    np.testing.assert_array_equal(motion.columns[:, 0], truth)
    assert np.isfinite(truth).sum() == 3
    assert decoder.counts[Signal.SPEED].rejected == {Rejected.MULTIPLEXED_OUT: 17}


def test_a_condition_under_another_multiplexer_is_no_condition_of_other_bits(write_map):
    """The bits of a status that is not in the frame are those of another signal."""
    signal_map = write_map(
        'BO_ 5 M: 8 A\n SG_ Page M : 0|8@1+ (1,0) [0|0] "" A\n SG_ Speed : 8|8@1+ (1,0) [0|0] "m/s" A\n'
        ' SG_ Valid m1 : 16|8@1+ (1,0) [0|0] "" A\n',
        '[signals.speed]\nmessage = "M"\nsignal = "Speed"\nvalid_when = { Valid = 1 }\n',
    )
    payloads = [bytes([page, 20, bits, 0, 0, 0, 0, 0]) for page in (0, 1) for bits in (0, 1)]
    decoder = Decoder(signal_map)
    motion = decoder.decode(frames(*((5, payload) for payload in payloads)))
    np.testing.assert_array_equal(motion.columns[:, 0], [np.nan, np.nan, np.nan, 20.0])
    assert decoder.counts[Signal.SPEED].rejected == {Rejected.INVALID: 3}


def test_can_fd_payloads_are_read_to_their_end_and_too_narrow_rows_are_a_wrong_length(write_map):
    signal_map = write_map(
        'BO_ 6 M: 48 A\n SG_ S : 368|16@1- (0.001,0) [0|0] "g" A\n',
        '[signals.vertical_acceleration]\nmessage = "M"\nsignal = "S"\n',
    )
    assert signal_map.payload_width == 64
    payload = bytes(46) + struct.pack("<h", 1000)
    decoder = Decoder(signal_map)
    assert decoder.decode(frames((6, payload), width=64)).columns[0, 0] == pytest.approx(G)
    assert np.isnan(decoder.decode(frames((6, bytes(8)))).columns).all()
    assert decoder.counts[Signal.VERTICAL_ACCELERATION].rejected == {Rejected.WRONG_LENGTH: 1}


def test_samples_beyond_the_bits_saturate():
    signal_map = load_signal_map("springscale:reference")
    frames = Encoder(signal_map).encode("IMU_ACCEL", np.arange(2), {"AccelZ": np.array([1e6, -1e6])})
    found = Decoder(signal_map).decode(frames).of(Signal.VERTICAL_ACCELERATION)[1]
    np.testing.assert_allclose(found, [32.767, -32.768])


def test_signals_not_given_are_zero_and_those_of_valid_when_are_valid():
    signal_map = load_signal_map("springscale:canmod_gps")
    frames = Encoder(signal_map).encode("CANMOD_IMU", np.arange(1), {"AccelerationZ": np.array([9.75])})
    motion = Decoder(signal_map).decode(frames)
    assert motion.of(Signal.VERTICAL_ACCELERATION)[1].tolist() == [9.75]
    assert motion.of(Signal.PITCH_RATE)[1].tolist() == [0.0]


def test_a_given_condition_overrides():
    signal_map = load_signal_map("springscale:canmod_gps")
    frames = Encoder(signal_map).encode("CANMOD_SPEED", np.arange(1), {"SpeedValid": np.zeros(1), "Speed": np.ones(1)})
    assert len(Decoder(signal_map).decode(frames).of(Signal.SPEED)[1]) == 0


def test_what_a_j1939_message_does_not_carry_is_not_available():
    signal_map = load_signal_map("springscale:j1939")
    frames = Encoder(signal_map).encode("ACCS", np.arange(1), {"VerticalAcceleration": np.array([9.81])})
    assert frames.payload[0].tolist() == [0xFF, 0xFF, 0xFF, 0xFF, 0xD5, 0x80, 0xFF, 0xFF]
