"""The wanted frames of a log, and the result of reading it: counts, and the unreadable lines by reason."""

import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any, Final

import numpy as np

from gateway.bus.frames import gathered
from gateway.bus.signals import IdFilter
from gateway.errors import LogUnreadableError
from gateway.records import I64, U32, Bool, Frames

KEPT_LINE_NUMBERS: Final = 5  # chosen: what a person looks at
NAMED_CHANNELS: Final = 8  # chosen: likewise
KEPT_CHANNELS: Final = 32  # chosen: in memory; damaged lines name any number
CHUNK_FRAMES: Final = 32_768  # chosen: given out at once: large enough that the decoder's own steps cost little


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


@dataclass(slots=True)
class RejectedLines:
    """How many lines were refused for one reason, and the numbers of the first of them, counted from 1."""

    count: int = 0
    first_lines: list[int] = field(default_factory=list)


@dataclass(slots=True)
class LogReport:
    """Counts of a log, filled while it is read.

    ``frames`` counts everything that looks like a frame, of any identifier; ``wanted`` the frames given out.
    ``other_channel``, ``remote_frames`` and ``out_of_order`` are among the wanted identifiers. ``lines`` stays 0 for
    binary formats, whose rejects carry no line numbers. ``ended_early`` says why a damaged file could not be read to
    its end.
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
    _last_t_ns: int | None = None

    def keeps_lines_of(self, reason: LogReject) -> bool:
        """Whether the number of a further line refused for ``reason`` would still be kept."""
        return reason not in self.rejects or len(self.rejects[reason].first_lines) < KEPT_LINE_NUMBERS

    def reject(self, reason: LogReject, line: int | None = None, *, n: int = 1) -> None:
        """Count a refused line, or ``n`` of them without line numbers."""
        if n == 0:
            return
        if line is not None and self.keeps_lines_of(reason):
            self.rejects.setdefault(reason, RejectedLines()).first_lines.append(line)
        self.rejects.setdefault(reason, RejectedLines()).count += n

    def count_wanted(self, t_ns: I64) -> None:
        """Count frames that are given out, at least one, by their stamps in order of arrival."""
        before = t_ns[0] if self._last_t_ns is None else self._last_t_ns
        self.out_of_order += int(np.count_nonzero(np.diff(t_ns, prepend=before) < 0))
        self.wanted += len(t_ns)
        self._last_t_ns = int(t_ns[-1])

    @property
    def n_rejected(self) -> int:
        return sum(lines.count for lines in self.rejects.values())

    def to_json(self) -> dict[str, Any]:
        counts = ("lines", "frames", "wanted", "other_channel", "remote_frames", "error_frames", "out_of_order")
        rejects = {str(r): {"count": n.count, "first_lines": n.first_lines} for r, n in self.rejects.items()}
        return {
            "log": str(self.path),
            **{name: getattr(self, name) for name in counts},
            "rejects": rejects,
            "ended_early": self.ended_early,
        }

    def remarks(self) -> Iterator[str]:
        """Warnings for people, a sentence each; none if all was well."""
        if self.ended_early:
            yield f"{self.path}: {self.ended_early}; everything before was read"
        for reason, lines in self.rejects.items():
            where = f", first in line {lines.first_lines[0]}" if lines.first_lines else ""
            yield f"{self.path}: left out, {str(reason).replace('_', ' ')}: {lines.count}{where}"
        if len(self.channels) > 1 and not self.other_channel:
            seen = ", ".join(sorted(self.channels)[:NAMED_CHANNELS])
            yield f"{self.path}: mapped frames are on {seen}; if these are one bus twice, name one in the map"

    @contextmanager
    def until_damage(self, kind: str) -> Iterator[None]:
        """A library reads a binary log in the block: any exception is a damage, behind which nothing is read.

        Raises LogUnreadableError if it comes before the first frame.
        """
        try:
            yield
        except LogUnreadableError:
            raise
        except Exception as fault:  # noqa: BLE001 # whatever a damaged file makes struct, zlib, numpy or SQLite raise
            why = str(fault) or type(fault).__name__
            if self.frames == 0:
                raise LogUnreadableError(f"{self.path}: cannot be read as {kind}: {why}") from None
            self.ended_early = why if isinstance(fault, EOFError | OSError) else f"the file is damaged: {why}"

    def require_frames(self) -> None:
        """After reading: raise LogUnreadableError, saying why, if not one wanted frame was found."""
        if self.wanted:
            return
        if self.other_channel:
            seen = ", ".join(sorted(self.channels)[:NAMED_CHANNELS])
            raise LogUnreadableError(
                f"{self.path}: the mapped frames are on {seen} only; correct channel in the signal map"
            )
        if self.frames:
            raise LogUnreadableError(
                f"{self.path}: none of its {self.frames} frames has an identifier of the signal map; "
                "is it the map of this vehicle? springscale look shows what is in it"
            )
        why = f" ({self.ended_early})" if self.ended_early else ""
        raise LogUnreadableError(f"{self.path}: holds no CAN frame{why}; candump logs are recorded with candump -L")


def is_same_channel(recorded: object, wanted: str | None) -> bool:
    """Whether a recorded channel is the wanted one.

    A number, as python-can counts channels, matches a name that ends in it (1 and "can1"). A format that
    keeps no channel (.csv, .db) matches every name.
    """
    if wanted is None or recorded is None or str(recorded) == wanted:
        return True
    digits = re.search(r"\d+$", wanted)
    return isinstance(recorded, int) and digits is not None and int(digits[0]) == recorded


@dataclass(frozen=True, slots=True)
class Selection:
    """The frames that pass one of ``filters``, of ``channel`` or of all, with payload rows of ``width`` bytes.

    ``report`` names the log and counts what is read of it.
    """

    report: LogReport
    filters: Sequence[IdFilter]
    channel: str | None
    width: int

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
        """Whether frames of this channel are wanted; if not, they are counted. None: the format keeps no channel."""
        if channel is not None and n_frames and len(self.report.channels) < KEPT_CHANNELS:
            self.report.channels.add(str(channel))
        if is_same_channel(channel, self.channel):
            return True
        self.report.other_channel += n_frames
        return False

    def given_out(self, parts: Iterable[Frames], n: int = CHUNK_FRAMES) -> Iterator[Frames]:
        """The frames in chunks of at least ``n``, each counted as it is given out."""
        for frames in gathered(parts, n, self.width):
            self.report.count_wanted(frames.t_ns)
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
