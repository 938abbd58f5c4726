"""CAN databases through cantools, reduced to what decoding needs. The only module of the room that imports cantools."""

import difflib
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import cantools
from cantools.database.can import Message as CantoolsMessage
from cantools.database.can import Signal as CantoolsSignal

from gateway.bus.signals.bit_field import BitField, Coding
from gateway.bus.text import text_of
from gateway.errors import SignalMapError
from gateway.records import EXTENDED_ID
from gateway.toml_file import Read

# possessive, and never over the end of a line: each takes time in proportion to the file
_LONG_SIGNAL = re.compile(
    rb"^[ \t]*+SG_[ \t]++(\w++)[^:\r\n]*+:[ \t]*+\d++[ \t]*+\|[ \t]*+0*+\d{4,}+[ \t]*+@", re.MULTILINE
)
_FRAME_ID = re.compile(rb"^[ \t]*+BO_[ \t]++0*+(\d++)\s", re.MULTILINE)
MOST_TOLD: Final = 300  # chosen: characters of a parser's message, which may quote the whole file

KINDS: Final = ("dbc", "sym", "kcd", "arxml", "cdd")


@dataclass(frozen=True, slots=True)
class DatabaseSignal:
    """One signal as its database states it; ``multiplexer`` names the signal whose ``multiplexer_ids`` select it."""

    name: str
    field: BitField
    unit: str | None
    minimum: float | None
    maximum: float | None
    choices: Mapping[str, tuple[int, ...]]
    multiplexer: str | None
    multiplexer_ids: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class DatabaseMessage:
    """One message; ``frame_id`` carries EXTENDED_ID for a 29-bit identifier, ``twins`` are names of several signals."""

    name: str
    frame_id: int
    length: int
    signals: Mapping[str, DatabaseSignal]
    source: Path
    twins: frozenset[str] = frozenset()


def load_messages(map_path: Path, paths: Sequence[Path], read: Read = Path.read_bytes) -> dict[str, DatabaseMessage]:
    """Every message of the databases by name. Raises SignalMapError naming ``map_path`` and the file at fault."""
    messages: dict[str, DatabaseMessage] = {}
    for path in paths:
        for message in _load(map_path, path, read):
            if message.name in messages:
                raise SignalMapError(
                    f"{map_path}: dbc: message {message.name!r} is in {messages[message.name].source.name} and in "
                    f"{path.name}; list only one of them"
                )
            messages[message.name] = message
    return messages


def closest(name: str, known: Iterable[str]) -> str:
    """A hint for a misspelt name."""
    names = sorted(known)
    near = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    listed = ", ".join(names[:12]) + (", ..." if len(names) > 12 else "")
    return f"did you mean {near[0]!r}?" if near else f"there are {listed or 'none'}"


def _load(map_path: Path, path: Path, read: Read) -> list[DatabaseMessage]:
    """The messages of one file. Whatever its content makes cantools or the conversion raise is its own fault."""
    if not path.is_file():
        raise SignalMapError(f"{map_path}: dbc: no such file: {path}; paths are relative to the map")
    kind = path.suffix.removeprefix(".").lower()
    if kind not in KINDS:
        raise SignalMapError(f"{map_path}: dbc: {path}: its name must end in .{', .'.join(KINDS)}")
    try:
        content = read(path)
    except OSError as fault:
        raise SignalMapError(f"{map_path}: dbc: {fault}") from None
    _refuse_absurd(map_path, path, content)
    try:
        # not strict: vendors' databases with overlapping signals are common, and a field is checked when it is mapped
        database = cantools.database.load_string(text_of(content), kind, strict=False)
        if isinstance(database, cantools.database.can.Database):
            return [_message(message, path) for message in database.messages]
    except Exception as fault:  # noqa: BLE001 - numbers beyond a double, texts that are none, a thousand brackets
        told = f"{str(fault) or type(fault).__name__:.{MOST_TOLD}}"
        raise SignalMapError(f"{map_path}: dbc: {path} cannot be read as a CAN database: {told}") from None
    raise SignalMapError(f"{map_path}: dbc: {path} describes diagnostics; a DBC, KCD, ARXML or SYM is wanted")


def _refuse_absurd(map_path: Path, path: Path, text: bytes) -> None:
    """cantools takes a minute for a signal of a billion bits, and cuts an identifier of 33 bits down to another."""
    long = _LONG_SIGNAL.search(text)
    if long is not None:
        raise SignalMapError(f"{map_path}: dbc: {path}: signal {long[1].decode()!r} is longer than any message")
    for found in _FRAME_ID.finditer(text):
        if len(found[1]) > 10 or int(found[1]) >= 1 << 32:
            raise SignalMapError(
                f"{map_path}: dbc: {path}: {found[1][:20].decode()} is no identifier: 32 bits hold one"
            )


def _message(message: CantoolsMessage, path: Path) -> DatabaseMessage:
    frame_id = message.frame_id | (EXTENDED_ID if message.is_extended_frame else 0)
    signals = {signal.name: _signal(signal) for signal in message.signals}
    twins = frozenset(name for name, n in Counter(signal.name for signal in message.signals).items() if n > 1)
    return DatabaseMessage(message.name, frame_id, message.length, signals, path, twins)


def _signal(signal: CantoolsSignal) -> DatabaseSignal:
    conversion = signal.conversion
    choices: dict[str, tuple[int, ...]] = {}
    for raw, text in (conversion.choices or {}).items():
        choices[str(text)] = (*choices.get(str(text), ()), int(raw))
    coding = Coding.FLOAT if conversion.is_float else Coding.SIGNED if signal.is_signed else Coding.UNSIGNED
    field = BitField(
        start=signal.start,
        length=signal.length,
        is_big_endian=signal.byte_order == "big_endian",
        coding=coding,
        scale=float(conversion.scale),
        offset=float(conversion.offset),
    )
    return DatabaseSignal(
        name=signal.name,
        field=field,
        unit=signal.unit,
        minimum=None if signal.minimum is None else float(signal.minimum),
        maximum=None if signal.maximum is None else float(signal.maximum),
        choices=choices,
        multiplexer=signal.multiplexer_signal,
        multiplexer_ids=tuple(signal.multiplexer_ids or ()),
    )
