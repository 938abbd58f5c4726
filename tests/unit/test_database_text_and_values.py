"""Databases as their tools write them: their text, names that occur twice, and values that have names."""

import codecs

import numpy as np
import pytest

from gateway.bus.logs.open import motion_of_log
from gateway.bus.signals import Decoder, load_signal_map
from gateway.errors import SignalMapError
from gateway.records import Frames, Signal

DBC = """VERSION ""
NS_ :
BS_:
BU_: A
BO_ 512 BOX: 8 A
 SG_ Accel : 0|16@1- (0.001,0) [-100|100] "m/s^2" A
 SG_ Rate : 16|16@1- (0.01,0) [0|0] "°/s" A
 SG_ Twin : 32|8@1+ (1,0) [0|0] "m/s" A
 SG_ Twin : 40|8@1+ (1,0) [0|0] "m/s" A
 SG_ State : 48|8@1+ (1,0) [0|0] "" A
VAL_ 512 Accel 32766 "Error" -32768 "SNA" ;
VAL_ 512 State 1 "ready" 3 "ready" 2 "off" ;
"""
MAP = """dbc = ["a.dbc"]
[signals.vertical_acceleration]
message = "BOX"
signal = "Accel"
valid_when = { State = "ready" }
[signals.pitch_rate]
message = "BOX"
signal = "Rate"
"""


def decoded(tmp_path, raw_accel, state):
    (tmp_path / "a.dbc").write_bytes(DBC.encode())
    (tmp_path / "a.toml").write_text(MAP)
    payload = np.zeros((1, 8), np.uint8)
    payload[0, :2] = np.frombuffer(np.int16(raw_accel).tobytes(), np.uint8)
    payload[0, 6] = state
    decoder = Decoder(load_signal_map(tmp_path / "a.toml"))
    frames = Frames(np.array([1]), np.array([512], np.uint32), np.array([8], np.uint8), payload)
    return decoder.decode(frames).of(Signal.VERTICAL_ACCELERATION)[1], decoder.counts[Signal.VERTICAL_ACCELERATION]


RAWS = range(8900, 9100)
TEXTS = {
    "UTF-8": DBC.encode(),
    "UTF-8 with a mark": codecs.BOM_UTF8 + DBC.encode(),
    "cp1252": DBC.encode("cp1252"),
    "cp1252 and UTF-8 in one file": DBC.encode() + 'CM_ "°";\n'.encode("cp1252"),
    "UTF-16": DBC.encode("utf-16"),
    "UTF-16 without a mark": DBC.encode("utf-16-be"),
    "UTF-16 of Windows without a mark": DBC.encode("utf-16-le"),
    "CRLF": DBC.replace("\n", "\r\n").encode(),
}


@pytest.mark.parametrize("kind", TEXTS)
@pytest.mark.parametrize("mark", [b"", codecs.BOM_UTF8])
def test_a_database_is_read_in_the_text_that_its_tool_writes(kind, mark, tmp_path):
    (tmp_path / "a.dbc").write_bytes(TEXTS[kind])
    (tmp_path / "a.toml").write_bytes(mark + MAP.encode())
    traits = load_signal_map(tmp_path / "a.toml").traits[Signal.PITCH_RATE]
    assert traits.resolution == pytest.approx(np.radians(0.01))


@pytest.mark.parametrize(("state", "n"), [(1, 1), (3, 1), (2, 0), (0, 0)])
def test_a_named_state_means_every_raw_value_of_the_name(state, n, tmp_path):
    assert len(decoded(tmp_path, 9810, state)[0]) == n


@pytest.mark.parametrize("raw", [32766, -32768])
def test_a_named_code_of_a_measured_signal_is_no_measurement(raw, tmp_path):
    samples, counts = decoded(tmp_path, raw, 1)
    assert (len(samples), dict(counts.rejected)) == (0, {"not_available": 1})


def test_a_database_that_names_every_raw_value_is_reported(tmp_path):
    """The samples were left out without a word, and the time stamps blamed."""
    names = " ".join(f'{raw} "{raw / 1000} m/s^2"' for raw in RAWS[150:])
    (tmp_path / "a.dbc").write_text(DBC + f"VAL_ 512 Accel {names} ;\n")
    (tmp_path / "a.toml").write_text(MAP)
    log = tmp_path / "a.log"
    lines = (f"({1_790_000_000 + raw / 100:.2f}) can0 200#{raw % 256:02X}{raw // 256:02X}000000000100" for raw in RAWS)
    log.write_text("\n".join(lines))
    motions, report = motion_of_log(log, load_signal_map(tmp_path / "a.toml"))
    assert sum(np.isfinite(motion.columns[:, 0]).sum() for motion in motions) == len(RAWS) - 50
    (remark,) = report.remarks()
    assert "vertical_acceleration (BOX): 50 of 200 raw values have a name in the database" in remark
    assert report.causes()


