"""Databases, signal maps and logs of any content are read or refused in words: no traceback, no hang, little memory."""

import contextlib
from collections.abc import Callable
from pathlib import Path
from typing import Final

import can
import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from support.bus_drive import bus_drive
from support.spoiled import Change, changed, changes, limits, refusal_of

from gateway.bus.frames import message_of, take
from gateway.bus.logs import motion_of_log, open_whole_log, write_candump
from gateway.bus.logs.log_report import LogReport
from gateway.bus.signals import Decoder, load_signal_map, shipped_map
from gateway.bus.signals.dbc import Databases
from gateway.bus.signals.signal_map import unsound_messages
from gateway.cli.look import look_lines
from gateway.errors import ConfigurationError, LogUnreadableError, SignalMapError
from gateway.offline.look.log_look import Look
from gateway.records import Frames, json_line

N_FILES: Final = 500  # of each kind
many = settings(
    max_examples=N_FILES,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
REFERENCE: Final = shipped_map("reference")
DRIVE: Final = take(bus_drive(2.0, seed=3), slice(0, 200))
DATABASE: Final = (
    REFERENCE.with_name("springscale_reference.dbc").read_text()
    + """BO_ 700 MUX: 8 IMU
 SG_ Page m1M : 8|4@1+ (1,0) [0|15] "" GATEWAY
 SG_ Bank M : 0|4@1+ (1,0) [0|15] "" GATEWAY
 SG_ Value m2 : 32|32@1- (0.01,0) [0|0] "m/s" GATEWAY
SIG_VALTYPE_ 700 Value : 1;
SG_MUL_VAL_ 700 Page Bank 1-1;
SG_MUL_VAL_ 700 Value Page 2-3, 7-7;
BA_DEF_ SG_ "SystemSignalLongSymbol" STRING ;
BA_ "SystemSignalLongSymbol" SG_ 700 Value "Value_with_a_long_name";
"""
).encode()
MAP: Final = (
    REFERENCE.read_text() + '\n[signals.wheel_speed]\nmessage = "MUX"\nsignal = "Value_with_a_long_name"\n'
).encode()
DBC_WORDS: Final = [
    *b"BO_ SG_ VAL_ SIG_VALTYPE_ SG_MUL_VAL_ CM_ BA_ M m0 m1M @0- @1+ 0-4294967295 288 IMU_ACCEL AccelZ".split(),
    *(b"SystemMessageLongSymbol", b"VECTOR__INDEPENDENT_SIG_MSG", b";\nBO_ 288 X: 8 A\n"),
]
TOML_WORDS: Final = [
    *b'true [] {} [[1]] 1979-05-27 \'x\' "" """ \'../\' [\'IMU\',3] -1.0 +nan "\\ud800" [signals]'.split(),
    *(b"j1939 = true\n", b"time_zone = 'Mars'\n", b"channel = ''\n", b"unit = 'g'\n", b"minimum = 1e300\n"),
    *(b"source_address = 0x21\n", b"valid_when = { Fix = 'none' }\n", b"counter = 'Fix'\n"),
]


def decode(signal_map: Path) -> None:
    """The drive, and noise under every identifier of the map."""
    resolved = load_signal_map(signal_map)
    decoder = Decoder(resolved)
    decoder.decode(DRIVE)
    rng = np.random.default_rng(1)
    for message in resolved.messages:
        n, width = 20, resolved.payload_width
        payload = rng.integers(0, 256, (n, width)).astype(np.uint8)
        can_id = np.full(n, message.frame_id, np.uint32)
        decoder.decode(Frames(np.arange(n), can_id, np.full(n, message.length, np.uint8), payload))
    for remark in decoder.remarks():
        assert remark.text.isprintable()
    json_line({str(signal): counts.samples for signal, counts in decoder.counts.items()})


@many
@given(where=changes(DBC_WORDS))
@example(where=[(0, False, 1 << 20, b"")])
def test_a_dbc_of_any_content_is_read_or_refused_in_words(where: list[Change], tmp_path: Path) -> None:
    path = tmp_path / "springscale_reference.dbc"
    path.write_bytes(changed(DATABASE, where))
    (tmp_path / "signals.toml").write_bytes(MAP)
    refused = refusal_of(SignalMapError, lambda: decode(tmp_path / "signals.toml"))
    assert refused is None or refused.startswith(str(tmp_path / "signals.toml"))
    assert refusal_of(SignalMapError, lambda: read_whole(path)) is None or refused is not None


def read_whole(path: Path) -> None:
    """Every message of a database."""
    found, unsound = Databases(path, [path]).sound()
    assert len(unsound_messages(path.with_name("signals.toml"))) == len(unsound)
    assert all(str(path) in fault for fault in unsound)
    assert all(signal.limits for message in found for signal in message.signals.values())


@many
@given(where=changes(TOML_WORDS))
@example(where=[(0, False, 0, b"a = " + b"[" * 5000)])
@example(where=[(0, False, 0, b"a" + b".a" * 5000 + b" = 1\n")])
def test_a_signal_map_of_any_content_is_read_or_refused_in_words(where: list[Change], tmp_path: Path) -> None:
    (tmp_path / "springscale_reference.dbc").write_bytes(DATABASE)
    path = tmp_path / "signals.toml"
    path.write_bytes(changed(MAP, where))
    refused = refusal_of(ConfigurationError, lambda: decode(path))
    assert refused is None or (refused.startswith(str(path)) and len(refused) < 20_000)


def with_can(suffix: str) -> Callable[[Path], None]:
    """Write the drive by python-can."""

    def write(path: Path) -> None:
        with can.Logger(path.with_suffix(suffix)) as writer:
            for row in range(len(DRIVE)):
                writer.on_message_received(message_of(DRIVE, row))

    return write


def stored(path: Path) -> None:
    """A .blf whose containers are not compressed, so that changes reach its frames."""
    with can.BLFWriter(path, compression_level=0) as writer:
        for row in range(len(DRIVE)):
            writer.on_message_received(message_of(DRIVE, row))


def with_asammdf(path: Path) -> None:
    from support.mf4 import can_group, write_mf4

    start_ns = int(DRIVE.t_ns[0])
    write_mf4(path, start_ns, [can_group(DRIVE, start_ns)])


WRITERS: Final[dict[str, Callable[[Path], None]]] = {
    ".log": lambda path: write_candump(DRIVE, "can0", path),
    ".log.gz": lambda path: write_candump(DRIVE, "can0", path),
    **{suffix: with_can(suffix) for suffix in (".asc", ".trc", ".blf")},
    "_stored.blf": stored,
    ".mf4": with_asammdf,
}
LOG_WORDS: Final = [
    *b"(1790000000.0) (0.1) can0 120##1 120#R 20000004# CANFD Rx d date 0x120 -1.5 1.2E+09".split(),
    *b"ErrorFrame 31.02.2023".split(),
    *(b"base dec", b"base hex", b"timestamps relative", b"begin triggerblock", b"15:06 pm", b"120#" + b"00" * 65),
    *(b";$FILEVERSION=2.1\n", b";$STARTTIME=1e9\n", b";$COLUMNS=N,O,T\n"),
]


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], bytes]:
    """A sound log of every kind."""
    folder, kept = tmp_path_factory.mktemp("sound"), dict[str, bytes]()

    def content(kind: str) -> bytes:
        if kind not in kept:
            path = folder / f"drive{kind}"
            WRITERS[kind](path)
            kept[kind] = path.read_bytes()
        return kept[kind]

    return content


