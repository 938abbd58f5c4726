"""The wanted frames of a log, and the result of reading it: counts, and the unreadable lines by reason."""

import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import datetime, timedelta, tzinfo
from enum import StrEnum
from pathlib import Path
from typing import Any, Final

import numpy as np

from gateway.bus.frames import LAST_SECOND, gathered
from gateway.bus.logs.wall_clock import is_ambiguous, ns_since_1970
from gateway.bus.signals import Decoder
from gateway.bus.signals.decode import TELLING_SHARE, Remark
from gateway.bus.signals.mapping import IdFilter
from gateway.errors import LogUnreadableError
from gateway.records import FIRST_DATED_NS, I64, U32, Bool, Frames, iso_utc
from gateway.units import NS_PER_S, S_PER_DAY
from gateway.words import counted

KEPT_LINE_NUMBERS: Final = 5  # chosen: what a person looks at
NAMED_CHANNELS: Final = 8  # chosen: likewise
KEPT_CHANNELS: Final = 32  # chosen: in memory; damaged lines name any number
CHUNK_FRAMES: Final = 32_768  # chosen: given out at once: large enough that the decoder's own steps cost little
SHOWN_CHARS: Final = 60  # chosen: of a line that cannot be read
MOST_NOTES: Final = 8  # chosen: of the dates in a log
AS_CANDUMP: Final = "; candump logs are recorded with candump -L"
JUDGED_FRAMES: Final = 1000  # chosen: least number whose stamps are judged
JUDGED_SECONDS: Final = 3.0  # chosen: likewise, before the end of the log is reached
WHOLE_PER_S: Final = 10.0  # chosen: more frames a second all on whole seconds are no coincidence
STEP_BACK_S: Final = 1.0  # chosen: further than frames of several buffers are out of order
LEAP_S: Final = 43_200.0  # chosen: a longer pause within a log gets a remark
LATE_START_H: Final = 1.0  # chosen: a first frame so long after the date of its header gets a remark
MOST_PER_S: Final = 100_000.0  # chosen: several times what a bus of 1 Mbit/s can carry (ISO 11898-1: 21,000 frames)


class LogReject(StrEnum):
    """Why a line of a log gave no frame."""

    NO_FRAME = "no_frame"  # nothing of the form ID#PAYLOAD: cut before it, or not a candump -L line
    NUL_BYTES = "nul_bytes"
    BAD_TIME = "bad_time"
    BAD_ID = "bad_id"
    BAD_PAYLOAD = "bad_payload"
    HALF_BYTE = "half_byte"
    TOO_LONG = "too_long"  # more bytes than a frame can hold
    GARBLED = "garbled"
    OVERLONG_LINE = "overlong_line"
    UNKNOWN_VERSION = "unknown_version"  # a frame in a form that python-can does not know


_KNOWN_LINES: Final = (
    (r"[^\r]*\r.", "lines end in a carriage return alone: save it with line feeds"),
    (r"(?:.\0){4}|(?:\0.){4}", "this is UTF-16: save it as UTF-8"),
    (r"\(\d{4}-\d\d-\d\d", "stamps are dates (candump -tA): record with candump -L alone"),
    (r"\(-?\d+,\d+\)|(\d+\)\s+)?-?\d+,\d+\s", "stamps have a decimal comma: write a point"),
    (r"\(-|\s*-\d", "the stamp is negative"),
    (r"\(\d{1,10}\)", "stamps are whole seconds: has a tool cut their fractions off?"),
    (r".*\xa0", "its spaces are no-break spaces: replace them"),
    (r"\S+ \S+ 0x", "identifiers begin with 0x: cut that off"),
    (r"(\(?\d+(\.\d+)?\)?\s+)?\S+\s+([RT]X\s+\S\s+\S\s+)?[0-9A-F]{3,8}\s+\[\d+\]",
     "this is candump's output for the screen: record with candump -L"),
    (r"\S.*\(\d+\.\d+\) \S+ [0-9A-F]{3,8}#", "something is written before the stamp, as in a system's log: cut it off"),
    (r"[^(]*#", "no stamp in parentheses stands before the frame"),
    (r"[^,;]+([,;][^,;]*){3,}", "this is a table: record with candump -L"),
    (r"\(?\d{11,}", "stamps are not seconds since 1970, but perhaps a fraction of it such as milliseconds"),
    (r"\d+\.\d+\s+[A-Z]\S*\s+[0-9A-F]+x?\s+[RT]x\b", "channels have names: export the log with numbers"),
    (r"\d+\.\d+\s+\S+\s+\w+\s+[RT]x\b", "messages have names instead of identifiers: export the log with numbers"),
)  # fmt: skip
"""Lines that other tools and settings write, and what to do: the first that fits is told."""


