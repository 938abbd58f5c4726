"""The identifiers of a log, and the motion signals that databases find in them."""

import math
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Final

import numpy as np

from gateway.bus.frames import join, take
from gateway.bus.logs import LogReport, open_whole_log
from gateway.bus.signals import Decoder
from gateway.bus.signals.dbc import DatabaseMessage, DatabaseSignal
from gateway.bus.signals.decode import Remark
from gateway.bus.signals.mapping import CAN_FD_BYTES, MappedMessage, SignalMap, exact_filter, j1939_filter
from gateway.bus.signals.signal_map import SignalEntry, resolve_signal
from gateway.errors import SignalMapError
from gateway.records import EXTENDED_ID, F64, Frames, Signal
from gateway.units import NS_PER_S, TO_SI

KEPT_FRAMES: Final = 100_000  # chosen: of one identifier: a quarter of an hour at 100 Hz; counts cover all frames
MOST_KEPT: Final = 1_000_000  # chosen: of all, 80 MB; beyond it an identifier gets its first few
FIRST_FRAMES: Final = 200  # chosen: the few
MOST_IDENTIFIERS: Final = 4096  # chosen: of one channel; a bus has some hundreds
MOTION: Final = {
    "acceleration": Signal.VERTICAL_ACCELERATION, "angular_rate": Signal.PITCH_RATE, "speed": Signal.SPEED,
}  # fmt: skip
"""The signal that stands for its quantity until the role of a reading is known."""


@dataclass(frozen=True)
class Heard:
    """One identifier of one channel: the number of its frames, their time span, the first of them, and its message.

    ``by_group`` if only the J1939 group of the message is the same.
    """

    channel: str | None
    can_id: int
    n_frames: int
    duration_s: float
    frames: Frames
    message: DatabaseMessage | None = None
    by_group: bool = False

    @property
    def rate_hz(self) -> float:
        """Frames a second, from the first to the last."""
        return (self.n_frames - 1) / self.duration_s if self.duration_s > 0.0 else 0.0

    @cached_property
    def lengths(self) -> list[int]:
        """The lengths of the kept frames, the most frequent first."""
        return [length for length, _ in Counter(self.frames.length.tolist()).most_common()]


def heard_in(log: Path) -> tuple[list[Heard], LogReport]:
    """Every identifier in order of channel and number. Raises LogUnreadableError if nothing can be read."""
    chunks, report = open_whole_log(log)
    heard, n_others = _heard_of(chunks, None)
    report.require_frames()
    if n_others:
        report.notes.append(
            f"{n_others} frames are under further identifiers than the first {MOST_IDENTIFIERS}, which no bus has; "
            "they are left out here"
        )
    channels = sorted(report.channels)
    if len(channels) < 2:
        return [replace(one, channel=next(iter(channels), None)) for one in heard], report
    return [one for each in channels for one in _heard_of(open_whole_log(log, each)[0], each)[0]], report


def _heard_of(chunks: Iterable[Frames], channel: str | None) -> tuple[list[Heard], int]:
    """The identifiers of the frames, all of one channel, and the number of frames beyond MOST_IDENTIFIERS of them."""
    spans: dict[int, tuple[int, int, int]] = {}  # number of frames, first and last stamp
    kept: dict[int, list[Frames]] = {}
    n_others = n_kept = 0
    for chunk in chunks:
        order = np.argsort(chunk.can_id, kind="stable")
        can_ids, begins = np.unique(chunk.can_id[order], return_index=True)
        for can_id, rows in zip(can_ids.tolist(), np.split(order, begins[1:]), strict=True):
            if can_id not in spans and len(spans) >= MOST_IDENTIFIERS:
                n_others += len(rows)
                continue
            t_ns = chunk.t_ns[rows]
            n, first_ns, last_ns = spans.get(can_id, (0, t_ns[0], t_ns[0]))
            spans[can_id] = n + len(rows), min(first_ns, int(t_ns.min())), max(last_ns, int(t_ns.max()))
            if (room := (KEPT_FRAMES if n_kept < MOST_KEPT else FIRST_FRAMES) - n) > 0:
                kept.setdefault(can_id, []).append(take(chunk, rows[:room]))
                n_kept += min(room, len(rows))
    return [
        Heard(channel, can_id, n, int(last_ns - first_ns) / NS_PER_S, join(kept[can_id], CAN_FD_BYTES))
        for can_id, (n, first_ns, last_ns) in sorted(spans.items())
    ], n_others


def with_message(one: Heard, messages: Sequence[DatabaseMessage], own: Collection[Path]) -> Heard:
    """The identifier with its message: of an own database first, of the length of its frames, of just its number."""
    same = [(each, False) for each in messages if each.frame_id == one.can_id]
    groups = [each for each in messages if each.frame_id & one.can_id & EXTENDED_ID]
    same += [(each, True) for each in groups if j1939_filter(each.frame_id).is_for(one.can_id)]
    if not same:
        return one
    message, by_group = min(same, key=lambda of: (of[0].source not in own, of[0].length not in one.lengths, of[1]))
    return replace(one, message=message, by_group=by_group)


@dataclass(frozen=True)
class SignalReading:
    """One signal of one identifier: times (n,) from the log's origin, valid samples (n,) in SI, and what is refused."""

    heard: Heard
    message: DatabaseMessage
    signal: DatabaseSignal
    quantity: str
    t_s: F64
    x: F64
    remarks: list[Remark]

    @property
    def name(self) -> str:
        """MESSAGE.SIGNAL."""
        return f"{self.message.name}.{self.signal.name}"

    @property
    def rate_hz(self) -> float:
        """Frames a second as they usually follow each other, if that is more: a log may have long pauses."""
        step_s = float(np.median(np.diff(self.t_s))) if len(self.t_s) > 1 else 0.0
        return max(self.heard.rate_hz, 1.0 / step_s if step_s > 0.0 else 0.0)

    @cached_property
    def usual(self) -> float:
        """The median, SI; NaN without a sample."""
        return float(np.median(self.x)) if len(self.x) else math.nan

    def is_rival(self, other: "SignalReading") -> bool:
        """Whether another device sends this signal on the same channel."""
        is_same = self.signal is other.signal and self.heard.channel == other.heard.channel
        return is_same and self.heard.can_id != other.heard.can_id


def readings_of(one: Heard, message: DatabaseMessage, origin_ns: int) -> Iterator[SignalReading]:
    """The signals of its message with a unit of motion; those that no map could name are left out."""
    for signal in message.signals.values():
        unit = (signal.unit or "").strip().lower()
        for quantity in (each for each in MOTION if unit in TO_SI[each]):
            role, entry = MOTION[quantity], SignalEntry(message=message.name, signal=signal.name)
            with suppress(SignalMapError):
                mapped = resolve_signal(message.name, role, entry, message, one.by_group)
                ids, name = exact_filter(one.can_id), f"{message.name}.{signal.name}"
                ours = MappedMessage(message.name, one.can_id, ids, message.length, (mapped,), {})
                decoder = Decoder(SignalMap("", None, one.by_group, (ours,)))
                t_ns, x = decoder.decode(one.frames).of(role)
                told = [(each, each.text.replace(f"{role} ({message.name})", name)) for each in decoder.remarks()]
                remarks = [replace(each, text=text) for each, text in told]
                yield SignalReading(one, message, signal, quantity, (t_ns - origin_ns) / NS_PER_S, x, remarks)
