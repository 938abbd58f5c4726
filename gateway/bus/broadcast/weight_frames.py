"""Weights as frames of SAE J1939: VW, one an axle, and CVW, laid out and scaled by dbc/j1939_weights.dbc."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import Any, Final

import cantools
import numpy as np

from gateway.estimate import Estimate
from gateway.records import EXTENDED_ID, Frames

DATABASE: Final = "j1939_weights.dbc"
# SAE J1939-71, table 1, numbers of two bytes
NOT_AVAILABLE: Final = 0xFFFF
ERROR: Final = 0xFE00  # here: more than two bytes can say
LAST_NUMBER: Final = 0xFAFF
WHOLE_AXLE: Final = 0xF  # where four bits would name a tyre
_PRIORITY_SHIFT: Final = 26
_GROUP: Final = 0x3FFFF00  # the bits of an identifier that name the parameter group


@dataclass(frozen=True, slots=True)
class Sender:
    """Who sends, and how urgently (SAE J1939-21, 5.2). The front axle has the number ``first_axle``.

    What a vehicle draws its springs do not tell: with ``draws_trailers`` the combination's weight stays unknown.
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
        """Frames (3,) stamped ``t_ns``; every number is "not available" where ``shown`` does not know it, or is None.

        An early look at a batch is not sent: a bus has no word for "provisional". A payload that an estimate finds a
        little below nothing is sent as 0.
        """
        weighed = Estimate(0, 0, "") if shown is None or shown.is_provisional else shown
        weights, first = weighed.weights, self._sender.first_axle
        cargo_kg = weighed.payload.number
        cargo_kg = 0.0 if cargo_kg < 0.0 else cargo_kg
        messages = [
            ("VW", first, {"AxleWeight": weights.front_axle.kg, "CargoWeight": cargo_kg}),
            ("VW", first + 1, {"AxleWeight": weights.rear_axle.kg, "CargoWeight": cargo_kg}),
            (
                "CVW",
                None,
                {
                    "PoweredVehicleWeight": weights.gross.kg,
                    "GrossCombinationVehicleWeight": math.nan if self._sender.draws_trailers else weights.gross.kg,
                },
            ),
        ]
        payload = np.frombuffer(b"".join(self._encoded(*message) for message in messages), np.uint8).reshape(-1, 8)
        can_id = [self._identifier(name) for name, _, _ in messages]
        n = len(messages)
        return Frames(np.full(n, t_ns, np.int64), np.array(can_id, np.uint32), np.full(n, 8, np.uint8), payload)

    def _identifier(self, name: str) -> int:
        group: int = self._database.get_message_by_name(name).frame_id & _GROUP
        return self._sender.priority << _PRIORITY_SHIFT | group | self._sender.source_address | EXTENDED_ID

    def _encoded(self, name: str, axle: int | None, weights_kg: Mapping[str, float]) -> bytes:
        """The eight bytes; bits that belong to nothing are set, as J1939 has it."""
        message = self._database.get_message_by_name(name)
        places = {} if axle is None else {"TireLocation": WHOLE_AXLE, "AxleLocation": axle}
        raw = {
            signal.name: places.get(signal.name, _raw(weights_kg.get(signal.name, math.nan), float(signal.scale)))
            for signal in message.signals
        }
        return bytes(message.encode(raw, scaling=False, padding=True, strict=False))


def _raw(weight_kg: float, kg_per_bit: float) -> int:
    if math.isnan(weight_kg):
        return NOT_AVAILABLE
    raw = round(weight_kg / kg_per_bit)
    return raw if 0 <= raw <= LAST_NUMBER else ERROR
