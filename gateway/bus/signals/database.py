"""CAN databases through cantools, reduced to what decoding needs. The only module of the room that imports cantools."""

import difflib
import math
import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Final

import cantools
from cantools.database.can import Message as CantoolsMessage
from cantools.database.can import Signal as CantoolsSignal

from gateway.bus.signals.bit_field import BitField, Coding
from gateway.bus.signals.dbc import DbcMessage, messages_in
from gateway.bus.signals.sane import require_sane
from gateway.bus.text import text_of
from gateway.errors import SignalMapError
from gateway.records import EXTENDED_ID
from gateway.toml_file import Read

_LINE = re.compile(r" at line \d+, column \d+")  # of a message alone, which no reader sees

TOLD_CHARS: Final = 300  # chosen: of a fault that cantools describes, which may repeat a line of any length
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
        if self.minimum is not None and self.maximum is not None and -math.inf < self.minimum < self.maximum < math.inf:
            return self.minimum, self.maximum
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


ReadMessage = Callable[[], DatabaseMessage]


class Databases:
    """The messages of several databases. One is read when it is asked for, so that an unsound one harms no other."""

    def __init__(self, map_path: Path, paths: Sequence[Path], read: Read = Path.read_bytes) -> None:
        """Raises SignalMapError naming ``map_path`` and a file that cannot be read."""
        self._map_path = map_path
        self._of_name: dict[str, list[tuple[Path, ReadMessage]]] = {}
        for path in paths:
            for name, message in _messages(map_path, path, read):
                self._of_name.setdefault(name, []).append((path, message))

    @property
    def names(self) -> Collection[str]:
        return self._of_name.keys()

    def message(self, name: str) -> DatabaseMessage:
        """One of ``names``. Raises SignalMapError if it is unsound or not the only one of its name."""
        (path, message), *others = self._of_name[name]
        if others:
            places = f"in {path.name} and in {others[0][0].name}" if others[0][0] != path else f"twice in {path.name}"
            raise SignalMapError(f"{self._map_path}: dbc: message {name!r} is {places}; keep only one of them")
        return message()

    def sound(self) -> tuple[list[DatabaseMessage], list[str]]:
        """All messages that can be read, and why others cannot."""
        found, unsound = [], []
        for _, message in chain.from_iterable(self._of_name.values()):
            try:
                found.append(message())
            except SignalMapError as fault:
                unsound.append(str(fault))
        return found, unsound


def closest(name: str, known: Iterable[str]) -> str:
    """A hint for a misspelt name."""
    names = sorted(known)
    near = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    listed = ", ".join(names[:12]) + (", ..." if len(names) > 12 else "")
    return f"did you mean {near[0]!r}?" if near else f"there are {listed or 'none'}"


def _messages(map_path: Path, path: Path, read: Read) -> Iterator[tuple[str, ReadMessage]]:
    """Names of the messages of a database, and how each is read."""
    where = f"{map_path}: dbc: {path}"
    if not path.is_file():
        raise SignalMapError(f"{map_path}: dbc: no such file: {path}; paths are relative to the map")
    kind = path.suffix.removeprefix(".").lower()
    if kind not in KINDS:
        raise SignalMapError(f"{where}: its name must end in .{', .'.join(KINDS)}")
    try:
        text = text_of(read(path))
    except OSError as fault:
        raise SignalMapError(f"{map_path}: dbc: {fault}") from None
    if kind != "dbc":
        for message in _loaded(f"{where} cannot be read as a CAN database", text, kind):
            yield str(message.name), partial(_message, message, path)
        return
    found = messages_in(text)
    if not found:
        raise SignalMapError(f"{where} cannot be read as a CAN database: it has no message (BO_)")
    for one in found:
        yield one.name, partial(_dbc_message, where, one, path)


def _loaded(where: str, text: str, kind: str) -> list[CantoolsMessage]:
    try:
        require_sane(kind, text)
        # not strict: vendors' databases with overlapping signals are common, and a field is checked when it is mapped
        database = cantools.database.load_string(text, kind, strict=False)
    except Exception as fault:  # noqa: BLE001 - numbers beyond a double, texts that are none, a thousand brackets
        said = str(fault) or type(fault).__name__
        said = _LINE.sub("", said) if kind == "dbc" else said
        raise SignalMapError(f"{where}: {said[:TOLD_CHARS]}{'...' if len(said) > TOLD_CHARS else ''}") from None
    if not isinstance(database, cantools.database.can.Database):
        raise SignalMapError(f"{where}: it describes diagnostics; a DBC, KCD, ARXML or SYM is wanted")
    return list(database.messages)


def _dbc_message(where: str, one: DbcMessage, path: Path) -> DatabaseMessage:
    told = f"{where}: message {one.name!r} in line {one.line} cannot be read"
    try:
        (message,) = _loaded(told, one.text(), "dbc")
    except ValueError as fault:
        raise SignalMapError(f"{told}: {fault}") from None
    return replace(_message(message, path), name=one.name)


def _message(message: CantoolsMessage, path: Path) -> DatabaseMessage:
    frame_id = message.frame_id | (EXTENDED_ID if message.is_extended_frame else 0)
    signals = {signal.name: _signal(signal) for signal in message.signals}
    twins = frozenset(name for name, n in Counter(signal.name for signal in message.signals).items() if n > 1)
    return DatabaseMessage(message.name, frame_id, message.length, signals, path, twins)


def _signal(signal: CantoolsSignal) -> DatabaseSignal:
    conversion = signal.conversion
    choices: dict[str, tuple[int, ...]] = {}
    for raw, text in (conversion.choices or {}).items():
        if math.isfinite(raw):
            choices[str(text)] = (*choices.get(str(text), ()), int(raw))
    coding = Coding.FLOAT if conversion.is_float else Coding.SIGNED if signal.is_signed else Coding.UNSIGNED
    field = BitField(
        start=signal.start,
        length=signal.length,
        is_big_endian=signal.byte_order == "big_endian",
        coding=coding,
        scale=_float(conversion.scale),
        offset=_float(conversion.offset),
    )
    return DatabaseSignal(
        name=signal.name,
        field=field,
        unit=signal.unit,
        minimum=None if signal.minimum is None else _float(signal.minimum),
        maximum=None if signal.maximum is None else _float(signal.maximum),
        choices=choices,
        multiplexer=signal.multiplexer_signal,
        multiplexer_ids=tuple(signal.multiplexer_ids or ()),
    )


def _float(number: int | float) -> float:
    """The number; an integer beyond a double is infinite."""
    try:
        return float(number)
    except OverflowError:
        return math.inf if number > 0 else -math.inf
