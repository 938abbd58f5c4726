"""DBC databases, read by cantools message by message, so that an unsound one harms no other.

cantools refuses a file for any statement that it cannot read, and takes minutes and gigabytes for absurd numbers. So it
gets the statements of one message, once their numbers are known to be sane; comments and most attributes are left out.
"""

import difflib
import math
import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Final

import cantools
from cantools.database.can import Signal as CantoolsSignal

from gateway.bus.frames import LAST_EXTENDED, LAST_STANDARD
from gateway.bus.signals.bit_field import BitField, Coding
from gateway.bus.text_encoding import text_of
from gateway.errors import SignalMapError
from gateway.files.toml_file import Read
from gateway.records import EXTENDED_ID

TOLD_CHARS: Final = 300  # chosen: of a fault that cantools describes, which may repeat a line of any length
MOST_DIGITS: Final = 4  # chosen: of a bit or a byte count; no message has ten thousand
MOST_SELECTED: Final = 65_536  # chosen: multiplexer values of a message: cantools takes some seconds for them

_LINE: Final = re.compile(r" at line \d+, column \d+")  # of a message alone, which no reader sees
_KEYWORD: Final = (
    r"(?:BO_TX_BU_|BO_|BU_\w*|BS_|NS_\w*|CM_|BA_\w*|VAL_\w*|EV_\w*|SIG_\w*|SG_MUL_VAL_|SGTYPE_\w*|CAT_\w*|"
    r"ENVVAR_DATA_|FILTER|VERSION)(?=[\s:])"
)
_BEGINS: Final = rf"(?:^|(?<=;))[ \t]*({_KEYWORD})"
_BEGIN: Final = re.compile(_BEGINS, re.MULTILINE)
# A comment may contain anything. The optional quotes let a string without an end match as well, in one pass.
_BEGIN_OR_STRING: Final = re.compile(rf'"(?:[^"\\]+|\\"?)*"?|//[^\n]*|{_BEGINS}', re.MULTILINE)
_SWALLOWED: Final = re.compile(rf'\n[ \t]*(?:SG_\s|{_KEYWORD})[^\n]*"\Z')
_MESSAGE: Final = re.compile(r"\s*BO_\s+(\d+)\s+([^\s:]+)\s*:\s*(-?\d*)")
_SIGNAL: Final = re.compile(r"\bSG_\s+(\w+)")
_BITS: Final = re.compile(r"\bSG_\s+(\w+)(?:\s+\w+)?\s*:\s*(-?\d+)\s*\|\s*(\d+)")
_OF_MESSAGE: Final = re.compile(r"\s*(VAL_|SIG_VALTYPE_|SG_MUL_VAL_)\s+(\d+)\s+(\w+)")
_ABOUT_MESSAGE: Final = re.compile(r"\s*(?:SIG_VALTYPE_|SG_MUL_VAL_)\s+\S")
_STRING: Final = re.compile(r'"[^"]*"')
_WORD: Final = re.compile(r"\w+")
_LONG_NAME: Final = re.compile(
    r'\s*BA_\s+"(?:SystemMessageLongSymbol"\s+BO_\s+(\d+)|SystemSignalLongSymbol"\s+SG_\s+(\d+)\s+(\w+))\s+"([^"\n]+)"\s*;'
)
_SELECTS: Final = re.compile(r"\s*SG_MUL_VAL_\s+\d+\s+\w+\s+(\w+)(.*)", re.DOTALL)
_RANGE: Final = re.compile(r"(\d+)\s*-\s*(\d+)")
_LAST: Final = 'CM_ "";\n'  # cantools passes over a fault in the very last statement of a file
_DEFINED: Final = 'BA_DEF_ SG_ "SystemSignalLongSymbol" STRING;\n'
_NOT_SENT: Final = "VECTOR__INDEPENDENT_SIG_MSG"  # CANdb++ keeps signals of no message there


@dataclass(frozen=True, slots=True)
class DatabaseSignal:
    """One signal as its database states it; ``multiplexer`` names the signal whose ``multiplexer_ids`` select it."""

    name: str
    field: BitField
    unit: str | None
    limits: tuple[float, float]  # least and greatest physical value: stated, or what the bits can carry
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


