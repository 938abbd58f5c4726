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
from cantools.database.errors import UnsupportedDatabaseFormatError

from gateway.bus.signals.bit_field import BitField, Coding
from gateway.bus.text import text_of
from gateway.errors import SignalMapError
from gateway.records import EXTENDED_ID
from gateway.toml_file import Read

_LONG_SIGNAL = re.compile(rb"^\s*SG_\s+(\w+)[^:\n]*:\s*\d+\s*\|\s*0*[1-9]\d{3,}\s*@", re.MULTILINE)
_FRAME_ID = re.compile(rb"^\s*BO_\s+0*(\d+)\s", re.MULTILINE)

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

    @property
    def limits(self) -> tuple[float, float]:
        """Least and greatest physical value: of the database, or of the bits if it gives no range."""
        if self.minimum is not None and self.maximum is not None and self.minimum < self.maximum:
            return float(self.minimum), float(self.maximum)
        return self.field.physical_range


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
            name = str(message.name)
            if name in messages:
                raise SignalMapError(
                    f"{map_path}: dbc: message {name!r} is in {messages[name].source.name} and in {path.name}; "
                    "list only one of them"
                )
            messages[name] = _message(message, path)
    return messages


def closest(name: str, known: Iterable[str]) -> str:
    """A hint for a misspelt name."""
    names = sorted(known)
    near = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    listed = ", ".join(names[:12]) + (", ..." if len(names) > 12 else "")
    return f"did you mean {near[0]!r}?" if near else f"there are {listed or 'none'}"


def _load(map_path: Path, path: Path, read: Read) -> list[CantoolsMessage]:
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
    except (UnsupportedDatabaseFormatError, cantools.Error, UnicodeDecodeError) as fault:
        raise SignalMapError(f"{map_path}: dbc: {path} cannot be read as a CAN database: {fault}") from None
    if not isinstance(database, cantools.database.can.Database):
        raise SignalMapError(f"{map_path}: dbc: {path} describes diagnostics; a DBC, KCD, ARXML or SYM is wanted")
    return list(database.messages)


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
        minimum=signal.minimum,
        maximum=signal.maximum,
        choices=choices,
        multiplexer=signal.multiplexer_signal,
        multiplexer_ids=tuple(signal.multiplexer_ids or ()),
    )
