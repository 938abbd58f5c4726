"""Databases with faults: what is mapped must be sound, the rest is named, and absurd numbers are refused at once."""

import re
import resource
import time
from pathlib import Path

import cantools
import pytest
from support.commands import called
from support.paper_van import paper_van_config
from support.ports import free_port

from gateway.bus.signals import load_signal_map
from gateway.bus.signals.dbc import Databases
from gateway.bus.signals.signal_map import shipped_databases, unsound_messages
from gateway.errors import SignalMapError
from gateway.records import Signal

HEAD = 'VERSION ""\nNS_ :\n\tCM_\n\tBA_DEF_\n\tVAL_\n\tSG_MUL_VAL_\nBS_:\nBU_: A\n'
BOX = """BO_ 512 BOX: 8 A
 SG_ Accel : 0|16@1- (0.001,0) [-100|100] "m/s^2" A
 SG_ Ratio : 16|32@1- (1,0) [0|0] "" A
 SG_ State : 48|8@1+ (1,0) [0|0] "" A
 SG_ Spare : 56|8@1+ (1,0) [0|0] "" A
"""
OTHER = 'BO_ 513 OTHER: 8 A\n SG_ Good : 0|8@1+ (1,0) [0|0] "" A\n'
TAIL = """CM_ SG_ 512 Accel "up,
BO_ 512 OLD: 8 A
is how it began";
VAL_ 512 State 1 "ready" 2 "off" ;
SIG_VALTYPE_ 512 Ratio : 1;
"""
MAP = """dbc = ["a.dbc"]
[signals.vertical_acceleration]
message = "BOX"
signal = "Accel"
valid_when = { State = "ready" }
[signals.ignition]
message = "BOX"
signal = "Ratio"
"""


def write(folder: Path, dbc: str, signal_map: str = MAP) -> Path:
    (folder / "a.dbc").write_text(dbc)
    (folder / "a.toml").write_text(signal_map)
    return folder / "a.toml"


UNRELATED = {
    "a signal without receivers": ' SG_ Bad : 0|8@1+ (1,0) [0|0] ""\n',
    "a name with a hyphen": ' SG_ Ba-d : 0|8@1+ (1,0) [0|0] "" A\n',
    "a scale that is no number": ' SG_ Bad : 0|8@1+ (1.#INF,0) [0|0] "" A\n',
    "a unit without its end": ' SG_ Bad : 0|8@1+ (1,0) [0|0] "deg A\n SG_ Worse : 8|8@1+ (1,0) [0|0] "deg" A\n',
    "a wide range": ' SG_ X M : 0|32@1+ (1,0) [0|0] "" A\n SG_ Y m0 : 32|8@1+ (1,0) [0|0] "" A\n'
    "SG_MUL_VAL_ 513 Y X 0-4294967295;\n",
    "a billion bits": ' SG_ Bad : 0|1000000000@1+ (1,0) [0|0] "" A\n',
    "a place a billion bits away": ' SG_ Bad : 1000000000|8@1+ (1,0) [0|0] "" A\n',
    "an identifier of 33 bits": 'BO_ 4294967296 WIDE: 8 A\n SG_ S : 0|8@1+ (1,0) [0|0] "" A\n',
    "a message of a billion bytes": 'BO_ 514 LONG: 1000000000 A\n SG_ S : 0|8@1+ (1,0) [0|0] "" A\n',
    "a message of 400 digits": f"BO_ 514 LONG: {'9' * 400} A\n",
    "the type of no signal": "SIG_VALTYPE_ 513 Missing : 1;\n",
    "a type in another form": "SIG_VALTYPE_ 513, Good : 1;\n",
    "a line that means nothing": "what is this\n",
}
HARMLESS = {
    "names of values of no signal": 'VAL_ 513 Missing 1 "one" ;\nVAL_ 99 S 1 "one" ;\n',
    "a start value of 400 digits": 'BA_DEF_ SG_ "Start" INT 0 1;\n' + f'BA_ "Start" SG_ 513 Good {"9" * 400};\n',
    "an attribute that nobody defined": 'BA_ "Nobody" BO_ 513 7;\n',
    "a definition that cantools cannot read": 'BA_DEF_ BO_ "A" ENUM "a" "b";\n',
    "a comment without its end": 'CM_ BO_ 513 "left open;\n',
    "a comment that begins twice": 'CM_ BO_ 513 CM_ "one";\n',
    "a group without a name": "SIG_GROUP_ 513 : ;\n",
    "backslashes": r'CM_ BO_ 513 "a path C:\ and a \"quote\"";' + "\n",
    "no newline at the end": 'CM_ BO_ 513 "the end";',
    "CRLF within a comment": 'CM_ BO_ 513 "one\r\ntwo";\r\n',
}