@dataclass(frozen=True, slots=True)
class _Statements:
    """The statements of one message; ``line`` is that of its BO_ in the file, counted from 1."""

    name: str
    number: str
    line: int
    block: str
    others: tuple[str, ...]


class Databases:
    """The messages of several databases. One is read when it is asked for."""

    def __init__(self, map_path: Path, paths: Sequence[Path], read: Read = Path.read_bytes) -> None:
        """Raises SignalMapError naming ``map_path`` and a file that cannot be read."""
        self._map_path = map_path
        self._of_name: dict[str, list[tuple[Path, _Statements]]] = {}
        for path in paths:
            where = f"{map_path}: dbc: {path}"
            if path.suffix.lower() != ".dbc":
                hint = f"cantools convert {path.name} {path.stem}.dbc makes one of it"
                raise SignalMapError(f"{where}: is no .dbc; {hint}")
            try:
                found = _messages_in(text_of(read(path)))
            except FileNotFoundError:
                raise SignalMapError(f"{map_path}: dbc: no such file: {path}; paths are relative to the map") from None
            except OSError as fault:
                raise SignalMapError(f"{map_path}: dbc: {fault}") from None
            if not found:
                raise SignalMapError(f"{where} cannot be read as a CAN database: it has no message (BO_)")
            for message in found:
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

    def _read(self, path: Path, message: _Statements) -> DatabaseMessage:
        try:
            return _read_by_cantools(message, path)
        except Exception as fault:  # noqa: BLE001 - numbers beyond a double, texts that are none, a thousand brackets
            said = _LINE.sub("", _without_end(message) or str(fault) or type(fault).__name__)
            raise SignalMapError(
                f"{self._map_path}: dbc: {path}: message {message.name!r} in line {message.line} cannot be read: "
                f"{said[:TOLD_CHARS]}{'...' if len(said) > TOLD_CHARS else ''}"
            ) from None


def closest(name: str, known: Iterable[str]) -> str:
    """A hint for a misspelt name."""
    names = sorted(known)
    near = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    listed = ", ".join(names[:12]) + (", ..." if len(names) > 12 else "")
    return f"did you mean {near[0]!r}?" if near else f"there are {listed or 'none'}"


def _read_by_cantools(message: _Statements, path: Path) -> DatabaseMessage:
    _require_sane(message)
    # not strict: databases with overlapping signals are common, and a field is checked when it is mapped
    database = cantools.database.can.Database(strict=False)
    database.add_dbc_string("\n".join([message.block, *message.others, _LAST]))
    (found,) = database.messages
    return DatabaseMessage(
        name=message.name,
        frame_id=found.frame_id | (EXTENDED_ID if found.is_extended_frame else 0),
        length=found.length,
        signals={signal.name: _signal(signal) for signal in found.signals},
        source=path,
        twins=frozenset(name for name, n in Counter(signal.name for signal in found.signals).items() if n > 1),
    )


def _signal(signal: CantoolsSignal) -> DatabaseSignal:
    conversion = signal.conversion
    choices: dict[str, tuple[int, ...]] = {}
    for raw, text in (conversion.choices or {}).items():
        choices[str(text)] = (*choices.get(str(text), ()), int(raw))
    # of a text, for an integer beyond a double is infinite
    scale, offset = float(str(conversion.scale)), float(str(conversion.offset))
    coding = Coding.FLOAT if conversion.is_float else Coding.SIGNED if signal.is_signed else Coding.UNSIGNED
    field = BitField(signal.start, signal.length, signal.byte_order == "big_endian", coding, scale, offset)
    low, high = (math.nan if end is None else float(str(end)) for end in (signal.minimum, signal.maximum))
    return DatabaseSignal(
        name=signal.name,
        field=field,
        unit=signal.unit,
        limits=(low, high) if -math.inf < low < high < math.inf else field.physical_range,
        choices=choices,
        multiplexer=signal.multiplexer_signal,
        multiplexer_ids=tuple(signal.multiplexer_ids or ()),
    )


