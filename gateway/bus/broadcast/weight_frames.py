"""Weights as frames of SAE J1939: VW, one an axle, and CVW, laid out and scaled by dbc/j1939_weights.dbc."""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import Any, Final

import cantools
import numpy as np

from gateway.estimate import Estimate, Weights
from gateway.j1939 import AXLE_WEIGHT, NOT_AVAILABLE, counts_of
from gateway.records import EXTENDED_ID, Frames

DATABASE: Final = "j1939_weights.dbc"
WHOLE_AXLE: Final = 0xF  # where four bits would name a tyre
UNWEIGHED: Final = Weights()
_PRIORITY_SHIFT: Final = 26
_GROUP: Final = 0x3FFFF00  # the bits of an identifier that name the parameter group


@dataclass(frozen=True, slots=True)
class Sender:
    """Source address and priority (SAE J1939-21, 5.2). The front axle has the number ``first_axle``.

    The springs do not measure a trailer: with ``draws_trailers`` the combination's weight stays unknown.
    """

    source_address: int
    priority: int = 6
    first_axle: int = 1
    draws_trailers: bool = False


class WeightFrames:
    """Makes the frames of one moment: VW of the front axle, VW of the rear axle, CVW."""

    def __init__(self, sender: Sender) -> None:
        self._database: Any = cantools.database.load_string(files("gateway.dbc").joinpath(DATABASE).read_text(), "dbc")
        self._sender = sender

    def of(self, shown: Estimate | None, t_ns: int) -> Frames:
        """Frames (3,) stamped ``t_ns``; every number that ``shown`` lacks, or all if it is None, is "not available"."""
        weights = UNWEIGHED if shown is None else shown.weights
        counts = counts_of(shown, weights, draws_trailers=self._sender.draws_trailers)
        first = self._sender.first_axle
        of_axle = {count.axle: count.raw for count in counts if count.axle is not None}
        whole = {count.parameter.signal: count.raw for count in counts if count.axle is None}
        messages = [
            ("VW", {"TireLocation": WHOLE_AXLE, "AxleLocation": first, AXLE_WEIGHT.signal: of_axle[1]} | whole),
            ("VW", {"TireLocation": WHOLE_AXLE, "AxleLocation": first + 1, AXLE_WEIGHT.signal: of_axle[2]} | whole),
            ("CVW", whole),
        ]
        payload = np.frombuffer(b"".join(self._encoded(*message) for message in messages), np.uint8).reshape(-1, 8)
        can_id = [self._identifier(name) for name, _ in messages]
        n = len(messages)
        return Frames(np.full(n, t_ns, np.int64), np.array(can_id, np.uint32), np.full(n, 8, np.uint8), payload)

    def _identifier(self, name: str) -> int:
        group: int = self._database.get_message_by_name(name).frame_id & _GROUP
        return self._sender.priority << _PRIORITY_SHIFT | group | self._sender.source_address | EXTENDED_ID

    def _encoded(self, name: str, known: Mapping[str, int]) -> bytes:
        """The eight bytes; unused bits are set, as J1939 requires."""
        message = self._database.get_message_by_name(name)
        raw = {signal.name: known.get(signal.name, NOT_AVAILABLE) for signal in message.signals}
        return bytes(message.encode(raw, scaling=False, padding=True, strict=False))
