"""Frames as they are given, or of whatever signal map from samples in SI."""

from collections.abc import Iterable, Mapping

import numpy as np

from gateway.bus.frames import merge_frames
from gateway.bus.signals import Encoder
from gateway.bus.signals.mapping import SignalMap
from gateway.records import F64, I64, Frames, Signal


def frames_of(rows: Iterable[tuple[int, int, bytes]], width: int = 8) -> Frames:
    """Frames of time stamp (ns), identifier and payload; bytes beyond ``width`` show in the length alone."""
    rows = list(rows)
    table = b"".join(payload[:width].ljust(width, b"\0") for _, _, payload in rows)
    return Frames(
        np.array([t_ns for t_ns, _, _ in rows], np.int64),
        np.array([can_id for _, can_id, _ in rows], np.uint32),
        np.array([len(payload) for _, _, payload in rows], np.uint8),
        np.frombuffer(table, np.uint8).reshape(len(rows), width),
    )


def encode_signals(signal_map: SignalMap, t_ns: Mapping[Signal, I64], samples: Mapping[Signal, F64]) -> Frames:
    """Frames of mapped signals, each at its own times, in order of time.

    Signals of one message must share their times. Raises ValueError where they do not.
    """
    parts = []
    for message in signal_map.messages:
        mapped = [m for m in message.signals if m.signal in samples]
        if not mapped:
            continue
        times = t_ns[mapped[0].signal]
        if any(not np.array_equal(times, t_ns[m.signal]) for m in mapped[1:]):
            raise ValueError(f"the signals of message {message.name!r} travel together: give them the same times")
        in_its_units = {m.dbc_signal: samples[m.signal] / m.to_si for m in mapped}
        parts.append(Encoder(signal_map).encode(message.name, times, in_its_units))
    return merge_frames(parts)
