"""The roll rate that a signal map lacks although the pitch rate's message has it."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from gateway.bus.signals import MappedMessage, SignalMap
from gateway.bus.signals.mapping import MappedSignal
from gateway.offline.look.roles import ROLL, axis_of
from gateway.records import Signal

_AXES: Final = "xyz"
_CHECK: Final = "sign 1 or -1: it must go up as a bend to the left begins"
_BY_AXES: Final = "its sign by the right-hand rule from the two axes that are mapped"


def unmapped_roll_rate(signal_map: SignalMap) -> str | None:
    """The entry for the map; None if the map has a roll rate, or no name in the message suggests one.

    A name with "roll" takes precedence. Otherwise it is the third axis beside those of the vertical acceleration and of
    the pitch rate: forward = left x up, with left and up as these two are mapped.
    """
    pitch = next(_mapped(signal_map, Signal.PITCH_RATE), None)
    if pitch is None or Signal.ROLL_RATE in signal_map.signals:
        return None
    message, pitch_rate = pitch
    beside = [name for name in message.fields if name != pitch_rate.dbc_signal]
    named = [name for name in beside if ROLL.search(name) and "accel" not in name.lower()]
    if named:
        return _entry(message, named[0], _CHECK)
    up = next((signal for _, signal in _mapped(signal_map, Signal.VERTICAL_ACCELERATION)), None)
    axis, sign = _forward(up, pitch_rate) if up is not None else ("", 1)
    like_pitch = [name for name in beside if axis and _with_axis(pitch_rate.dbc_signal, axis) == name]
    return _entry(message, like_pitch[0], f"sign = {sign}, {_BY_AXES}") if like_pitch else None


def _mapped(signal_map: SignalMap, wanted: Signal) -> Iterator[tuple[MappedMessage, MappedSignal]]:
    for message in signal_map.messages:
        yield from ((message, signal) for signal in message.signals if signal.signal is wanted)


def _entry(message: MappedMessage, name: str, sign: str) -> str:
    return f'[signals.roll_rate] with message = "{message.name}", signal = "{name}", and {sign}'


def _forward(up: MappedSignal, pitch_rate: MappedSignal) -> tuple[str, int]:
    """The longitudinal axis and its sign; empty if the names of the two others do not give their axes."""
    up_axis, left_axis = axis_of(up.dbc_signal), axis_of(pitch_rate.dbc_signal)
    if not up_axis or not left_axis or up_axis == left_axis:
        return "", 1
    left, upward = (
        np.sign(signal.to_si) * np.eye(3)[_AXES.index(axis)]
        for signal, axis in ((pitch_rate, left_axis), (up, up_axis))
    )
    forward = np.cross(left, upward)
    at = int(np.argmax(np.abs(forward)))
    return _AXES[at], int(np.sign(forward[at]))


def _with_axis(name: str, axis: str) -> str:
    """The name of the same quantity about another axis: AngularRateZ and y give AngularRateY."""
    at = max(name.lower().rfind(each) for each in _AXES)
    return name[:at] + (axis.upper() if name[at].isupper() else axis) + name[at + 1 :]
