"""Common parts of the page generators: filled marks and sentences, tables, and comparison.

Prose lives in the pages. Two marks stand for what a program writes:

    <!-- made: NAME -->             what a function of docs/make.py returns
    <!-- end: NAME -->

    <!-- from feed_cost.json: {cpu_pct:.1f} % of one core and {rss_mb:.0f} MB. -->
    the same sentence with the numbers of docs/feed_cost.json
    <!-- end -->
"""

import json
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

from pydantic import TypeAdapter

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
SENTENCES = re.compile(
    r"(?P<mark><!-- from (?P<file>[\w.]+\.json): (?P<template>.*?) -->\n).*?(?P<end><!-- end -->)", re.DOTALL
)
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")


class StaleError(Exception):
    """A page that is not up to date."""


def keep_up_to_date(page: Path, text: str, *, is_check: bool, tolerance: float = 0.0) -> None:
    """Write ``page``, or with ``is_check`` raise StaleError if it differs.

    Numbers computed by simulation may differ by ``tolerance``, as machines round differently.
    """
    if not is_check:
        page.write_text(text, encoding="utf-8")
    elif not page.is_file() or not agrees(page.read_text(encoding="utf-8"), text, lambda number: tolerance):
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


def agrees(one: str, other: str, tolerance: Callable[[str], float]) -> bool:
    """True if only numbers differ, each by at most ``tolerance`` of the number as printed."""
    if NUMBER.sub("#", one) != NUMBER.sub("#", other):
        return False
    pairs = zip(NUMBER.findall(one), NUMBER.findall(other), strict=True)
    return all(here == there or abs(float(here) - float(there)) <= tolerance(here) for here, there in pairs)


def key_table(model: type, *without: str) -> str:
    """A table of TOML keys: default, limits and description of every field of ``model`` except those named.

    ``model`` is a pydantic model or an annotated dataclass; required keys come first.
    """
    schema = TypeAdapter(model).json_schema()
    required = schema.get("required", ())
    rows = (
        (
            f"`{name}`",
            "required" if name in required else default_of(key.get("default", _none_of(key))),
            limits_of(key, schema.get("$defs", {})),
            key["description"],
        )
        for name, key in sorted(schema["properties"].items(), key=lambda one: one[0] not in required)
        if name not in without
    )
    return table("key | default | limits | meaning", rows)


def _none_of(key: dict[str, Any]) -> dict[str, Any] | None:
    """The default that a schema omits because a factory makes it: an empty table."""
    return {} if key.get("type") == "object" else None


def default_of(default: Any) -> str:
    """The value of an absent key, as TOML writes it."""
    if default is None:
        return "absent"
    if isinstance(default, bool):
        return f"`{str(default).lower()}`"
    if isinstance(default, tuple | list):
        return f"`{list(default)}`"
    return f"`{default}`" if isinstance(default, int | float) or default == {} else f'`"{default}"`'


def limits_of(schema: dict[str, Any], named: Mapping[str, Any] = MappingProxyType({})) -> str:
    """The limits of a key by its JSON schema, in words; empty without any."""
    if "$ref" in schema:
        return limits_of(named.get(schema["$ref"].rsplit("/", 1)[-1], {}), named)
    if "anyOf" in schema:
        return limits_of(next(one for one in schema["anyOf"] if one.get("type") != "null"), named)
    if "prefixItems" in schema:
        return f"two numbers, each {limits_of(schema['prefixItems'][0])}"
    if "enum" in schema:
        return " or ".join(f'`"{one}"`' if isinstance(one, str) else f"`{one}`" for one in schema["enum"])
    if schema.get("minLength") or schema.get("minItems"):
        return "not empty"
    words = {"minimum": "from", "exclusiveMinimum": "above", "maximum": "to", "exclusiveMaximum": "below"}
    return " ".join(f"{word} {schema[name]:,g}".replace(",", " ") for name, word in words.items() if name in schema)