@pytest.mark.parametrize("kind", [*UNRELATED, *HARMLESS])
@pytest.mark.parametrize("place", ["before", "behind"])
def test_a_fault_elsewhere_does_not_affect_mapped_signals(kind: str, place: str, tmp_path: Path) -> None:
    sound = load_signal_map(write(tmp_path, HEAD + BOX + OTHER + TAIL))
    other = OTHER + {**UNRELATED, **HARMLESS}[kind]
    text = HEAD + (other + BOX + TAIL if place == "before" else BOX + TAIL + other)
    path = write(tmp_path, text)
    found = load_signal_map(path)
    assert found.messages == sound.messages
    assert found.traits[Signal.VERTICAL_ACCELERATION].maximum == 100.0
    unsound = unsound_messages(path)
    assert len(unsound) == (1 if kind in UNRELATED else 0), unsound
    for fault in unsound:
        assert f"{tmp_path / 'a.dbc'}: message " in fault
        line = int(fault.partition(" in line ")[2].partition(" ")[0])
        assert text.splitlines()[line - 1].startswith("BO_")


HUGE = "9" * 400
MAPPED = {
    "a signal without receivers": ("State : 48|8@1+ (1,0) [0|0] \"\" A", "State : 48|8@1+ (1,0) [0|0] \"\"", "syntax"),
    "a type without its colon": ("Ratio : 1;", "Ratio 1;", "syntax"),
    "a type of a misspelt signal": ("Ratio : 1;", "Ration : 1;", "unused SIG_VALTYPE_ entries"),
    "a type in another form": ("SIG_VALTYPE_ 512", "SIG_VALTYPE_ BOX", "syntax"),
    "a name of a value that is no number": ("VAL_ 512 State 1", "VAL_ 512 State x", "syntax"),
    "a billion bits": ("48|8@", "48|1000000000@", "'State' is longer than any message"),
    "33 bits": ("BO_ 512 BOX", "BO_ 4294967296 BOX", "no identifier"),
    "65 bytes": ("BO_ 512 BOX: 8", "BO_ 512 BOX: 65", "'BOX', which has 65 bytes"),
    "a place before the first bit": ("State : 48|", "State : -1|", "'State' begins at bit -1"),
    "an infinite scale": ("16@1- (0.001,0)", "16@1- (1e999,0)", "'Accel' has scale inf and offset"),
    "a scale of 400 digits": ("16@1- (0.001,0)", f"16@1- ({HUGE},0)", "'Accel' has scale inf and offset"),
    "a place of 400 digits": ("State : 48|", f"State : {HUGE}|", "'State' is longer than any message"),
    "an infinite offset": ("16@1- (0.001,0)", "16@1- (1,-1e999)", "'Accel' has scale .* and offset -inf"),
    "the same name twice": (OTHER, OTHER.replace("OTHER", "BOX"), "'BOX' is twice in a.dbc"),
    "29 bits without the mark": ("BO_ 512 BOX", "BO_ 274923520 BOX", "a DBC writes one of 29 bits as 2422407168"),
    "names of values without their end": ('"off" ;', '"off"', "'VAL_ 512 State .*' does not end with a semicolon"),
    "a wide range": (
        TAIL, f"{TAIL}SG_MUL_VAL_ 512 Accel State 0-65536;\n", "more than 65,536 multiplexer values"
    ),
    "ranges whose product is wide": (
        TAIL,
        f"{TAIL}SG_MUL_VAL_ 512 Accel State 0-999;\nSG_MUL_VAL_ 512 State Ratio 0-999;\n",
        "more than 65,536 multiplexer values",
    ),
    "a multiplexer of itself": (
        BOX + OTHER + TAIL,
        BOX.replace("Accel :", "Accel m0M :").replace("State :", "State m0M :") + OTHER + TAIL
        + "SG_MUL_VAL_ 512 Accel State 0-1;\nSG_MUL_VAL_ 512 State Accel 0-1;\n",
        "'Accel' selects itself",
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", MAPPED)
def test_a_fault_of_a_mapped_message_is_refused_with_its_place(kind: str, tmp_path: Path) -> None:
    old, new, said = MAPPED[kind]
    text = HEAD + BOX + OTHER + TAIL
    assert old in text
    with pytest.raises(SignalMapError, match=said) as refusal:
        load_signal_map(write(tmp_path, text.replace(old, new)))
    assert str(refusal.value).startswith(f"{tmp_path / 'a.toml'}: ")
    assert re.search(r"line 9|twice|itself|correct a\.dbc", str(refusal.value))


SOUND = HEAD + BOX + TAIL + 'CM_ "the rest is of no message";\n'
HARD = {
    "blank lines": "\n" * 500_000,
    "a line of a million letters": " SG_ " + "a" * 1_000_000,
    "an endless start": OTHER + " SG_ Q : " + "1" * 300_000,
    "endless zeros": OTHER + " SG_ Q : 0 | " + "0" * 300_000,
    "colons": OTHER + " SG_ Q : " + " : " * 100_000,
    "an endless line of names": OTHER + " SG_ " + "a " * 100_000,
    "tabs": OTHER + "\n".join(["\t" * 1000] * 300) + "x",
    "an open text": OTHER + 'CM_ "' + "a" * 300_000,
    "a long name without a colon": "BO_ 7 " + "a" * 1_000_000,
    "quotes that escape": 'CM_ "' + '\\"\n' * 200_000,
    "quotes": '"' * 1_000_001,
    "slashes": "/" * 1_000_000,
    "digits": f"SG_MUL_VAL_ 513 A B {'1' * 200_000};\n",
    "numbers too long for an integer": f'VAL_ {"5" * 10_000} S 1 "x" ;\nBO_ {"5" * 10_000} M: 8 A\n',
    "hundreds of multiplexers": "".join(
        f"SG_MUL_VAL_ 513 S{i} S{j} 1-1;\n" for i in range(300) for j in range(i - 2, i)
    )
    + OTHER
    + "".join(f' SG_ S{i} m1M : 0|8@1+ (1,0) [0|0] "" A\n' for i in range(300)),
    "a hundred thousand messages": "".join(f"BO_ {1000 + i} M{i}: 8 A\n" for i in range(100_000)),
}


@pytest.mark.parametrize("kind", HARD)
def test_a_text_made_to_take_long_takes_seconds_and_little_memory(kind: str, tmp_path: Path) -> None:
    path = write(tmp_path, SOUND + HARD[kind])
    before, begun_s = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time()
    assert Signal.VERTICAL_ACCELERATION in load_signal_map(path).signals
    assert time.process_time() - begun_s < 10.0
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000  # kilobytes


def test_the_widest_ranges_that_are_read_take_seconds(tmp_path: Path) -> None:
    text = HEAD + BOX.replace("State :", "State M :").replace("Accel :", "Accel m0 :") + TAIL
    begun_s = time.process_time()
    path = write(
        tmp_path, text + "SG_MUL_VAL_ 512 Accel State 0-65535;\n", MAP.replace('valid_when = { State = "ready" }', "")
    )
    signal_map = load_signal_map(path)
    assert time.process_time() - begun_s < 20.0
    (mapped,) = (one for one in signal_map.messages[0].signals if one.signal is Signal.VERTICAL_ACCELERATION)
    assert len(mapped.multiplexed_by[0].allowed_bits) == 65_536


LONG_NAMES = """BA_DEF_ BO_ "SystemMessageLongSymbol" STRING ;
BA_DEF_ SG_ "SystemSignalLongSymbol" STRING ;
BA_DEF_DEF_ "SystemMessageLongSymbol" "";
BA_DEF_DEF_ "SystemSignalLongSymbol" "";
BA_ "SystemMessageLongSymbol" BO_ 512 "A_BOX_WHOSE_NAME_HAS_MORE_THAN_32_LETTERS";
BA_ "SystemSignalLongSymbol" SG_ 512 Accel "An_acceleration_whose_name_has_more_than_32_letters";
"""
AS_CANTOOLS = {
    "a plain one": HEAD + BOX + OTHER + TAIL,
    "long names": HEAD + BOX + OTHER + TAIL + LONG_NAMES,
    "signals in one line": HEAD + BOX.replace("\n SG_", " SG_") + TAIL,
    "multiplexers": HEAD
    + 'BO_ 5 M: 8 A\n SG_ Page m1M : 8|4@1+ (1,0) [0|15] "" A\n SG_ Bank M : 0|4@1+ (1,0) [0|15] "" A\n'
    + ' SG_ Speed m2 : 16|16@1+ (0.01,0) [0|0] "m/s" A\n'
    + "SG_MUL_VAL_ 5 Page Bank 1-1;\nSG_MUL_VAL_ 5 Speed Page 2-3, 7-7;\n",
    **{path.stem: path.read_text() for path in shipped_databases()},
}  # fmt: skip


@pytest.mark.parametrize("kind", AS_CANTOOLS)
def test_reading_a_database_by_message_agrees_with_cantools(kind: str, tmp_path: Path) -> None:
    (tmp_path / "a.dbc").write_text(AS_CANTOOLS[kind])
    found, unsound = Databases(tmp_path, [tmp_path / "a.dbc"]).sound()
    assert unsound == []
    at_once = cantools.database.load_string(AS_CANTOOLS[kind], "dbc").messages
    for message, expected in zip(found, at_once, strict=True):
        assert (message.name, message.frame_id & 0x1FFF_FFFF) == (expected.name, expected.frame_id)
        assert list(message.signals) == [signal.name for signal in expected.signals]
        for signal, theirs in zip(message.signals.values(), expected.signals, strict=True):
            assert (signal.field.start, signal.field.length, signal.unit) == (theirs.start, theirs.length, theirs.unit)
            assert (str(signal.field.coding) == "float") == theirs.is_float
            if theirs.minimum is not None and theirs.minimum < theirs.maximum:
                assert signal.limits == (theirs.minimum, theirs.maximum)
            assert signal.multiplexer == theirs.multiplexer_signal
            assert list(signal.multiplexer_ids) == (theirs.multiplexer_ids or [])
            assert sum(map(len, signal.choices.values())) == len(theirs.conversion.choices or {})


def test_check_config_and_look_name_ignored_parts_of_a_database(tmp_path: Path) -> None:
    write(tmp_path, HEAD + BOX + OTHER + UNRELATED["a billion bits"] + TAIL)
    for name, message, signal in (("pitch_rate", "BOX", "State"), ("speed", "BOX", "Spare")):
        unit = {"pitch_rate": "rad/s", "speed": "m/s"}[name]
        text = f'[signals.{name}]\nmessage = "{message}"\nsignal = "{signal}"\nunit = "{unit}"\n'
        (tmp_path / "a.toml").write_text((tmp_path / "a.toml").read_text() + text)
    config = paper_van_config(tmp_path, free_port())
    config.write_text(config.read_text().replace("springscale:reference", str(tmp_path / "a.toml")))
    said = called("check-config", config)
    assert said.exit_code == 0, said.output
    assert "Left out, as the signal map does not use it: " in said.stdout
    assert "message 'OTHER' in line 14 cannot be read: signal 'Bad' is longer than any message" in said.stdout
    (tmp_path / "a.log").write_text("".join(f"(1790000000.{i:06d}) can0 200#0011223344556677\n" for i in range(100)))
    assert "message 'OTHER' in line 14 cannot be read" in called("look", tmp_path / "a.log").stdout
    many = "".join(f"BO_ {600 + i} MORE{i}: 8 A\n{UNRELATED['a billion bits']}" for i in range(30))
    write(tmp_path, (tmp_path / "a.dbc").read_text() + many, (tmp_path / "a.toml").read_text())
    for said in (called("look", tmp_path / "a.log"), called("check-config", config)):
        assert said.stdout.count("cannot be read") == 10
        assert "and 21 more" in said.stdout
