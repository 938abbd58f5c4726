"""The signal map: which message and signal carries which motion, in which unit and with which sign.

A map with its DBC files comes in (``load_signal_map``); a ``Decoder`` turns frames into SI samples in ISO 8855 axes and
counts what it refuses, an ``Encoder`` does the inverse for the simulator. Units end at this border.
"""

from gateway.bus.signals.decode import Decoder
from gateway.bus.signals.encode import Encoder
from gateway.bus.signals.mapping import SignalMap
from gateway.bus.signals.signal_map import SHIPPED_PREFIX, load_signal_map, shipped_map

__all__ = ["SHIPPED_PREFIX", "Decoder", "Encoder", "SignalMap", "load_signal_map", "shipped_map"]
