"""KCD, SYM and ARXML files of absurd numbers or sizes: read or refused in words, within seconds and 300 MB."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Final

import cantools
import pytest
from support.databases import SomeMessage, SomeSignal, arxml
from support.spoiled import refusal_of

from gateway.bus.signals import Databases, shipped_map
from gateway.errors import SignalMapError

_DATABASE: Final = cantools.database.load_file(
    shipped_map("reference").with_name("springscale_reference.dbc"), strict=False
)
AXIS: Final = SomeSignal("AccelZ", 7, 16, "m/s^2", 0.001, is_signed=True, is_big_endian=True, minimum=-30.0)
WHOLE: Final = {
    "kcd": _DATABASE.as_kcd_string(),
    "sym": _DATABASE.as_sym_string(),
    "arxml": arxml((SomeMessage("IMU", 0x120, 8, [AXIS]),)),
}
HUGE: Final = "9" * 5000
MESSAGE: Final = '<Message id="0x120" name="IMU_ACCEL" length="8" interval="10">'
BUS: Final = '<Bus name="Bus">'
DEEP: Final = "<AR-PACKAGE><AR-PACKAGES>"


def instead(old: str, new: str) -> Callable[[str], str]:
    """Puts one thing in the place of another, once."""
    return lambda text: text.replace(old, new, 1)


def behind(mark: str, more: str) -> Callable[[str], str]:
    return instead(mark, mark + more)


def groups(n: int) -> str:
    inner = "".join(f'<MuxGroup count="{i}"><Signal name="s{i}" offset="8" length="8"/></MuxGroup>' for i in range(n))
    return f'<Multiplex name="M" offset="0" length="8">{inner}</Multiplex>'


REFUSED: Final[dict[str, tuple[str, Callable[[str], str], str]]] = {  # the first eight took gigabytes and half a minute
    "a length of a billion bits": ("kcd", instead('length="16"', 'length="1000000000"'), "length is 1e"),
    "a place a billion bits away": ("kcd", instead('offset="16"', 'offset="1000000000"'), "offset is 1e"),
    "a number in another spelling": ("kcd", instead('offset="16"', 'offset="1&#48;00000000"'), "offset is 1e"),
    "a signal of a billion bits": ("sym", instead("signed 16", "signed 1000000000"), "place or length"),
    "a signal a billion bits away": ("sym", instead('"AccelX" 0', '"AccelX" 1000000000'), "place or length"),
    "a multiplexer of a billion bits": ("sym", instead("Len=8", 'Len=8\nMux="m" 0,1000000000 1h'), "place or length"),
    "lengths of a billion": ("arxml", lambda text: re.sub(r"<LENGTH>\d+", "<LENGTH>1000000000", text), "LENGTH is 1e"),
    "twenty thousand groups": ("kcd", behind(MESSAGE, groups(20_000)), "more than 2000 elements MuxGroup"),
    "a hundred thousand packages": (
        "arxml", behind("<AR-PACKAGES>", "<AR-PACKAGE><SHORT-NAME>a</SHORT-NAME></AR-PACKAGE>" * 100_000),
        "more than 2000 elements AR-PACKAGE",
    ),
    "packages in one another": ("arxml", behind("<AR-PACKAGES>", DEEP * 5000), "elements in one another"),
    "a hundred thousand signals": (
        "kcd", behind(MESSAGE, '<Signal name="s" offset="8" length="8"/>' * 100_000), "more than 50000 elements Signal"
    ),
    "half a billion identifiers": ("sym", instead("ID=120h", "ID=00000000h-1FFFFFFFh"), "range of more than"),
    "a long message in every line": (
        "kcd", behind(BUS, '<Message id="1" name="m" length="90000"/>' * 1000), "length is 90000"
    ),
    "an identifier of thousands of digits": ("kcd", instead('id="0x120"', f'id="0x{HUGE}"'), "more than 400 digits"),
    "a million digits": ("sym", lambda text: text + "1" * 1_000_000, "more than 400 digits"),
    "a raw value beyond a double": ("sym", instead('0="none"', f'{HUGE}="none"'), "more than 400 digits"),
    "names that name each other": (
        "kcd",
        lambda text: '<!DOCTYPE l [<!ENTITY a "b c d e">' + "".join(
            f'<!ENTITY {chr(98 + i)} "{f"&{chr(97 + i)};" * 10}">' for i in range(9)
        ) + "]>" + text.replace('name="IMU_ACCEL"', 'name="&j;"'),
        "amplification",
    ),
}  # fmt: skip


def read(path: Path) -> None:
    found, unsound = Databases(path, [path]).sound()
    assert found
    assert not unsound
    assert all(signal.limits for message in found for signal in message.signals.values())


@pytest.mark.parametrize("what", REFUSED)
def test_a_database_of_absurd_numbers_or_sizes_is_refused_in_words(what: str, tmp_path: Path) -> None:
    kind, spoil, said = REFUSED[what]
    path = tmp_path / f"a.{kind}"
    path.write_text(WHOLE[kind])
    assert refusal_of(SignalMapError, lambda: read(path)) is None
    path.write_text(spoil(WHOLE[kind]))
    refused = refusal_of(SignalMapError, lambda: read(path))
    assert refused is not None
    assert said in refused
    assert refused.startswith(f"{path}: dbc: {path}")
    assert len(refused) < 1000


HARMLESS: Final[dict[str, tuple[str, Callable[[str], str]]]] = {
    "a signal of ten thousand bits": ("kcd", instead('length="16"', 'length="10000"')),
    "a range without end": ("kcd", instead('slope="0.001"', 'slope="1e999"')),
    "all identifiers of 11 bits": ("sym", instead("ID=120h", "ID=000h-7FFh")),
    "thousands of named values": ("sym", instead('0="none"', ",".join(f'{i}="n{i}"' for i in range(5000)))),
    "a million blank lines": ("sym", lambda text: text + "\n" * 1_000_000),
    "a comment of megabytes": ("kcd", behind(BUS, f"<!-- {'x y ' * 1_000_000} -->")),
}


@pytest.mark.parametrize("what", HARMLESS)
def test_large_but_sound_databases_are_read(what: str, tmp_path: Path) -> None:
    kind, spoil = HARMLESS[what]
    path = tmp_path / f"a.{kind}"
    path.write_text(spoil(WHOLE[kind]))
    assert refusal_of(SignalMapError, lambda: read(path)) is None
