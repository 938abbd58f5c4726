"""Limits of KCD, SYM and ARXML files: cantools takes minutes and gigabytes for absurd numbers, and is not asked then.

A DBC is read message by message (dbc.py); these kinds are read as a whole, or refused as a whole.
"""

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from typing import Final
from xml.parsers import expat

MOST_BITS: Final = 100_000  # chosen: of a place, a length or a byte count; an ARXML may also describe Ethernet
LONG_BITS: Final = 4_096  # chosen: longer ones than this ...
MOST_LONG_BITS: Final = 1_000_000  # chosen: ... have so many in all
MOST_ELEMENTS: Final = 1_000_000  # chosen: of an XML file, some 100 MB in memory
MOST_NESTED: Final = 200  # chosen: elements in one another
MOST_SIGNALS: Final = 50_000  # chosen: of a file: cantools takes some seconds for them
MOST_GROUPS: Final = 2_000  # chosen: of a file: of multiplexers and packages cantools takes the square of their number
MOST_IDS: Final = 4_096  # chosen: of a range of identifiers of a .sym: each becomes a message
LONGEST_NUMBER: Final = 400  # chosen: digits; a double has 309 before its point
_MOST: Final[Mapping[str, int]] = {
    **dict.fromkeys(("Signal", "I-SIGNAL", "I-SIGNAL-TO-I-PDU-MAPPING", "Label", "COMPU-SCALE"), MOST_SIGNALS),
    **dict.fromkeys(("MuxGroup", "Multiplex", "AR-PACKAGE", "DYNAMIC-PART-ALTERNATIVE"), MOST_GROUPS),
}
_BITS_OF_KCD: Final = ("offset", "length")
_BITS_OF_ARXML: Final = ("LENGTH", "POSITION")
_DIGITS: Final = re.compile(rf"[0-9A-Fa-f]{{{LONGEST_NUMBER + 1}}}")
_TEXT_OR_OPTION: Final = re.compile(r'"[^"\n]*"|//.*|/\w+:\S*')
_LAYOUT: Final = re.compile(r"^[ \t]*(?:Sig|Mux|Var|Len)[ \t]*=(.*)$", re.MULTILINE | re.IGNORECASE)
_NUMBER: Final = re.compile(r"(?<![\w.])\d+(?![\w.])")
_RANGE: Final = re.compile(r"^[ \t]*ID[ \t]*=[ \t]*([0-9A-F]+)h[ \t]*-[ \t]*([0-9A-F]+)h", re.MULTILINE | re.IGNORECASE)


def require_sane(kind: str, text: str) -> None:
    """Raise ValueError for what no database of this kind holds."""
    if (found := _DIGITS.search(text)) is not None:
        raise ValueError(f"a number of more than {LONGEST_NUMBER} digits: {found[0][:20]}...")
    n_long = 0.0
    for name, number in _BITS[kind](text) if kind in _BITS else ():
        n_long += number if number > LONG_BITS else 0.0
        if number > MOST_BITS or n_long > MOST_LONG_BITS:
            raise ValueError(f"{name} is {number:.6g}: no message is so long")


def _of_sym(text: str) -> Iterator[tuple[str, float]]:
    """Places and lengths in bits, and lengths in bytes. Raises ValueError."""
    for first, last in _RANGE.findall(text):
        if int(last, 16) - int(first, 16) >= MOST_IDS:
            raise ValueError(f"ID={first}h-{last}h: a range of more than {MOST_IDS} identifiers")
    if len(lines := _LAYOUT.findall(text)) > MOST_SIGNALS:
        raise ValueError(f"more than {MOST_SIGNALS} signals")
    for line in lines:
        for number in _NUMBER.findall(_TEXT_OR_OPTION.sub(" ", line)):
            yield f"a place or length ({line.strip()[:40]})", float(number)


def _of_xml(text: str) -> Iterator[tuple[str, float]]:
    """The same of KCD's attributes and ARXML's elements. Raises ValueError; cantools says what is no XML."""
    numbers: list[tuple[str, float]] = []
    counts: Counter[str] = Counter()
    open_tags: list[str] = []
    said: list[str] = []

    def note(name: str, told: str) -> None:
        with suppress(ValueError):
            number = abs(float(int(told, 16) if "x" in told.lower() else told))
            if number > LONG_BITS:
                numbers.append((name, number))

    def begin(tag: str, attributes: Mapping[str, str]) -> None:
        name = tag.rpartition(":")[2]
        counts[name] += 1
        counts[""] += 1
        open_tags.append(name)
        said.clear()
        if len(open_tags) > MOST_NESTED or counts[""] > MOST_ELEMENTS:
            raise ValueError(f"more than {MOST_NESTED} elements in one another, or {MOST_ELEMENTS} in all")
        if counts[name] > _MOST.get(name, MOST_ELEMENTS):
            raise ValueError(f"more than {_MOST[name]} elements {name}")
        for attribute in _BITS_OF_KCD:
            if attribute in attributes:
                note(attribute, attributes[attribute])

    def hear(data: str) -> None:
        if open_tags[-1].endswith(_BITS_OF_ARXML):
            said.append(data)

    def end(tag: str) -> None:
        if said:
            note(open_tags[-1], "".join(said).strip())
            said.clear()
        open_tags.pop()

    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.StartElementHandler, parser.CharacterDataHandler, parser.EndElementHandler = begin, hear, end
    with suppress(expat.ExpatError):
        parser.Parse(text, True)
    yield from numbers


_BITS: Final[Mapping[str, Callable[[str], Iterator[tuple[str, float]]]]] = {
    "sym": _of_sym,
    **dict.fromkeys(("kcd", "arxml", "cdd"), _of_xml),
}
