"""The signal map: which message and signal carries which motion, in which unit and with which sign.

A map with its DBC files comes in (``load_signal_map``); a ``Decoder`` turns frames into SI samples in ISO 8855 axes and
counts what it refuses, an ``Encoder`` does the inverse for the simulator. Units end at this border.
"""

from gateway.bus.signals.bit_field import Coding
from gateway.bus.signals.database import DatabaseMessage, Databases, DatabaseSignal
from gateway.bus.signals.decode import Decoder, is_j1939_code
from gateway.bus.signals.encode import Encoder
from gateway.bus.signals.mapping import (
    CAN_FD_BYTES,
    CLASSIC_BYTES,
    EVERY_IDENTIFIER,
    IdFilter,
    MappedMessage,
    SignalMap,
    id_name,
    j1939_filter,
)
from gateway.bus.signals.signal_map import (
    SHIPPED_PREFIX,
    SignalMapFile,
    load_signal_map,
    shipped_databases,
    shipped_map,
    shipped_maps,
    unsound_messages,
)

__all__ = [
    "CAN_FD_BYTES",
    "CLASSIC_BYTES",
    "EVERY_IDENTIFIER",
    "SHIPPED_PREFIX",
    "Coding",
    "DatabaseMessage",
    "DatabaseSignal",
    "Databases",
    "Decoder",
    "Encoder",
    "IdFilter",
    "MappedMessage",
    "SignalMap",
    "SignalMapFile",
    "id_name",
    "is_j1939_code",
    "j1939_filter",
    "load_signal_map",
    "shipped_databases",
    "shipped_map",
    "shipped_maps",
    "unsound_messages",
]