def _require_sane(message: _Statements) -> None:
    """Raise ValueError for numbers that no message has."""
    if len(message.number) > 10 or int(message.number) >= 1 << 32:
        raise ValueError(f"{message.number[:20]} is no identifier: 32 bits hold one")
    if LAST_STANDARD < (number := int(message.number)) <= LAST_EXTENDED:
        raise ValueError(f"{number} is no identifier of 11 bits; a DBC writes one of 29 bits as {number | EXTENDED_ID}")
    head = _MESSAGE.match(message.block)
    if head is not None and _is_absurd(head[3]):
        raise ValueError(f"it has {head[3][:20]} bytes: no message is so long")
    for name, start, length in _BITS.findall(message.block):
        if _is_absurd(start) or _is_absurd(length):
            raise ValueError(f"signal {name!r} is longer than any message: it has {length[:20]} bits from {start[:20]}")
    n_selected: Counter[str] = Counter()
    for found in filter(None, map(_SELECTS.match, message.others)):
        for low, high in _RANGE.findall(found[2]):
            n_selected[found[1]] += max(1, int(high) - int(low) + 1)
    if math.prod(n_selected.values()) > MOST_SELECTED:
        raise ValueError(f"SG_MUL_VAL_: its ranges name more than {MOST_SELECTED:,} multiplexer values")


def _without_end(message: _Statements) -> str | None:
    """What is wrong if a statement lacks its end: cantools finds fault with the next one."""
    unended = next((one for one in message.others if ";" not in _STRING.sub("", one)), None)
    return None if unended is None else f"{unended.strip().splitlines()[0]!r} does not end with a semicolon"


def _is_absurd(digits: str) -> bool:
    return len(digits.lstrip("-0")) > MOST_DIGITS


def _messages_in(text: str) -> list[_Statements]:
    """Every message of a DBC file, in order, under the name that its attributes give it.

    A statement about a message that cannot be attributed by its form goes to every message of whose signals or
    identifier it speaks: better refused than read in part.
    """
    blocks: list[tuple[int, str, re.Match[str]]] = []
    others: dict[str, list[tuple[str | None, str]]] = {}  # by identifier, or word; with the signal that must be there
    names: dict[str, str] = {}
    for start, statement in _statements(text):
        if head := _MESSAGE.match(statement):
            blocks.append((start, statement, head))
        elif found := _OF_MESSAGE.match(statement):
            needed = found[3] if found[1] == "VAL_" else None
            others.setdefault(_number(found[2]), []).append((needed, statement))
        elif found := _LONG_NAME.match(statement):
            if found[1]:
                names[_number(found[1])] = found[4]
            else:
                others.setdefault(_number(found[2]), []).append((found[3], _DEFINED + statement))
        elif _ABOUT_MESSAGE.match(statement):
            for word in {*_WORD.findall(statement)}:
                others.setdefault(word, []).append((None, statement))
    messages, line, counted = [], 1, 0
    for start, statement, head in blocks:
        line, counted = line + text.count("\n", counted, start), start
        number, signals = _number(head[1]), dict.fromkeys(_SIGNAL.findall(statement))
        mine = [other for word in (number, *signals) for other in others.get(word, ())]
        kept = dict.fromkeys(other for needed, other in mine if needed is None or needed in signals)
        if head[2] != _NOT_SENT:
            messages.append(_Statements(names.get(number, head[2]), number, line, statement, tuple(kept)))
    return messages


def _number(digits: str) -> str:
    return digits.lstrip("0") or "0"


def _statements(text: str) -> Iterator[tuple[int, str]]:
    """Each statement with its place; what comes before the first is left out.

    A string that swallows the beginning of another statement lacks its end: it ends with its first line.
    """
    pieces, begin, at = _BEGIN_OR_STRING, -1, 0
    while (piece := pieces.search(text, at)) is not None:
        at = piece.end()
        if piece[1] is not None:
            if begin >= 0:
                yield begin, text[begin : piece.start()]
            begin = piece.start()
        elif "\n" in piece[0]:
            if not piece[0].endswith('"'):
                pieces = _BEGIN  # no string after this one has an end either
            if pieces is _BEGIN or _SWALLOWED.search(piece[0]):
                at = text.index("\n", piece.start())
    if begin >= 0:
        yield begin, text[begin:]
