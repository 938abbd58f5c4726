"""Dates, zones and stamps of logs as recorders write them: each is read, or the log says what it lacks."""

import gzip
import os
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
    "ISO with its zone after a blank": "2023-03-10 16:06:12 +0100",
    "ISO with the hours of its zone": "2023-03-10T10:06:12-05",
    "ISO and UTC": "2023-03-10 15:06:12 UTC",
    "ISO and 12 hours": "2023-03-10 03:06:12 PM",
    "German by numbers": "10.03.2023 15:06:12",
    "by numbers and 12 hours": "10.03.2023 03:06:12 pm",
}
NO_DATES = ("2023-03-10 15:06:12 CET", "10.03.23 15:06:12", "03/10/2023 15:06:12", "Fri Mar 10 24:00:00 2023",
            "Fri Mar 10 23:59:60 2023", "Fri Mar 10 15:06:12 1601", "Sun Jan 06 00:00:00 1980",
            "Fri Mar 10 15:06:12 2300")  # fmt: skip

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


def test_a_message_of_several_frames_is_no_lost_frame(tmp_path):
    line = "   0.6 1  J1939TP FEE3p        6    0  0   -   Rx   d 23 A0 0F A6 60 3B D1 40 1F DE 80 25 DF\n"
    _, report = read(tmp_path / "a.asc", asc("2023-03-10 15:06:12", ASC_FRAME, line))
    assert (report.wanted, report.n_rejected) == (1, 0)


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
    "asc as log": ("a.log", asc("2023-03-10 15:06:12"), "is not what its name says, but .* name it .asc$"),
    "asc as trc": ("a.trc", asc("2023-03-10 15:06:12"), "name it .asc$"),
    "trc as asc": ("a.asc", ";$FILEVERSION=1.1\n     1)  0.0  Rx  0123  1  01\n", "name it .trc$"),
    "candump as asc": ("a.asc", "(1627274455.0125) can0 123#01\n", "candump's text; name it .log$"),
    "candump as blf": ("a.blf", "(1627274455.0125) can0 123#01\n", "name it .log$"),
    "channels by name": ("a.asc", asc("2023-03-10 15:06:12", "0.5 CAN1 123 Rx d 1 11\n"), "channels have names"),
    "seconds without a point": ("a.log", "(1627274455) can0 123#01\n" * 9, "line 1: stamps are whole seconds"),
    "packed twice": ("a.log.gz", gzip.compress(gzip.compress(b"(1627274455.0125) can0 123#01\n")), "packed twice"),
    "cansend": ("a.log", "123#01\n" * 9, "line 1: no stamp in parentheses stands before the frame"),
    "a stamp alone": ("a.log", "1627274455.0125 can0 123#01\n" * 9, "line 1: no stamp in parentheses"),
    "screen with directions": ("a.log", " (1627274455.0125)  can0  RX - -  123   [1]  01\n", "output for the screen"),
    "garbled asc": ("a.asc", asc("2023-03-10 15:06:12", "0.5 1 zz Rx d 1 11\n"), "zz Rx d 1 11'$"),
    "a table": ("a.log", "Time Stamp,ID,Extended,Dir,Bus,LEN,D1\n1,123,0,Rx,0,1,01\n", "this is a table"),
    "remote frames": ("a.log", "(1627274455.0125) can0 123#R\n" * 3, r"only remote frames \(3\), which carry no data"),
    "remote frames in asc": ("a.asc", asc("2023-03-10 15:06:12", "0.5 1 123 Rx r 1\n"), r"only remote frames \(1\)"),
    "error frames": ("a.log", "(1627274455.0125) can0 20000004#0000000000000000\n", r"error frames only \(1\): check"),
    "error frames in asc": ("a.asc", asc("2023-03-10 15:06:12", "0.5 1 ErrorFrame\n"), r"error frames only \(1\)"),
    "UTF-16 without a mark": ("a.log", ("(1627274455.0125) can0 123#01\n" * 9).encode("utf-16-le"), "this is UTF-16"),
    "UTF-32": ("a.log", "(1627274455.0125) can0 123#01\n".encode("utf-32"), "UTF-32; save it as UTF-8"),
    "carriage returns": ("a.log", "(1627274455.0125) can0 123#01\r" * 9, "lines end in a carriage return alone"),
    "no-break spaces": ("a.log", "(1627274455.0125)\u00a0can0\u00a0123#01\n" * 9, "spaces are no-break spaces"),
    "identifiers with 0x": ("a.log", "(1627274455.0125) can0 0x123#01\n" * 9, "garbled: 9, .* begin with 0x: cut"),
    "whole seconds": ("a.log", "(1627274455) can0 123#01\n" * 9, "line 1: stamps are whole seconds"),
    "milliseconds": ("a.log", "(1627274455012) can0 123#01\n", "stamps are not seconds since 1970, but perhaps"),
    "names": ("a.asc", asc("2023-03-10 15:06:12", "0.5 1 SPEED Rx d 1 00\n"), "export the log with numbers: '[^;]*$"),
    "Wireshark": ("a.log", b"\xd4\xc3\xb2\xa1\2\0\4\0" + bytes(99), "a capture of Wireshark"),
    "bzip2": ("a.log", b"BZh91AY&SY" + bytes(99), "packed with bzip2"),
    "a web page": ("a.log", "<!DOCTYPE html>404", "is not what its name says, but a web page"),
    "Git LFS": ("a.blf", "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\n", "fetch the file itself"),
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


def test_a_pipe_is_not_said_to_be_empty(tmp_path):
    os.mkfifo(tmp_path / "a.log")
    with pytest.raises(LogUnreadableError, match="is a pipe or a device"):
        open_whole_log(tmp_path / "a.log")


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


