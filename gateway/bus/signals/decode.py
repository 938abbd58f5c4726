"""Frames to motion: the one decoder, for whole columns at once, used by bulk readers and the live service alike.

cantools is the reference for the bits: a property test compares every number with it.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gateway.bus.signals.mapping import IdFilter, MappedMessage, SignalMap
from gateway.bus.signals.samples import Rejected, SampleReader
from gateway.records import ASIDE, F64, I64, Frames, Motion, Signal

__all__ = ["Decoder", "Rejected", "SignalCounts"]


@dataclass(frozen=True, slots=True)
class SignalCounts:
    """Outcomes of the frames that can carry one signal."""

    samples: int
    rejected: Mapping[Rejected, int]


class Decoder:
    """Turns frames into motion by one signal map. The counts are its only memory: chunking leaves no trace."""

    def __init__(self, signal_map: SignalMap) -> None:
        self.signals = signal_map.signals
        self._messages = [_MessageReader(message, self.signals) for message in signal_map.messages]
        self._is_aside = np.array([message.is_aside for message in self._messages])
        self._counted = tuple(s for s in self.signals if signal_map.traits[s].counter_modulus)

    @property
    def counts(self) -> dict[Signal, SignalCounts]:
        """Samples and rejections of every mapped signal so far."""
        return {signal: counts for message in self._messages for signal, counts in message.counts()}

    def decode(self, frames: Frames) -> Motion:
        """One row for every frame of a mapped message, in order of arrival; other frames are passed over.

        All signals of a frame share its row. NaN if a frame does not validly carry a sample.
        """
        message_of = np.full(len(frames), -1, np.int16)
        for i, message in enumerate(self._messages):
            message_of[message.id_filter.matches(frames.can_id)] = i
        rows = np.flatnonzero(message_of >= 0)
        message_of = message_of[rows]
        columns = np.full((len(rows), len(self.signals)), np.nan)
        counters = {signal: np.full(len(rows), np.nan) for signal in self._counted}
        for i, message in enumerate(self._messages):
            ours = np.flatnonzero(message_of == i)
            if len(ours):
                message.fill(columns, ours, frames, rows[ours])
                message.count(counters, ours, frames, rows[ours])
        aside = self._is_aside[message_of] if self._is_aside.any() else None
        return Motion(self.signals, frames.t_ns[rows], columns, counters, aside)


class _MessageReader:
    """Reads the mapped signals of one message, and counts."""

    def __init__(self, message: MappedMessage, signals: tuple[Signal, ...]) -> None:
        self.id_filter: IdFilter = message.id_filter
        self.is_aside = all(m.signal in ASIDE for m in message.signals)
        self._length = message.length
        self._readers = [(m.signal, signals.index(m.signal), SampleReader(m)) for m in message.signals]
        self._counters = {m.signal: m.counter for m in message.signals if m.counter is not None}
        self._n_frames = 0
        self._rejected: dict[Signal, Counter[Rejected]] = {m.signal: Counter() for m in message.signals}

    def counts(self) -> list[tuple[Signal, SignalCounts]]:
        """Samples and rejections of each signal so far."""
        rejected = self._rejected.items()
        return [(signal, SignalCounts(self._n_frames - n.total(), dict(n))) for signal, n in rejected]

    def fill(self, columns: F64, ours: I64, frames: Frames, rows: I64) -> None:
        """Decode the frames ``rows`` (m,), all of this message, into the rows ``ours`` (m,) of ``columns``."""
        self._n_frames += len(rows)
        has_length = frames.length[rows] == self._length
        n_wrong = len(rows) - int(np.count_nonzero(has_length))
        if n_wrong:
            rows, ours = rows[has_length], ours[has_length]
            for rejected in self._rejected.values():
                rejected[Rejected.WRONG_LENGTH] += n_wrong
        if not len(rows):
            return
        payload = frames.payload[rows]
        for signal, column, reader in self._readers:
            columns[ours, column], refused = reader.read(payload)
            self._rejected[signal].update(refused)

    def count(self, counters: Mapping[Signal, F64], ours: I64, frames: Frames, rows: I64) -> None:
        """Message counters of the same frames into the same rows; a frame too short for its counter gives no sample
        either.
        """
        for signal, field in self._counters.items():
            counters[signal][ours] = field.bits(frames.payload[rows])
