"""DBC files written by hand, so that no reader of ours has a part in it."""

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class SomeSignal:
    """A signal; ``start`` counts as a DBC does (big-endian: the most significant bit)."""

    name: str
    start: int
    length: int
    unit: str
    scale: float = 1.0
    offset: float = 0.0
    is_signed: bool = False
    is_big_endian: bool = False
    is_float: bool = False
    minimum: float = 0.0
    maximum: float = 1.0


@dataclass(frozen=True, slots=True)
class SomeMessage:
    """A message of these signals."""

    name: str
    can_id: int
    n_bytes: int
    signals: Sequence[SomeSignal]
    is_extended: bool = False


def dbc(messages: Sequence[SomeMessage]) -> str:
    """The messages as Vector writes them."""
    lines = ['VERSION ""', "NS_ :", "BS_:", "BU_: A"]
    for m in messages:
        lines.append(f"BO_ {m.can_id | (m.is_extended << 31)} {m.name}: {m.n_bytes} A")
        lines += [
            f" SG_ {s.name} : {s.start}|{s.length}@{int(not s.is_big_endian)}"
            f"{'-' if s.is_signed or s.is_float else '+'} "
            f'({s.scale},{s.offset}) [{s.minimum}|{s.maximum}] "{s.unit}" A'
            for s in m.signals
        ]
    for m in messages:
        number = m.can_id | (m.is_extended << 31)
        lines += [f"SIG_VALTYPE_ {number} {s.name} : {s.length // 32};" for s in m.signals if s.is_float]
    return "\n".join(lines) + "\n"