def test_messages_without_frames_are_reported(tmp_path):
    (tmp_path / "a.dbc").write_text(DBC + 'BO_ 2147484161 GYRO: 8 A\n SG_ Rate : 0|16@1- (1,0) [0|0] "dps" A\n')
    (tmp_path / "a.toml").write_text(MAP.replace('"BOX"\nsignal = "Rate"', '"GYRO"\nsignal = "Rate"'))
    (tmp_path / "a.log").write_text("(1790000000.5) can0 200#0000000000000100\n(1790000000.5) can0 201#00\n")
    motions, report = motion_of_log(tmp_path / "a.log", load_signal_map(tmp_path / "a.toml"))
    assert sum(map(len, (motion.t_ns for motion in motions))) == 1
    assert [*report.remarks()] == [f"{tmp_path / 'a.log'}: has no frame of GYRO (00000201) for pitch_rate"]


SPEED = 'SG_ Twin : 32|8@1+ (1,0) [0|0] "m/s" A'
WITHOUT_A_SAMPLE = {  # the line of the speed, its entry in the map, and what is said of its two frames of zeros
    "a condition": (SPEED, "valid_when = { State = 2 }", "2 do not meet valid_when"),
    "a multiplexer": (
        f'{SPEED.replace("Twin", "Twin m1")}\n SG_ Page M : 56|8@1+ (1,0) [0|0] "" A',
        "",
        "2 have other signals in its place (multiplexed)",
    ),
    "no number": (SPEED.replace("32|8@1+ (1", "0|32@1- (1"), "", "2 have no number"),
}


@pytest.mark.parametrize("kind", WITHOUT_A_SAMPLE)
def test_a_signal_of_which_no_frame_counts_is_reported(kind, tmp_path):
    line, more, said = WITHOUT_A_SAMPLE[kind]
    dbc = DBC.replace(SPEED, line).replace("Twin : 40", "Other : 40") + "SIG_VALTYPE_ 512 Twin : 1;\n" * (
        kind == "no number"
    )
    (tmp_path / "a.dbc").write_text(dbc)
    (tmp_path / "a.toml").write_text(f'{MAP}[signals.speed]\nmessage = "BOX"\nsignal = "Twin"\n{more}\n')
    frames = "(1790000000.5) can0 200#0000C07F00000100\n(1790000000.6) can0 200#0000C07F00000100\n"
    (tmp_path / "a.log").write_text(frames)
    motions, report = motion_of_log(tmp_path / "a.log", load_signal_map(tmp_path / "a.toml"))
    assert all(np.isnan(motion.of(Signal.SPEED)[1]).all() for motion in motions)
    (remark,) = report.remarks()
    assert remark == f"{tmp_path / 'a.log'}: has no sample of speed: of 2 frames of BOX (200), {said}"


def test_one_signal_measures_one_thing(tmp_path):
    (tmp_path / "a.dbc").write_text(DBC)
    (tmp_path / "a.toml").write_text(MAP + '[signals.roll_rate]\nmessage = "BOX"\nsignal = "Rate"\n')
    with pytest.raises(SignalMapError, match=r"signals\.roll_rate\.signal: 'Rate' is mapped as pitch_rate too"):
        load_signal_map(tmp_path / "a.toml")


@pytest.mark.parametrize("zone", ["localtime", "Factory", "Europe/Berlin ", "UTC+2", "../../etc/localtime"])
def test_a_zone_that_is_not_the_same_everywhere_is_refused(zone, tmp_path):
    (tmp_path / "a.dbc").write_text(DBC)
    (tmp_path / "a.toml").write_text(f'time_zone = "{zone}"\n{MAP}')
    with pytest.raises(SignalMapError, match=r"time_zone: .*; write one as Europe/Berlin, or UTC"):
        load_signal_map(tmp_path / "a.toml")


def test_a_signal_name_that_occurs_twice_is_refused_where_it_is_mapped(tmp_path):
    (tmp_path / "a.dbc").write_text(DBC)
    (tmp_path / "a.toml").write_text(MAP.replace('"Rate"', '"Twin"'))
    with pytest.raises(SignalMapError, match=r"pitch_rate\.signal: message 'BOX' has several signals 'Twin'"):
        load_signal_map(tmp_path / "a.toml")
