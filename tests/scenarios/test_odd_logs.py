"""One short drive as many recorders and copies leave it, through look, estimate, record and reprocess.

Every frame is used or counted with a reason, and no command names a cause that is not there.
"""

import gzip
import os
import re
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result
from support.archive import MIDNIGHT_NS, Here, S, write_manifest
from support.bus_drive import white_noise
from support.calibrated import calibration_file
from support.commands import called
from support.configured import service_config
from support.patience import PATIENCE_S, wait_until

from gateway.archive import place_of, receipts
from gateway.bus.frames import take
from gateway.bus.listen import LiveSource
from gateway.bus.logs.candump_write import append_candump
from gateway.bus.logs.open import open_log
from gateway.bus.signals import load_signal_map
from gateway.cli import record
from gateway.records import Frames
from gateway.units import NS_PER_S

DRIVE = white_noise(21.0, MIDNIGHT_NS, seed=1)
N = len(DRIVE)
WINDOW_S = 20.0
RELATIVE_S = (DRIVE.t_ns - MIDNIGHT_NS) / NS_PER_S
MAP = "springscale:reference"

CAUSES = {  # what a message may name, and how it does
    "undated": "has no date",
    "no zone": "states no zone",
    "late start": "after the date of its header",
    "fraction of a second": "stamps are not seconds since 1970",
    "comma": "decimal comma",
    "pauses": "pauses between frames",
    "whole seconds": "whole seconds",
    "rate": "no bus carries",
    "negative": "stamp is negative",
    "UTF-16": "UTF-16",
    "prefix": "written before the stamp",
    "names": "names instead of identifiers",
    "version": "is a .trc of version",
    "half byte": "half byte",
    "cut": "is cut off",
    "channels": "if these are one bus twice",
    "remote and error frames": f"left out: {N // 100} remote frames, {N // 100} error frames",
    "other channel": "correct channel in the signal map",
    "map": "map of this vehicle",
    "vehicle": "not the log of the vehicle",
    "nothing weighed": "nothing was weighed",
    "sensor": "antenna",
    "silence": "silent",
    "road": "road too smooth",
    "reader": "cannot be read as",
    "reverse": "in reverse order of time",
}


def candump(stamps_s: Sequence[float] | None = None, form: str = "({:.6f})", channel: str = "can0") -> bytes:
    """The drive as candump's text; with other stamps if they are given."""
    lines = _text(DRIVE, channel).decode().splitlines()
    if stamps_s is None:
        return ("\n".join(lines) + "\n").encode()
    rests = (line.partition(") ")[2] for line in lines)
    return "".join(f"{form.format(t)} {rest}\n" for t, rest in zip(stamps_s, rests, strict=True)).encode()


def _text(frames: Frames, channel: str) -> bytes:
    class Kept:
        content = b""

        def write(self, more: bytes) -> None:
            self.content += more

    kept = Kept()
    append_candump(frames, channel, kept)  # type: ignore[arg-type] # as much of a file as is asked
    return kept.content


def asc(date: str, base: str = "absolute", stamps_s: Sequence[float] = RELATIVE_S, name: str = "{:X}") -> bytes:
    """The drive as Vector's text."""
    rows = zip(stamps_s, DRIVE.can_id, DRIVE.length, DRIVE.payload, strict=True)
    lines = (
        f"{t:11.6f} 1  {name.format(can_id):<15} Rx   d {n} {payload[:n].tobytes().hex(' ')}\n"
        for t, can_id, n, payload in rows
    )
    return (f"{date}base hex  timestamps {base}\ninternal events logged\n" + "".join(lines)).encode()


def trc(version: str, header: str = "") -> bytes:
    """The drive as PEAK's text."""
    rows = zip(RELATIVE_S, DRIVE.can_id, DRIVE.length, DRIVE.payload, strict=True)
    lines = (
        f"{i:6d}) {1000.0 * t:12.1f}  Rx     {can_id:04X}  {n}  {payload[:n].tobytes().hex(' ')}\n"
        for i, (t, can_id, n, payload) in enumerate(rows, 1)
    )
    return (f";$FILEVERSION={version}\n{header}" + "".join(lines)).encode()


def damaged() -> bytes:
    """Every hundredth frame has lost a digit."""
    lines = candump().decode().splitlines()
    return "".join((line[:-1] if i % 100 == 50 else line) + "\n" for i, line in enumerate(lines)).encode()


