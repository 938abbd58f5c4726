"""The text of a DBC file in statements, so that one message is read at a time and an unsound one harms no other.

cantools refuses a file for any statement that it cannot read, and takes minutes and gigabytes for absurd numbers. So it
gets the statements of one message, once their numbers are known to be sane; comments and most attributes are left out.
"""

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

MOST_DIGITS: Final = 4  # chosen: of a bit or a byte count; no message has ten thousand
MOST_SELECTED: Final = 65_536  # chosen: multiplexer values of a message: cantools takes some seconds for them

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
_WORD: Final = re.compile(r"\w+")
_LONG_NAME: Final = re.compile(
    r'\s*BA_\s+"(?:SystemMessageLongSymbol"\s+BO_\s+(\d+)|SystemSignalLongSymbol"\s+SG_\s+(\d+)\s+(\w+))\s+"([^"\n]+)"\s*;'
)
_SELECTS: Final = re.compile(r"\s*SG_MUL_VAL_\s+\d+\s+\w+\s+(\w+)")
_RANGE: Final = re.compile(r"\b0*(\d+)\s*-\s*0*(\d+)")
_LAST: Final = 'CM_ "";\n'  # cantools passes over a fault in the very last statement of a file
_DEFINED: Final = 'BA_DEF_ SG_ "SystemSignalLongSymbol" STRING;\n'
_NOT_SENT: Final = "VECTOR__INDEPENDENT_SIG_MSG"  # CANdb++ keeps signals of no message there


@dataclass(frozen=True, slots=True)
class DbcMessage:
    """The statements of one message; ``line`` is that of its BO_ in the file, counted from 1."""

    name: str
    frame_id: str
    line: int
    block: str
    others: tuple[str, ...]

    def text(self) -> str:
        """A database with this message alone. Raises ValueError for numbers that no message has."""
        number = _number(self.frame_id)
        if len(number) > 10 or int(number) >= 1 << 32:
            raise ValueError(f"{self.frame_id[:20]} is no identifier: 32 bits hold one")
        head = _MESSAGE.match(self.block)
        if head is not None and _is_absurd(head[3]):
            raise ValueError(f"it has {head[3][:20]} bytes: no message is so long")
        for name, start, length in _BITS.findall(self.block):
            if len(length.lstrip("0")) >= MOST_DIGITS:
                raise ValueError(f"signal {name!r} is longer than any message")
            if _is_absurd(start):
                raise ValueError(f"signal {name!r} begins at bit {start[:20]}: no message is so long")
        if _n_selected(self.others) > MOST_SELECTED:
            raise ValueError(f"SG_MUL_VAL_: its ranges name more than {MOST_SELECTED:,} multiplexer values")
        return "\n".join([self.block, *self.others, _LAST])


def messages_in(text: str) -> list[DbcMessage]:
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
            messages.append(DbcMessage(names.get(number, head[2]), head[1], line, statement, tuple(kept)))
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


def _is_absurd(digits: str) -> bool:
    return len(digits.lstrip("-0")) > MOST_DIGITS


def _n_selected(statements: Iterable[str]) -> float:
    """How many combinations of multiplexer values the SG_MUL_VAL_ statements of a message name, at most."""
    of_selector: Counter[str] = Counter()
    for statement in statements:
        if found := _SELECTS.match(statement):
            for low, high in _RANGE.findall(statement, found.end()):
                if len(low) > 10 or len(high) > 10:
                    return math.inf
                of_selector[found[1]] += max(0, int(high) - int(low) + 1)
    return math.prod(max(1, n) for n in of_selector.values())
