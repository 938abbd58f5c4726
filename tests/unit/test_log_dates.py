"""Dates, zones and stamps of logs as recorders write them: each is read, or the log says what it lacks."""

import time
from datetime import UTC, datetime, timedelta
from pathlib import Path
from zoneinfo import ZoneInfo

import can
import pytest

from gateway.bus.frames import join
from gateway.bus.logs.log_report import LogReport
from gateway.bus.logs.open import open_log, open_whole_log
from gateway.bus.signals import load_signal_map
from gateway.errors import LogUnreadableError
from gateway.records import Frames

BERLIN = ZoneInfo("Europe/Berlin")
NOON = datetime(2023, 3, 10, 15, 6, 12, tzinfo=UTC)
ASC_FRAME = "   0.500000 1  123             Rx   d 2 01 02\n"


def read(path: Path, text: str | bytes, zone: ZoneInfo | None = None) -> tuple[Frames, LogReport]:
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    chunks, report = open_whole_log(path, zone=zone)
    return join(list(chunks), 64), report


def asc(date: str, *lines: str, base: str = "base hex  timestamps absolute\n") -> str:
    return f"date {date}\n{base}internal events logged\n" + "".join(lines or (ASC_FRAME,))


DATES = {
    "English, 12 hours": "Fri Mar 10 03:06:12.000 pm 2023",
    "24 hours and pm": "Fri Mar 10 15:06:12.000 pm 2023",
    "German": "Fre Mrz 10 15:06:12.000 2023",
    "German with umlaut": "Fre Mär 10 15:06:12.000 2023",
    "French": "ven. mars 10 15:06:12 2023",
    "Italian": "ven mar 10 15:06:12.000 2023",
    "Chinese": "周五 3月 10 下午 3:06:12 2023",
    "ISO": "2023-03-10T15:06:12",
    "ISO with a blank and a comma": "2023-03-10 15:06:12,000",
    "ISO with its zone": "2023-03-10T16:06:12+01:00",
    "German by numbers": "10.03.2023 15:06:12",
}
MONTHS = {"janv.": 1, "gen": 1, "ene": 1, "sty": 1, "1月": 1, "févr.": 2, "Mai": 5, "juin": 6, "juil.": 7, "ago": 8,
          "wrz": 9, "Okt": 10, "lis": 11, "Dez": 12, "déc.": 12}  # fmt: skip


@pytest.mark.parametrize("kind", DATES)
def test_the_date_of_an_asc_log_is_read_in_any_language(kind, tmp_path):
    frames, report = read(tmp_path / "a.asc", asc(DATES[kind]))
    assert frames.t_ns.tolist() == [round(NOON.timestamp() * 1e9) + 500_000_000]
    assert report.is_dated


