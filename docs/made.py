"""Common parts of the page generators: filled marks and sentences, and tables.

Prose lives in the pages. Two marks stand for what a program writes:

    <!-- made: NAME -->             what a function of docs/make.py returns
    <!-- end: NAME -->

    <!-- from soak.json: {hours_a_day:g} h of driving a day. -->
    the same sentence with the numbers of docs/soak.json
    <!-- end -->
"""

import json
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
SENTENCES = re.compile(
    r"(?P<mark><!-- from (?P<file>[\w.]+\.json): (?P<template>.*?) -->\n).*?(?P<end><!-- end -->)", re.DOTALL
)


class StaleError(Exception):
    """A page that is not up to date."""


def keep_up_to_date(page: Path, text: str, *, is_check: bool) -> None:
    """Write ``page``, or with ``is_check`` raise StaleError if it differs."""
    if not is_check:
        page.write_text(text, encoding="utf-8")
    elif not page.is_file() or page.read_text(encoding="utf-8") != text:
        raise StaleError(f"{page.relative_to(ROOT)} does not say what its source does: run `make docs`")


def filled(text: str, parts: Mapping[str, Callable[[], str]]) -> str:
    """``text`` with the parts between <!-- made: NAME --> and <!-- end: NAME --> replaced, and its sentences filled.

    Raises ValueError for a part without its marks, or marks without their part.
    """
    marks = set(re.findall(r"<!-- made: ([\w -]+?) -->", text))
    if marks != set(parts):
        raise ValueError(f"marks and parts differ: {sorted(marks ^ set(parts))}")
    for name, make in parts.items():
        between = re.compile(rf"(<!-- made: {name} -->\n).*?(<!-- end: {name} -->)", re.DOTALL)
        made = make()
        text = between.sub(lambda found, made=made: f"{found[1]}{made}{found[2]}", text)  # type: ignore[misc]
    return SENTENCES.sub(_with_numbers, text)


def _with_numbers(found: re.Match[str]) -> str:
    return f"{found['mark']}{found['template'].format(**numbers(found['file']))}\n{found['end']}"


def numbers(file: str) -> Any:
    """What a JSON file in docs/ holds."""
    return json.loads((DOCS / file).read_text(encoding="utf-8"))


def table(heading: str, rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown; ``heading`` names its columns, ``a | b``."""
    lines = [f"| {heading} |", "|" + "---|" * (heading.count("|") + 1), *(f"| {' | '.join(row)} |" for row in rows)]
    return "\n".join(lines) + "\n"


def default_of(default: Any) -> str:
    """The value of an absent key, as TOML writes it."""
    if default is None:
        return "absent"
    if isinstance(default, bool):
        return f"`{str(default).lower()}`"
    if isinstance(default, tuple | list):
        return f"`{list(default)}`"
    return f"`{default}`" if isinstance(default, int | float) or default == {} else f'`"{default}"`'