@dataclass(slots=True)
class RejectedLines:
    """How many lines were refused for one reason, the numbers of the first of them, counted from 1, and the first."""

    count: int = 0
    first_lines: list[int] = field(default_factory=list)
    text: str = ""

    def told(self, reason: LogReject) -> str:
        """ "left out, bad time: 9, first in line 1: stamps have a decimal comma: write a point: '(1,5) can0'" """
        where = f", first in line {self.first_lines[0]}" if self.first_lines else ""
        known = next((what for form, what in _KNOWN_LINES if re.match(form, self.text, re.IGNORECASE)), None)
        what = (f": {known}" if known else "") + (f": {self.text[:SHOWN_CHARS]!r}" if self.text else "")
        return f"left out, {str(reason).replace('_', ' ')}: {self.count}{where}{what}"


@dataclass(slots=True)
class LogReport:
    """Counts of a log, filled while it is read.

    ``frames`` counts everything that looks like a frame or should be one, of any identifier; ``wanted`` the frames
    given out. ``other_channel``, ``remote_frames`` and ``out_of_order`` are among the wanted identifiers. ``lines``
    stays 0 for binary formats, whose rejects carry no line numbers. ``ended_early`` says why a damaged file could not
    be read to its end.

    ``decoder`` is that of the frames given out, if they are decoded.

    ``start_ns`` is the date of the log's header, the latest of several; ``has_wall_clock``: it states no zone.
    """

    path: Path
    lines: int = 0
    frames: int = 0
    wanted: int = 0
    other_channel: int = 0
    remote_frames: int = 0
    error_frames: int = 0
    out_of_order: int = 0
    channels: set[str] = field(default_factory=set)
    rejects: dict[LogReject, RejectedLines] = field(default_factory=dict)
    ended_early: str | None = None
    start_ns: int | None = None
    has_wall_clock: bool = False
    zone: tzinfo | None = None
    notes: list[str] = field(default_factory=list)
    first_ns: int | None = None
    decoder: Decoder | None = None
    nearly: str | None = None  # how an identifier of it differs from one that is wanted
    _last_t_ns: int = 0
    span_ns: tuple[int, int] = (0, 0)  # the earliest and the latest stamp of the frames given out
    _steps_ns: tuple[int, int] = (0, 0)
    _n_whole_seconds: int = 0

    def keeps_lines_of(self, reason: LogReject) -> bool:
        """Whether the number of a further line refused for ``reason`` would still be kept."""
        return reason not in self.rejects or len(self.rejects[reason].first_lines) < KEPT_LINE_NUMBERS

    def reject(self, reason: LogReject, line: int | None = None, text: str = "", *, n: int = 1) -> None:
        """Count a refused line, or ``n`` of them without line numbers, which ``frames`` counts already."""
        if n == 0:
            return
        told = self.rejects.setdefault(reason, RejectedLines(text=text[: 2 * SHOWN_CHARS]))
        if line is not None and self.keeps_lines_of(reason):
            told.first_lines.append(line)
        told.count += n

    def reject_frame(self, reason: LogReject, text: str = "", line: int | None = None) -> None:
        """Count a line (default: the last one read) as a frame, and refuse it."""
        self.frames += 1
        self.reject(reason, self.lines if line is None else line, text.strip())

    def begin_at(self, date: datetime | None, zone: tzinfo | None, told: str) -> int:
        """Take the date of the header, which says ``told``; nanoseconds since 1970, 0 without one."""
        start_ns = None if date is None else ns_since_1970(date, zone)
        if date is None or start_ns is None or not FIRST_DATED_NS <= start_ns <= LAST_SECOND * NS_PER_S:
            self._note(f"its date {told[:SHOWN_CHARS]!r} {'cannot be read' if date is None else 'cannot be right'}")
            return self.start_ns or 0
        if is_ambiguous(date, zone):
            self._note(f"its date {told[:SHOWN_CHARS]!r} is in an hour in which clocks are set: it may be an hour off")
        self.has_wall_clock, self.zone = date.tzinfo is None, zone
        self.start_ns = max(start_ns, self.start_ns or 0)
        return start_ns

    def _note(self, text: str) -> None:
        if text not in self.notes and len(self.notes) < MOST_NOTES:
            self.notes.append(text)

    def count_wanted(self, t_ns: I64) -> None:
        """Count frames that are given out, at least one, by their stamps in order of arrival."""
        least, most = int(t_ns.min()), int(t_ns.max())
        if self.first_ns is None:
            self.first_ns = self._last_t_ns = int(t_ns[0])
            self.span_ns = least, most
        steps_ns = np.diff(t_ns, prepend=self._last_t_ns)
        self.out_of_order += int(np.count_nonzero(steps_ns < 0))
        self._steps_ns = min(int(steps_ns.min()), self._steps_ns[0]), max(int(steps_ns.max()), self._steps_ns[1])
        self.wanted += len(t_ns)
        self._n_whole_seconds += int(np.count_nonzero(t_ns % NS_PER_S == 0))
        self._last_t_ns = int(t_ns[-1])
        self.span_ns = min(least, self.span_ns[0]), max(most, self.span_ns[1])

    @property
    def span_s(self) -> float:
        """Seconds between the earliest and the latest stamp of the frames given out."""
        return (self.span_ns[1] - self.span_ns[0]) / NS_PER_S

    @property
    def is_dated(self) -> bool:
        """Whether all its stamps are dates; those of a log without frames are not."""
        return self.first_ns is not None and self.span_ns[0] >= FIRST_DATED_NS

    @property
    def is_partly_dated(self) -> bool:
        return self.span_ns[0] < FIRST_DATED_NS <= self.span_ns[1]

    @property
    def has_several_zeros(self) -> bool:
        """Whether its stamps step back further than buffers do, or only a part of them are dates."""
        return self._steps_ns[0] < -STEP_BACK_S * NS_PER_S or self.is_partly_dated

    def _steps_back(self) -> str:
        back_s, what = -self._steps_ns[0] / NS_PER_S, "is it several logs in one, or was the clock set?"
        if S_PER_DAY - LATE_START_H * 3600.0 < back_s <= S_PER_DAY:
            what = "do they count from midnight?"
        times = counted(self.out_of_order, "time")
        return f"its stamps step back {times}, by up to {timedelta(seconds=back_s)}: {what}"

    @property
    def other_identifiers(self) -> int:
        """Frames that no filter wants: what is left of all."""
        return self.frames - self.wanted - self.other_channel - self.remote_frames - self.n_rejected

    @property
    def n_rejected(self) -> int:
        return sum(lines.count for lines in self.rejects.values())

    @property
    def left_out(self) -> dict[str, int]:
        """Frames that were not given out, by reason; with ``wanted`` they are all that the log holds."""
        counts = {
            "other_identifiers": self.other_identifiers,
            "other_channel": self.other_channel,
            "remote_frames": self.remote_frames,
            "error_frames": self.error_frames,
            **{str(reason): lines.count for reason, lines in self.rejects.items()},
        }
        return {reason: n for reason, n in counts.items() if n}

    def to_json(self) -> dict[str, Any]:
        counts = ("lines", "frames", "wanted", "other_channel", "remote_frames", "error_frames", "out_of_order")
        rejects = {str(r): {"count": n.count, "first_lines": n.first_lines} for r, n in self.rejects.items()}
        return {
            "log": str(self.path),
            **{name: getattr(self, name) for name in counts},
            "rejects": rejects,
            "ended_early": self.ended_early,
        }

    def remarks(self, *, with_decoder: bool = True) -> Iterator[str]:
        """Warnings for people, a sentence each; none if all was well. Those of the decoder are about single signals."""
        if self.ended_early:
            yield f"{self.path}: {self.ended_early}; everything before was read"
        others = (
            (self.other_channel, "frame", " of other channels"),
            (self.remote_frames, "remote frame", ""),
            (self.error_frames, "error frame", ""),
        )
        if told := ", ".join(counted(n, noun) + rest for n, noun, rest in others if n):
            yield f"{self.path}: left out: {told}"
        for reason, lines in self.rejects.items():
            yield f"{self.path}: {lines.told(reason)}"
        if len(self.channels) > 1 and not self.other_channel:
            seen = ", ".join(sorted(self.channels)[:NAMED_CHANNELS])
            yield f"{self.path}: mapped frames are on {seen}; if these are one bus twice, name one in the map"
        decoder = self.decoder if with_decoder else None
        silent = decoder.silent() if decoder is not None and self.wanted else ()
        refused = () if decoder is None else decoder.remarks()
        texts = (*(remark.text for remark in (*silent, *refused)), *self.notes)
        yield from (f"{self.path}: {text}" for text in (*texts, *self.remarks_on_dates(), *self.remarks_on_clock()))

    def causes(self) -> tuple[Remark, ...]:
        """What the decoder refused so often that it explains why nothing is weighed."""
        return () if self.decoder is None else self.decoder.causes()

    def remarks_on_dates(self) -> Iterator[str]:
        """What is not known of the dates of its frames."""
        if self.first_ns is None or self.is_partly_dated:
            return
        if not self.is_dated:
            yield "has no date: times count from the zero of its stamps"
        elif self.has_wall_clock and self.zone is None:
            yield "its date states no zone, it is read as UTC; if that is wrong, state time_zone in the signal map"

    def remarks_on_clock(self) -> Iterator[str]:
        """Where its stamps do not run as a clock does."""
        if self.first_ns is None:
            return
        if self.is_partly_dated:
            yield "a part of it has no date: times count from the zero of its stamps"
        if self._steps_ns[0] < -STEP_BACK_S * NS_PER_S or 8 * self.out_of_order > self.wanted:
            yield self._steps_back()
        leap_s = self._steps_ns[1] / NS_PER_S
        if leap_s > LEAP_S:
            yield f"its stamps leap forward by {timedelta(seconds=leap_s)}: a pause, or was the clock set?"
        late_h = 0.0 if self.start_ns is None else (self.first_ns - self.start_ns) / NS_PER_S / 3600.0
        if late_h > LATE_START_H:
            late = f"{late_h:.1f} h after the date of its header, {iso_utc(self.start_ns or 0)}"
            yield f"its first frame comes {late}: do its stamps count from another instant?"

    def why_no_times(self) -> str | None:
        """Why the stamps of the wanted frames cannot be their times; None if they can."""
        if self.wanted < JUDGED_FRAMES:
            return None
        if self._n_whole_seconds == self.wanted > WHOLE_PER_S * self.span_s:
            return f"its {self.wanted} stamps are whole seconds: has a tool cut their fractions off?"
        if self.out_of_order and self._steps_ns[1] == 0:
            return "its lines are in reverse order of time: turn them over"
        if not self.is_dated and 8 * self.out_of_order > self.wanted:
            return "its stamps are the pauses between frames (candump -td): record with candump -L alone"
        if self.wanted > MOST_PER_S * self.span_s:
            return f"it has {self.wanted} frames in {self.span_s:.3g} s by its stamps, which no bus carries"
        return None

    @contextmanager
    def until_damage(self, kind: str) -> Iterator[None]:
        """A library reads a binary log in the block: any exception is a damage, behind which nothing is read.

        Raises LogUnreadableError if it comes before the first frame.
        """
        try:
            yield
        except LogUnreadableError:
            raise
        except Exception as fault:  # noqa: BLE001 # whatever a damaged file makes struct, zlib or numpy raise
            why = str(fault) or type(fault).__name__
            if self.frames == 0:
                raise LogUnreadableError(f"{self.path}: cannot be read as {kind}: {why}: is it whole?") from None
            self.ended_early = why if isinstance(fault, EOFError | OSError) else f"the file is damaged: {why}"

    def require_frames(self) -> None:
        """After reading: raise LogUnreadableError, saying why, if no wanted frame was found or their stamps are no
        times.
        """
        if (why := self._why_unusable()) is not None:
            raise LogUnreadableError(f"{self.path}: {why}")

    def require_dates(self) -> None:
        """After reading: as require_frames, and raise LogUnreadableError if a stamp is no date."""
        self.require_frames()
        if not self.is_dated:
            why = "a part of it has no date" if self.is_partly_dated else "; ".join(("has no date", *self.notes))
            raise LogUnreadableError(
                f"{self.path}: {why}: nothing tells which month and calibration it belongs to; weigh it with "
                "springscale estimate"
            )

    def _why_unusable(self) -> str | None:
        if self.wanted:
            return self.why_no_times()
        if self.other_channel:
            seen = ", ".join(sorted(self.channels)[:NAMED_CHANNELS])
            return f"the mapped frames are on {seen} only; correct channel in the signal map"
        if self.n_rejected > TELLING_SHARE * self.frames:
            reason, lines = max(self.rejects.items(), key=lambda each: each[1].count)
            is_candump = not {".asc", ".trc", ".blf", ".mf4"} & set(self.path.suffixes)
            return f"holds no CAN frame that can be read; {lines.told(reason)}{AS_CANDUMP if is_candump else ''}"
        if self.remote_frames:
            return f"of the mapped identifiers it has only remote frames ({self.remote_frames}), which carry no data"
        if self.frames:
            else_ask = "; is it the map of this vehicle? springscale look shows what is in it"
            return f"none of its {self.frames} frames has an identifier of the signal map{self.nearly or else_ask}"
        if self.error_frames:
            what = f"error frames only ({self.error_frames}): check the bit rate and the wiring of the recorder"
        else:
            what = "no CAN frame" + (f" ({self.ended_early})" if self.ended_early else "")
        return f"holds {what}"