def two_channels() -> bytes:
    lines = candump().decode().splitlines(keepends=True)
    return "".join(line.replace("can0", f"can{i % 2}") for i, line in enumerate(lines)).encode()


def with_others() -> bytes:
    """The log with a remote frame and an error frame before every hundredth frame."""
    lines = candump().decode().splitlines(keepends=True)
    for i in range(100 * (N // 100) - 1, 0, -100):
        stamp, channel, frame = lines[i].split()
        others = f"{stamp} {channel} {frame[:3]}#R\n{stamp} {channel} 20000004#0000000000000000\n"
        lines[i] = others + lines[i]
    return "".join(lines).encode()


PAUSES_S = np.diff(RELATIVE_S, prepend=0.0)
DATE = "date Sun Nov 01 00:00:00.000 2026\n"
ZONED = "date 2026-11-01T00:00:00Z\n"
ABSOLUTE_S = DRIVE.t_ns / NS_PER_S
DAYS = f";$STARTTIME={(MIDNIGHT_NS / S / 86_400.0) + 25_569.0:.9f}\n"


@dataclass(frozen=True)
class Case:
    """A log, its file's name, and what is said of it: ``told`` of one that is read, ``refused`` of one that is not.

    ``n_left_out`` frames of all cannot be read; ``n_others`` are no data frames.
    ``not_archived`` is why the archive alone refuses it.
    """

    name: str
    content: Callable[[], bytes]
    told: frozenset[str] = frozenset()
    refused: frozenset[str] = frozenset()
    n_left_out: int = 0
    not_archived: frozenset[str] = frozenset()
    n_frames: int = N
    n_others: int = 0

    @property
    def archived(self) -> frozenset[str]:
        return self.refused | self.not_archived


def said(*causes: str) -> frozenset[str]:
    return frozenset(causes)


UNDATED = {"told": said("undated"), "not_archived": said("undated")}
CASES = {
    "sound": Case("a.log", candump),
    "sound and packed": Case("a.log.gz", lambda: gzip.compress(candump())),
    "rotated": Case("a.log.1", candump),
    "rotated and packed": Case("a.log-20261101.gz", lambda: gzip.compress(candump())),
    "a byte order mark": Case("a.log", lambda: b"\xef\xbb\xbf" + candump()),
    "undated: candump -tz": Case("a.log", lambda: candump(RELATIVE_S, "({:010.6f})"), **UNDATED),
    "undated: .asc": Case("a.asc", lambda: asc(""), **UNDATED),
    "undated: .trc": Case("a.trc", lambda: trc("1.1"), **UNDATED),
    "a date of no known language": Case("a.asc", lambda: asc("date xxx foo 1 00:00:00 2026\n"), **UNDATED),
    "a date with its zone": Case("a.asc", lambda: asc(ZONED)),
    "a date without a zone": Case("a.asc", lambda: asc(DATE), told=said("no zone")),
    ".trc with a date": Case("a.trc", lambda: trc("1.1", DAYS), told=said("no zone")),
    "relative stamps": Case("a.asc", lambda: asc(ZONED, "relative", PAUSES_S)),
    "seconds of the day": Case("a.asc", lambda: asc(ZONED, stamps_s=54_000.0 + RELATIVE_S), told=said("late start")),
    "stamps since 1970 below a date": Case("a.asc", lambda: asc(DATE, stamps_s=ABSOLUTE_S)),
    "tabs": Case("a.log", lambda: candump().replace(b" ", b"\t")),
    "negative stamps": Case(
        "a.asc", lambda: asc(ZONED, stamps_s=RELATIVE_S - 0.1), told=said("negative"),
        n_left_out=int(np.count_nonzero(RELATIVE_S < 0.0999)),
    ),
    "damaged lines": Case("a.log", damaged, told=said("half byte"), n_left_out=(N + 49) // 100),
    "cut while packed": Case(
        "a.log.gz", lambda: gzip.compress(candump())[:-20], told=said("cut"), n_left_out=1, n_frames=0
    ),
    "two channels": Case("a.log", two_channels, told=said("channels")),
    "remote and error frames": Case(
        "a.log", with_others, told=said("remote and error frames"), n_others=2 * (N // 100)
    ),
    "candump -td": Case("a.log", lambda: candump(PAUSES_S, "({:010.6f})"), refused=said("pauses")),
    "milliseconds": Case("a.log", lambda: candump(1e3 * ABSOLUTE_S, "({:.3f})"), refused=said("fraction of a second")),
    "a decimal comma": Case("a.log", lambda: candump().replace(b".", b","), refused=said("comma")),
    "whole seconds": Case("a.log", lambda: candump(np.floor(ABSOLUTE_S), "({:.1f})"), refused=said("whole seconds")),
    "a thousand times too fast": Case(
        "a.log", lambda: candump(MIDNIGHT_NS / S + RELATIVE_S / 1000.0), refused=said("rate")
    ),
    "UTF-16": Case("a.log", lambda: candump().decode().encode("utf-16"), refused=said("UTF-16")),
    "a system's log": Case(
        "a.log", lambda: candump().replace(b"(", b"Nov 01 00:00:00 box candump: ("), refused=said("prefix")
    ),
    "symbolic .asc": Case("a.asc", lambda: asc(ZONED, name="IMU_{:X}"), refused=said("names")),
    "turned over": Case(
        "a.log", lambda: b"".join(candump().splitlines(keepends=True)[::-1]), refused=said("reverse")
    ),
    ".trc 3.0": Case("a.trc", lambda: trc("3.0"), refused=said("version")),
}  # fmt: skip


def causes_in(text: str) -> frozenset[str]:
    return frozenset(cause for cause, form in CAUSES.items() if form in text)


def n_left_out_in(text: str) -> int:
    return sum(map(int, re.findall(r"left out, [a-z ]+: (\d+)", text)))


def all_said(result: Result) -> str:
    """All the output of a command that a person reads."""
    return f"{result.output}\n{result.exception if result.exit_code else ''}"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An archive of one vehicle, the configuration of its service, and workers in this process."""

    @contextmanager
    def here(_: int | None) -> Iterator[Here]:
        yield Here()

    monkeypatch.setattr("gateway.cli.reprocess.local_workers", here)
    write_manifest(tmp_path, "van-1")
    service_config(
        tmp_path, calibration_file().to_json(), signals=MAP, estimator="ratio_index", batch__window_s=WINDOW_S
    )
    (tmp_path / "van-1").mkdir()
    return tmp_path


def written(folder: Path, case: Case) -> Path:
    log = folder / "van-1" / case.name
    log.write_bytes(case.content())
    return log


@pytest.fixture(params=CASES)
def case(request: pytest.FixtureRequest) -> Case:
    return CASES[request.param]


def n_in(case: Case, log: Path) -> int:
    """Frames that the file holds for a reader: those written, or of a cut one those before the cut."""
    if case.n_frames:
        return case.n_frames
    chunks, report = open_log(log, load_signal_map(MAP))
    return sum(map(len, chunks)) + report.n_rejected


def test_look(case: Case, folder: Path) -> None:
    log = written(folder, case)
    seen = called("look", log)
    assert causes_in(all_said(seen)) == case.told | case.refused
    assert bool(seen.exit_code) == bool(case.refused)
    if not case.refused:
        found = re.search(r": (\d+) frames in", seen.output)
        assert found
        assert int(found[1]) + n_left_out_in(seen.output) == n_in(case, log)
        assert n_left_out_in(seen.output) == case.n_left_out
        assert "This can work." in seen.output


def test_estimate(case: Case, folder: Path) -> None:
    log = written(folder, case)
    done = called("estimate", log, "--config", folder / "springscale.toml")
    assert causes_in(all_said(done)) == case.told | case.refused
    assert bool(done.exit_code) == bool(case.refused)
    if case.refused:
        assert done.stdout == ""
    else:
        assert done.stdout.count("payload   200.0 kg") == 1
        assert done.stdout.startswith("no date, 0:00:0" if "undated" in case.told else "2026-11-01T")
        assert n_left_out_in(done.output) == case.n_left_out
        chunks, report = open_log(log, load_signal_map(MAP))
        assert sum(map(len, chunks)) + sum(report.left_out.values()) == n_in(case, log) + case.n_others


def test_reprocess(case: Case, folder: Path) -> None:
    log = written(folder, case)
    done = called("reprocess", folder, "--output", folder / "out")
    assert causes_in(all_said(done)) == case.archived
    assert bool(done.exit_code) == bool(case.archived)
    for receipt in receipts(place_of(folder / "out")):
        assert len(receipt["logs"]) + len(receipt["failed_logs"]) == 1
        for told in receipt["logs"]:
            assert told["frames"] + sum(told["left_out"].values()) == n_in(case, log) + case.n_others
            assert sum(told["left_out"].values()) == case.n_left_out + case.n_others
            assert (told["ended_early"] is None) == ("cut" not in case.told)
            assert receipt["n_weighed"] == 1


def test_record(case: Case, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a replay of the log: the recording has every frame that could be read, at its time."""
    log, recorded = written(folder, case), folder / "recorded.log"
    monkeypatch.setattr(record, "FLUSH_S", 0.0)
    monkeypatch.setattr("gateway.bus.listen.POLL_S", 0.05)
    monkeypatch.setattr("gateway.bus.listen.ASLEEP_POLL_S", 0.05)
    bus = ("--interface", "virtual", "--channel", folder.name)
    signal_map = load_signal_map(MAP)
    source = LiveSource("virtual", folder.name, signal_map, silence_s=0.05)
    monkeypatch.setattr(record, "LiveSource", lambda *_: source)
    n_used = 0 if case.refused else n_in(case, log) - case.n_left_out
    sent: list[Result] = []

    def play() -> None:
        assert wait_until(lambda: source.state == "bus_silent")  # it is open, then
        sent.append(called("replay", log, *bus, "--speed", "max"))
        wait_until(lambda: source.counts().frames >= n_used)
        os.kill(os.getpid(), signal.SIGTERM)

    player = threading.Thread(target=play)
    player.start()
    done = called("record", recorded, "--signals", MAP, *bus, "--for-s", PATIENCE_S)
    player.join()
    if sent[0].exit_code:
        assert case.refused
        assert causes_in(all_said(sent[0])) == case.refused
        assert "no mapped frame came" in all_said(done)
        return
    if case.refused:
        return  # replay judges no stamps: the recording has what was sent until then
    assert f"{n_used} frames, 0 lost" in done.output
    chunks, report = open_log(recorded, signal_map)
    kept_ns = np.concatenate([chunk.t_ns for chunk in chunks])
    of_log_ns = np.concatenate([chunk.t_ns for chunk in open_log(log, signal_map)[0]])
    assert np.array_equal(kept_ns, of_log_ns)
    assert causes_in(" ".join(report.remarks())) <= {"undated"}


ASKED = "was the clock set?"
SET = {  # first stamp, seconds by which the clock is set midway, remark, whether in order, whether archived
    "back": (ABSOLUTE_S[0], -40.0, ("its stamps step back 1 time, by up to 0:00:40", ASKED), False, True),
    "forward": (ABSOLUTE_S[0], 86_400.0, ("its stamps leap forward by 1 day, 0:00:00", ASKED), True, True),
    "from 1970": (
        0.0, ABSOLUTE_S[0], ("its stamps leap forward by 20758 days, 0:00:00", "a part of it has no date"), False, False
    ),
    "to 1970": (
        ABSOLUTE_S[0], -ABSOLUTE_S[0], ("its stamps step back 1 time", "a part of it has no date"), False, False
    ),
    "at midnight": (86_389.5, -86_400.0, ("its stamps step back 1 time", "do they count from midnight?"), False, False),
}  # fmt: skip


@pytest.mark.parametrize("how", SET)
def test_a_clock_that_was_set_while_recording(how: str, folder: Path) -> None:
    """The commands say so, the archive gets no batch of 1970, and the years between the stamps cost no memory."""
    first_s, set_by_s, told, is_in_order, is_archived = SET[how]
    stamps_s = first_s + RELATIVE_S
    stamps_s[N // 2 :] += set_by_s
    log = folder / "van-1" / "a.log"
    log.write_bytes(candump(stamps_s))
    seen = called("look", log)
    for done in (seen, called("estimate", log, "--config", folder / "springscale.toml")):
        assert all(each in all_said(done) for each in told)
    assert ("This can work." in seen.output, "not across the steps" in seen.output) == (is_in_order, not is_in_order)
    done = called("reprocess", folder, "--output", folder / "out")
    assert (done.exit_code == 0, "no date" in all_said(done)) == (is_archived, not is_archived)


def test_another_vehicles_map(folder: Path) -> None:
    """Frames that no map knows are counted as such, and then alone the map is asked about."""
    log = folder / "van-1" / "a.log"
    foreign = take(DRIVE, slice(0, 3000))
    foreign = Frames(foreign.t_ns, foreign.can_id + np.uint32(0x400), foreign.length, foreign.payload)
    log.write_bytes(_text(foreign, "can0"))
    done = called("estimate", log, "--config", folder / "springscale.toml")
    assert causes_in(all_said(done)) == said("map")
    assert "none of its 3000 frames has an identifier of the signal map" in all_said(done)
    assert causes_in(all_said(called("look", log))) == said()
