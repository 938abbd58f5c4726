"""Samples to frames, whole columns at once: the decoder's mirror, for the simulator and the feeder."""

from collections.abc import Mapping

import numpy as np

from gateway.bus.signals.mapping import SignalMap
from gateway.records import F64, I64, Frames

J1939_UNUSED = 0xFF  # SAE J1939: unused bits are 1, "not available"


class Encoder:
    """Writes the messages of a signal map.

    A sample is rounded to the nearest step and limited to the range of the bits, as a sensor saturates.
    """

    def __init__(self, signal_map: SignalMap) -> None:
        self._map = signal_map
        self._messages = {message.name: message for message in signal_map.messages}

    def encode(self, message: str, t_ns: I64, samples: Mapping[str, F64]) -> Frames:
        """Frames of one message at the times (n,); ``samples`` (n,) by DBC signal name, in units of the DBC.

        Missing signals are 0 in the DBC's unit (all bits set if the map is J1939). Multiplexers and
        the signals of ``valid_when`` take the value under which the mapped signals count, unless given.
        Raises KeyError for a message or signal that the map does not contain.
        """
        n, mapped = len(t_ns), self._messages[message]
        payload = np.zeros((n, self._map.payload_width), np.uint8)
        if self._map.j1939:
            payload[:, : mapped.length] = J1939_UNUSED
        else:
            for field in mapped.fields.values():
                field.put(payload, field.bits_of(np.zeros(n)))
        for signal in mapped.signals:
            for condition in (*signal.multiplexed_by, *signal.valid_when):
                condition.field.put(payload, np.full(n, condition.allowed_bits[0], np.uint64))
        for name, physical in samples.items():
            mapped.fields[name].put(payload, mapped.fields[name].bits_of(physical))
        can_id = np.full(n, mapped.frame_id, np.uint32)
        return Frames(t_ns, can_id, np.full(n, mapped.length, np.uint8), payload)
