"""Frames of whatever signal map, from samples in SI."""

from collections.abc import Mapping

import numpy as np

from gateway.bus.frames import merge_frames
from gateway.bus.signals import Encoder
from gateway.bus.signals.mapping import SignalMap
from gateway.records import F64, I64, Frames, Signal


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
