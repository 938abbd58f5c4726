"""Numbers with their units and nouns, and names, for people."""

import math
from collections.abc import Sequence
from typing import Final

NONE: Final = "–"
MOST_TOLD: Final = 10  # chosen: lines of one kind that a person reads


def counted(n: int, noun: str) -> str:
    """ "1 run", "2 runs"."""
    return f"{n} {noun}" if n == 1 else f"{n} {noun}s"


def one_or_more(n: int, one: str, more: str) -> str:
    """ "one batch", "2 batches"."""
    return f"one {one}" if n == 1 else f"{n} {more}"


def some(lines: Sequence[str], indent: str = "  ") -> list[str]:
    """The first MOST_TOLD lines, and how many more there are."""
    rest = [f"and {len(lines) - MOST_TOLD} more"] if len(lines) > MOST_TOLD else []
    return [f"{indent}{line}" for line in (*lines[:MOST_TOLD], *rest)]


def decimal(number: float | None, unit: str = "", digits: int = 2) -> str:
    """A number with so many digits after the point; a dash for None."""
    return NONE if number is None else f"{number:.{digits}f}{unit}"


def known(number: float | None, unit: str = "", form: str = "g") -> str:
    """A number in this format; a dash if nobody knows it: None or NaN."""
    return NONE if number is None or math.isnan(number) else f"{number:{form}}{unit}"


def percent(share: float | None) -> str:
    """A share (0..1) in percent; a dash for None."""
    return NONE if share is None else f"{100.0 * share:.0f} %"


def span(low: float, high: float, unit: str, digits: int = 0) -> str:
    """ "0 to 420 kg", or "0 kg" if both print alike."""
    least, greatest = f"{low:.{digits}f}", f"{high:.{digits}f}"
    return f"{least} {unit}" if least == greatest else f"{least} to {greatest} {unit}"


def estimator_name(estimator: str) -> str:
    """The estimator's name as people call it."""
    return {"cross_spectrum": "cross-spectral estimator", "ratio_index": "ratio index"}.get(estimator, estimator)