@dataclass(frozen=True, slots=True)
class Selection:
    """The frames that pass one of ``filters``, of ``channel`` or of all, with payload rows of ``width`` bytes.

    ``report`` names the log and counts what is read of it. ``zone`` holds for dates that state none; None: UTC.
    """

    report: LogReport
    filters: Sequence[IdFilter]
    channel: str | None
    width: int
    zone: tzinfo | None = None

    @property
    def path(self) -> Path:
        return self.report.path

    def passes(self, can_id: U32) -> Bool:
        """Which identifiers (n,) pass one of the filters."""
        passes = np.zeros(len(can_id), np.bool_)
        for id_filter in self.filters:
            passes |= id_filter.matches(can_id)
        return passes

    def has(self, channel: object, n_frames: int) -> bool:
        """Whether frames of this channel are wanted; if not, they are counted.

        A number, as python-can counts channels, is also that of a name that ends in it (1 and "can1"). None, of a
        format that keeps no channel, has every name.
        """
        if channel is not None and n_frames and len(self.report.channels) < KEPT_CHANNELS:
            self.report.channels.add(str(channel))
        if channel is None or self.channel in (None, str(channel)):
            return True
        digits = re.search(r"\d+$", self.channel or "") if isinstance(channel, int) else None
        is_wanted = digits is not None and int(digits[0]) == channel
        self.report.other_channel += 0 if is_wanted else n_frames
        return is_wanted

    def given_out(self, parts: Iterable[Frames], n: int = CHUNK_FRAMES) -> Iterator[Frames]:
        """The frames in chunks of at least ``n``, each counted as it is given out.

        Raises LogUnreadableError once their stamps turn out to be no times, before they mislead anyone.
        """
        for frames in gathered(parts, n, self.width):
            self.report.count_wanted(frames.t_ns)
            if self.report.span_s >= JUDGED_SECONDS and (why := self.report.why_no_times()) is not None:
                raise LogUnreadableError(f"{self.path}: {why}")
            yield frames

    def rows(self, can_id: U32, channel: I64 | None, is_remote: Bool | None = None) -> I64:
        """Rows (m,) of the wanted data frames among all (n,), remote ones among them. A format may store no channel."""
        self.report.frames += len(can_id)
        rows = np.flatnonzero(self.passes(can_id))
        if is_remote is not None and is_remote[rows].any():
            self.report.remote_frames += int(np.count_nonzero(is_remote[rows]))
            rows = rows[~is_remote[rows]]
        if channel is None:
            return rows
        for number in set(channel[rows].tolist()):
            is_on_it = channel[rows] == number
            if not self.has(number, int(np.count_nonzero(is_on_it))):
                rows = rows[~is_on_it]
        return rows