def require_all_counted(report: LogReport) -> None:
    """Frames in are frames given out and frames counted with their reasons."""
    assert report.other_identifiers >= 0, report
    assert report.frames >= report.wanted + report.other_channel + report.remote_frames + report.n_rejected
    assert all(isinstance(remark, str) for remark in report.remarks())
    assert "allocate" not in (report.ended_early or "")
    json_line(report.to_json())


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # asammdf leaves a bad file to be closed
@pytest.mark.parametrize("kind", WRITERS)
@many
@given(where=changes(LOG_WORDS))
def test_a_log_of_any_content_is_read_or_refused_in_words(
    kind: str, where: list[Change], sound: Callable[[str], bytes], tmp_path: Path
) -> None:
    path = tmp_path / f"drive{kind}"
    path.write_bytes(changed(sound(kind), where))
    refused = refusal_of(LogUnreadableError, lambda: read(path))
    assert refused is None or (refused.startswith(str(path)) and len(refused) < 2000)
    assert "allocate" not in (refused or "")


def read(path: Path) -> None:
    """Every frame, then those of the map."""
    chunks, report = open_whole_log(path)
    n_all = sum(map(len, chunks))
    require_all_counted(report)
    assert n_all == report.wanted
    assert report.other_identifiers == 0
    motions, report = motion_of_log(path, load_signal_map(REFERENCE))
    n_mapped = sum(map(len, motions))
    require_all_counted(report)
    assert n_mapped == report.wanted <= n_all
    report.require_frames()


ROWS: Final = {  # of a text log: what stands before its lines, between their cells, and a sound line
    ".trc": (";$FILEVERSION=1.1\n", "  ", "     1)      500.0  Rx  0123  2  01 02"),
}
WORDS: Final = (
    b'0 1 -1 1790000000.5 1) nan inf 1e400 0x123 FFFFFFFFFF AQI= = " 1,5 Rx DT 64 99999999999999999999'.split()
)
CELLS: Final = st.sampled_from([word.decode() for word in WORDS]) | st.text(
    st.characters(exclude_categories=["Cs", "Zl", "Zp"], exclude_characters="\r\n;"), max_size=8
)


@pytest.mark.parametrize("kind", ROWS)
@many
@given(rows=st.lists(st.none() | st.lists(CELLS, max_size=9), max_size=20), end=st.sampled_from(["\n", "\r\n"]))
def test_each_line_of_a_text_log_is_a_frame_or_counted(
    kind: str, rows: list[list[str] | None], end: str, tmp_path: Path
) -> None:
    """None is a sound line: none is lost, whatever stands before and behind it."""
    head, between, sound_line = ROWS[kind]
    lines = [sound_line if row is None else between.join(row) for row in rows]
    path = tmp_path / f"rows{kind}"
    path.write_bytes((head + end.join(lines) + end).encode())
    chunks, report = open_whole_log(path)
    n_given = sum(map(len, chunks))
    assert n_given >= rows.count(None)
    assert n_given + sum(report.left_out.values()) == sum(bool(line.strip()) for line in lines)
    require_all_counted(report)


@pytest.mark.parametrize("kind", [".log", ".asc"])
@settings(many, max_examples=30)
@given(where=changes(LOG_WORDS))
def test_look_shows_a_log_of_any_content_or_says_why_not(
    kind: str, where: list[Change], sound: Callable[[str], bytes], tmp_path: Path
) -> None:
    path = tmp_path / f"drive{kind}"
    path.write_bytes(changed(sound(kind), where))
    (tmp_path / "a.dbc").write_bytes(changed(DATABASE, where))
    with limits(), contextlib.suppress(LogUnreadableError):
        seen = Look(path)
        assert "".join(look_lines(seen, []))
        json_line(seen.to_json())
