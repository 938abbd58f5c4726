"""Numbers with their nouns, and texts in sections, for people."""

from collections.abc import Iterable, Mapping, Sequence


def counted(n: int, noun: str) -> str:
    """ "1 run", "2 runs"."""
    return f"{n} {noun}" if n == 1 else f"{n} {noun}s"


def one_or_more(n: int, one: str, more: str) -> str:
    """ "one batch", "2 batches"."""
    return f"one {one}" if n == 1 else f"{n} {more}"


def in_sections(head: Sequence[str], sections: Mapping[str, Iterable[str]]) -> str:
    """The lines of ``head``, then each section: its title with its rows below it, indented."""
    lines = list(head)
    for title, rows in sections.items():
        lines += ["", title, *(f"  {row}" for row in rows)]
    return "\n".join(lines)