@pytest.mark.parametrize("name", MONTHS)
def test_a_month_is_read_by_its_name(name, tmp_path):
    frames, _ = read(tmp_path / "a.asc", asc(f"xxx {name} 10 15:06:12 2023"))
    assert datetime.fromtimestamp(frames.t_ns[0] // 10**9, UTC) == NOON.replace(month=MONTHS[name])


def test_a_trc_of_version_1_0_has_the_date_of_its_remark(tmp_path):
    text = ";   Start time: 10.03.2023 15:06:12.000.0\n     1)      500 0123 2 01 02\n"
    frames, _ = read(tmp_path / "a.trc", text)
    assert frames.t_ns.tolist() == [round(NOON.timestamp() * 1e9) + 500_000_000]


@pytest.mark.parametrize("zone", ["America/New_York", "Europe/Berlin", "UTC"])
@pytest.mark.parametrize("suffix", [".asc", ".blf", ".trc"])
def test_the_stated_zone_holds_and_never_that_of_the_computer(suffix, zone, tmp_path, monkeypatch):
    monkeypatch.setenv("TZ", zone)
    time.tzset()
    path = tmp_path / f"a{suffix}"
    if suffix == ".blf":
        with can.BLFWriter(path) as writer:
            writer.on_message_received(can.Message(timestamp=NOON.timestamp(), arbitration_id=0x123, data=b"12"))
    elif suffix == ".asc":
        path.write_text(asc("Fri Mar 10 15:06:12.000 2023", ASC_FRAME.replace("0.5", "0.0")))
    else:
        days = (NOON.replace(tzinfo=None) - datetime(1899, 12, 30)) / timedelta(days=1)
        path.write_text(f";$FILEVERSION=1.1\n;$STARTTIME={days:.9f}\n     1)      0.0  Rx  0123  2  01 02\n")
    found = {}
    for stated in (None, BERLIN):
        chunks, report = open_whole_log(path, zone=stated)
        found[stated] = int(join(list(chunks), 64).t_ns[0])
        assert any("states no zone, it is read as UTC" in one for one in report.remarks()) == (stated is None)
    monkeypatch.undo()
    time.tzset()
    assert abs(found[None] - NOON.timestamp() * 1e9) < 1e6
    assert found[None] - found[BERLIN] == 3600 * 10**9


@pytest.mark.parametrize("line", ["-0.5 1 123 Rx d 1 01\n", "0,5 1 123 Rx d 1 01\n", "0.5 1 Engine Rx d 1 01\n"])
def test_frames_of_an_asc_log_that_cannot_be_read_are_counted_with_their_cause(line, tmp_path):
    _, report = read(tmp_path / "a.asc", asc("2023-03-10 15:06:12", ASC_FRAME, line, ASC_FRAME))
    assert (report.frames, report.wanted, report.n_rejected, report.other_identifiers) == (3, 2, 1, 0)
    assert any("line 5" in remark for remark in report.remarks())


def test_a_garbled_line_leaves_the_number_base_as_it_is(tmp_path):
    lines = ("0.5 1 10 Rx d 1 11\n", "0.6 1 zz Rx d 1 11\n", "0.7 1 10 Rx d 1 11\n")
    frames, _ = read(tmp_path / "a.asc", asc("2023-03-10 15:06:12", *lines, base="base dec  timestamps absolute\n"))
    assert frames.can_id.tolist() == [10, 10]


REFUSED = {
    "dates": ("a.log", "(2021-07-26 04:40:55.012500) can0 123#01\n", "line 1: stamps are dates"),
    "screen": ("a.log", " (1627274455.012500)  can0  123   [2]  01 02\n", "output for the screen"),
    "asc as log": ("a.log", asc("2023-03-10 15:06:12"), "name it so"),
    "a table": ("a.log", "Time Stamp,ID,Extended,Dir,Bus,LEN,D1\n1,123,0,Rx,0,1,01\n", "this is a table"),
    "remote frames": ("a.log", "(1627274455.0125) can0 123#R\n" * 3, r"only remote frames \(3\), which carry no data"),
    "remote frames in asc": ("a.asc", asc("2023-03-10 15:06:12", "0.5 1 123 Rx r 1\n"), r"only remote frames \(1\)"),
    "error frames": ("a.log", "(1627274455.0125) can0 20000004#0000000000000000\n", r"error frames only \(1\): check"),
    "error frames in asc": ("a.asc", asc("2023-03-10 15:06:12", "0.5 1 ErrorFrame\n"), r"error frames only \(1\)"),
    "UTF-16 without a mark": ("a.log", ("(1627274455.0125) can0 123#01\n" * 9).encode("utf-16-le"), "this is UTF-16"),
    "UTF-32": ("a.log", "(1627274455.0125) can0 123#01\n".encode("utf-32"), "UTF-32; save it as UTF-8"),
    "carriage returns": ("a.log", "(1627274455.0125) can0 123#01\r" * 9, "lines end in a carriage return alone"),
    "no-break spaces": ("a.log", "(1627274455.0125)\u00a0can0\u00a0123#01\n" * 9, "line 1: stamps are not seconds"),
    "identifiers with 0x": ("a.log", "(1627274455.0125) can0 0x123#01\n" * 9, "left out, garbled: 9"),
    "Wireshark": ("a.log", b"\xd4\xc3\xb2\xa1\2\0\4\0" + bytes(99), "a capture of Wireshark"),
    "bzip2": ("a.log", b"BZh91AY&SY" + bytes(99), "packed with bzip2"),
    "nothing": ("a.asc", "", "is empty"),
    "a header alone": ("a.asc", "date 2023-03-10 15:06:12\n", "holds no CAN frame$"),
    "trc 1.2": ("a.trc", ";$FILEVERSION=1.2\n     1)      0.0 1  Rx  0123  2  01 02\n", "version '1.2'"),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_a_log_whose_stamps_or_form_cannot_be_used_names_the_cause(kind, tmp_path):
    name, text, said = REFUSED[kind]
    with pytest.raises(LogUnreadableError, match=said) as refusal:
        read(tmp_path / name, text)[1].require_frames()
    assert "map of this vehicle" not in str(refusal.value)


@pytest.mark.parametrize(
    "kind", ["UTF-16 without a mark", "carriage returns", "no-break spaces", "identifiers with 0x"]
)
def test_lines_in_which_no_identifier_is_found_are_not_another_vehicles(kind, tmp_path):
    name, text, said = REFUSED[kind]
    (tmp_path / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    chunks, report = open_log(tmp_path / name, load_signal_map("springscale:reference"))
    assert list(chunks) == []
    with pytest.raises(LogUnreadableError, match=said):
        report.require_frames()


@pytest.mark.parametrize("line", [";$STARTTIMEX=abc\n", ";$COLUMNS=\n", ";$COLUMNS=X\n", ";$\n" * 50])
def test_a_header_of_a_trc_log_that_cannot_be_read_ends_no_reading(line, tmp_path):
    text = f";$FILEVERSION=2.1\n{line}     1 0.0 DT 1 0123 Rx - 2 01 02\n     2 1.0 DT 1 0123 Rx - 2 01 02\n"
    frames, report = read(tmp_path / "a.trc", text)
    assert len(frames) + report.n_rejected >= 2
    assert report.frames == report.wanted + report.n_rejected


@pytest.mark.parametrize("date", ["Thu Apr 31 10:00:00 2022", "Sun 9999999999999999999999999 29 05:25:06 2026"])
def test_an_impossible_date_is_none(date, tmp_path):
    frames, report = read(tmp_path / "a.asc", asc(date))
    assert (len(frames), report.is_dated) == (1, False)
    assert any(f"its date {date!r}" in remark for remark in report.remarks())
