"""What is written is read back, by us and by python-can; how a log is cut into blocks leaves no trace."""

import gzip
import tempfile
from pathlib import Path

import can
import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from support.encoded import frames_of

from gateway.bus.frames import join, message_id, stamp_to_ns
from gateway.bus.logs import LogReport, write_candump
from gateway.bus.logs.candump import _Finder, read_candump
from gateway.bus.logs.candump_line import read_line
from gateway.bus.logs.log_report import LogReject, Selection
from gateway.bus.signals.mapping import EVERY_IDENTIFIER, exact_filter
from gateway.records import EXTENDED_ID, Frames

identifiers = st.one_of(st.integers(0, 0x7FF), st.integers(0, 0x1FFF_FFFF).map(lambda i: i | EXTENDED_ID))
payloads = st.one_of(
    st.binary(max_size=8), st.sampled_from([12, 16, 20, 24, 32, 48, 64]).map(lambda n: bytes(range(n)))
)
frame_rows = st.tuples(st.integers(0, 9_223_372_035 * 10**9), identifiers, payloads)


def read(path, block_bytes=1 << 16):
    report = LogReport(path)
    chunks = read_candump(Selection(report, EVERY_IDENTIFIER, None, 64), block_bytes)
    return join(list(chunks), 64), report


def assert_equal(a: Frames, b: Frames) -> None:
    for name in ("t_ns", "can_id", "length", "payload"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


@given(st.lists(frame_rows, max_size=40), st.booleans(), st.integers(256, 2000))
def test_what_is_written_is_read_back_to_the_nanosecond(rows, is_gzip, block_bytes):
    frames = frames_of(rows, 64)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / ("a.log.gz" if is_gzip else "a.log")
        write_candump(frames, "vcan0", path)
        found, report = read(path, block_bytes)
    assert_equal(found, frames)
    assert (report.lines, report.frames, report.n_rejected) == (len(rows), len(rows), 0)


@given(st.lists(frame_rows, min_size=1, max_size=20))
def test_what_is_written_python_can_reads_as_well(rows):
    frames = frames_of(rows, 64)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.log"
        write_candump(frames, "vcan0", path)
        with can.CanutilsLogReader(path) as reader:
            messages = list(reader)
    for (t_ns, can_id, payload), message in zip(rows, messages, strict=True):
        assert abs(message.timestamp - t_ns / 1e9) <= 1e-6 * max(1.0, t_ns / 1e15)
        assert message.arbitration_id == can_id & 0x1FFF_FFFF
        assert message.is_extended_id == bool(can_id & EXTENDED_ID)
        assert bytes(message.data) == payload
        assert message.is_fd == (len(payload) > 8)


def text_line(t_us, n_decimals, channel, identifier, mark, payload, tail):
    fraction = t_us % 10**6 * 10 ** (n_decimals - 6)
    stamp = f"({t_us // 10**6}.{fraction:0{n_decimals}d})"
    return f"{stamp} {channel} {identifier}#{mark}{payload.hex()}{tail}".encode()


LINES = st.one_of(
    st.builds(
        text_line,
        st.integers(0, 10**10),
        st.sampled_from([6, 9]),
        st.sampled_from(["can0", "can1", "vcan12"]),
        st.sampled_from(["120", "7E8", "18FEF100", "00000120", "20000004"]),
        st.sampled_from(["", "#1", "R", "0"]),
        st.binary(max_size=9),
        st.sampled_from(["", " R", "\r", "  ", "x"]),
    ),
    st.binary(max_size=60).map(lambda noise: noise.replace(b"\n", b"")),
    st.just(b"(1627274455.012500) can0 120#0011223344556677"),
)


@settings(max_examples=200)
@given(st.lists(LINES, max_size=40), st.integers(300, 3000), st.booleans())
def test_the_fast_path_reads_what_the_exact_path_reads(lines, block_bytes, has_final_newline):
    """Any mixture of sound and dirty lines: whatever shapes were learned, each line is read as if alone."""
    text = b"\n".join(lines) + (b"\n" if has_final_newline else b"")
    assume(not text.startswith(b"\x1f\x8b"))  # what begins so is read as gzip
    filters = (exact_filter(0x120), exact_filter(0x18FEF100 | EXTENDED_ID))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.log"
        path.write_bytes(gzip.compress(text) if block_bytes % 2 else text)
        found = join(list(read_candump(Selection(LogReport(path), filters, "can0", 64), block_bytes)), 64)
    rows = [row for line in text.split(b"\n") if (row := read_alone(line, filters))]
    assert_equal(found, frames_of(rows, 64))


def read_alone(line: bytes, filters):
    frame = read_line(line)
    if isinstance(frame, LogReject) or frame.channel != "can0" or frame.is_error_frame or frame.is_remote_frame:
        return None
    is_wanted = any(f.is_for(message_id(frame)) for f in filters)
    return (stamp_to_ns(frame.timestamp), message_id(frame), bytes(frame.data)) if is_wanted else None


@given(st.lists(st.text("#0\n", max_size=40).map(str.encode), min_size=1, max_size=4))
def test_a_mark_is_every_first_of_a_row_of_marks(texts):
    """One finder for texts of any length, one after the other: what it noted of one leaves no trace in the next."""
    finder = _Finder()
    for text in texts:
        found = finder.marks(np.frombuffer(text, np.uint8))
        assert found.tolist() == [i for i, byte in enumerate(text) if byte == 35 and (i == 0 or text[i - 1] != 35)]
        assert np.count_nonzero(finder.are(np.frombuffer(text, np.uint8), "\n")) == text.count(b"\n")
