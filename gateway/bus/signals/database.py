"""DBC databases, read by cantools message by message, reduced to what decoding needs."""

import difflib
import math
import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Final

import cantools
from cantools.database.can import Signal as CantoolsSignal

from gateway.bus.signals.bit_field import BitField, Coding
from gateway.bus.signals.dbc import DbcMessage, messages_in
from gateway.bus.text import text_of
from gateway.errors import SignalMapError
from gateway.records import EXTENDED_ID
from gateway.toml_file import Read

_LINE = re.compile(r" at line \d+, column \d+")  # of a message alone, which no reader sees

TOLD_CHARS: Final = 300  # chosen: of a fault that cantools describes, which may repeat a line of any length


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


class Databases:
    """The messages of several databases. One is read when it is asked for, so that an unsound one harms no other."""

    def __init__(self, map_path: Path, paths: Sequence[Path], read: Read = Path.read_bytes) -> None:
        """Raises SignalMapError naming ``map_path`` and a file that cannot be read."""
        self._map_path = map_path
        self._of_name: dict[str, list[tuple[Path, DbcMessage]]] = {}
        for path in paths:
            for message in self._messages_in(path, read):
                self._of_name.setdefault(message.name, []).append((path, message))

    @property
    def names(self) -> Collection[str]:
        return self._of_name.keys()

    def message(self, name: str) -> DatabaseMessage:
        """One of ``names``. Raises SignalMapError if it is unsound or not the only one of its name."""
        (path, message), *others = self._of_name[name]
        if others:
            places = f"in {path.name} and in {others[0][0].name}" if others[0][0] != path else f"twice in {path.name}"
            raise SignalMapError(f"{self._map_path}: dbc: message {name!r} is {places}; keep only one of them")
        return self._read(path, message)

    def sound(self) -> tuple[list[DatabaseMessage], list[str]]:
        """All messages that can be read, and why others cannot."""
        found, unsound = [], []
        for path, message in chain.from_iterable(self._of_name.values()):
            try:
                found.append(self._read(path, message))
            except SignalMapError as fault:
                unsound.append(str(fault))
        return found, unsound

    def _messages_in(self, path: Path, read: Read) -> list[DbcMessage]:
        """The text of every message of a database."""
        where = f"{self._map_path}: dbc: {path}"
        if path.suffix.lower() != ".dbc":
            raise SignalMapError(f"{where}: is no .dbc; cantools convert {path.name} {path.stem}.dbc makes one of it")
        try:
            found = messages_in(text_of(read(path)))
        except FileNotFoundError:
            raise SignalMapError(
                f"{self._map_path}: dbc: no such file: {path}; paths are relative to the map"
            ) from None
        except OSError as fault:
            raise SignalMapError(f"{self._map_path}: dbc: {fault}") from None
        if not found:
            raise SignalMapError(f"{where} cannot be read as a CAN database: it has no message (BO_)")
        return found

    def _read(self, path: Path, message: DbcMessage) -> DatabaseMessage:
        """The message as cantools understands it. Raises SignalMapError."""
        # not strict: databases with overlapping signals are common, and a field is checked when it is mapped
        database = cantools.database.can.Database(strict=False)
        try:
            database.add_dbc_string(message.text())
            (found,) = database.messages
        except Exception as fault:  # noqa: BLE001 - numbers beyond a double, texts that are none, a thousand brackets
            said = _LINE.sub("", str(fault) or type(fault).__name__)
            raise SignalMapError(
                f"{self._map_path}: dbc: {path}: message {message.name!r} in line {message.line} cannot be read: "
                f"{said[:TOLD_CHARS]}{'...' if len(said) > TOLD_CHARS else ''}"
            ) from None
        frame_id = found.frame_id | (EXTENDED_ID if found.is_extended_frame else 0)
        signals = {signal.name: _signal(signal) for signal in found.signals}
        twins = frozenset(name for name, n in Counter(signal.name for signal in found.signals).items() if n > 1)
        return DatabaseMessage(message.name, frame_id, found.length, signals, path, twins)


def closest(name: str, known: Iterable[str]) -> str:
    """A hint for a misspelt name."""
    names = sorted(known)
    near = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    listed = ", ".join(names[:12]) + (", ..." if len(names) > 12 else "")
    return f"did you mean {near[0]!r}?" if near else f"there are {listed or 'none'}"


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