TRC_LINES = {  # a status, an error frame and a frame, as PCAN-View writes them
    "1.0": ("     1)   17540  FFFFFFFF  4  00 00 00 08 -- -- -- -- BUSHEAVY\n", "", "     2)   17700  0100  1  2A\n"),
    "1.1": ("     1)  17540.3  Warng  FFFFFFFF  4  00 00 00 08  BUSHEAVY\n",
            "     2)  17541.3  Error  0008  4  00 19 08 08\n", "     3)  17700.3  Rx     0100  1  2A\n"),
    "1.3": ("     1)  17540.300 1  Warng FFFFFFFF -  4    00 00 00 08 BUSHEAVY\n",
            "     2)  17541.300 1  Error     0008 -  4    00 19 08 08\n", "     3)  17700.300 1  Rx  0100 -  1  2A\n"),
    "2.1": (";$COLUMNS=N,O,T,B,I,d,R,L,D\n  1  17540.300 ST 1     - Rx -  4    00 00 00 08\n",
            "  2  17541.300 ER 1     - Rx -  5    04 00 02 00 00\n", "  3  17700.300 DT 1  0100 Rx -  1    2A\n"),
}  # fmt: skip


@pytest.mark.parametrize("version", TRC_LINES)
def test_a_status_in_a_trc_is_no_lost_frame_and_an_error_frame_is_one(version, tmp_path):
    head = "" if version == "1.0" else f";$FILEVERSION={version}\n"
    frames, report = read(tmp_path / "a.trc", head + "".join(TRC_LINES[version]))
    assert (frames.can_id.tolist(), report.n_rejected) == ([0x100], 0)
    assert report.error_frames == (version != "1.0")


@pytest.mark.parametrize("line", [";$STARTTIMEX=abc\n", ";$COLUMNS=\n", ";$COLUMNS=X\n", ";$\n" * 50])
def test_a_header_of_a_trc_log_that_cannot_be_read_ends_no_reading(line, tmp_path):
    text = f";$FILEVERSION=2.1\n{line}     1 0.0 DT 1 0123 Rx - 2 01 02\n     2 1.0 DT 1 0123 Rx - 2 01 02\n"
    frames, report = read(tmp_path / "a.trc", text)
    assert len(frames) + report.n_rejected >= 2
    assert report.frames == report.wanted + report.n_rejected


@pytest.mark.parametrize("date", [*NO_DATES, "Thu Apr 31 10:00:00 2022", f"Sun {'9' * 25} 29 05:25:06 2026"])
def test_a_date_that_is_ambiguous_or_impossible_is_none(date, tmp_path):
    """It became a wrong one, or the stamps were blamed."""
    frames, report = read(tmp_path / "a.asc", asc(date))
    assert (frames.t_ns.tolist(), report.is_dated) == ([500_000_000], False)
    assert any(f"its date '{date}' cannot be " in remark for remark in report.remarks())


def test_of_many_bad_dates_a_few_are_told(tmp_path):
    lines = [f"date foo {number}\n{ASC_FRAME}" for number in range(1000)]
    frames, report = read(tmp_path / "a.asc", asc("2023-03-10 15:06:12", *lines))
    assert (len(frames), len(list(report.remarks()))) == (1000, 9)  # with the zone


def test_an_impossible_date_of_a_block_leaves_that_of_the_header(tmp_path):
    """python-can writes the header by the computer's clock, the block by the adapter's."""
    text = asc("Fri Mar 10 15:06:12.000 2023", "Begin Triggerblock Thu Jan 01 00:00:00.000 1970\n", ASC_FRAME)
    assert read(tmp_path / "a.asc", text)[0].t_ns.tolist() == [round(NOON.timestamp() * 1e9) + 500_000_000]


@pytest.mark.parametrize("stamps", ["absolute", "relative"])
@pytest.mark.parametrize("days", [(10, 11), (11, 10)])
def test_each_of_several_headers_dates_the_frames_behind_it(days, stamps, tmp_path):
    """The sum of relative stamps begins anew at each header, so that no frame seems late."""
    logs = (asc(f"2023-03-{day} 15:06:12", ASC_FRAME, base=f"base hex  timestamps {stamps}\n") for day in days)
    frames, report = read(tmp_path / "a.asc", "".join(logs))
    assert frames.t_ns.tolist() == [round(NOON.replace(day=day).timestamp() * 1e9) + 500_000_000 for day in days]
    assert not any("comes" in remark for remark in report.remarks())


@pytest.mark.parametrize(("day", "is_told"), [("Oct 25", True), ("Mar 29", True), ("Oct 24", False)])
def test_an_hour_in_which_clocks_are_set_is_told(day, is_told, tmp_path):
    _, report = read(tmp_path / "a.asc", asc(f"Sun {day} 02:30:00 2026"), BERLIN)
    assert any("in an hour in which clocks are set" in remark for remark in report.remarks()) == is_told


@pytest.mark.parametrize("stated", ["44995.5", "44995,5"])
def test_the_start_of_a_trc_may_have_a_decimal_comma(stated, tmp_path):
    frames, _ = read(tmp_path / "a.trc", f";$FILEVERSION=1.1\n;$STARTTIME={stated}\n     1)  0.0  Rx  0123  1  01\n")
    assert frames.t_ns.tolist() == [round(NOON.replace(hour=12, minute=0, second=0).timestamp() * 1e9)]


def test_a_start_time_of_a_trc_that_cannot_be_read_is_told(tmp_path):
    _, report = read(tmp_path / "a.trc", ";   Start time: 3/10/2023 3:06:12 PM\n     1)      500 0123 2 01 02\n")
    assert any("its date '3/10/2023 3:06:12 PM' cannot be read" in remark for remark in report.remarks())
