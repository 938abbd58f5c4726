"""What every made page has in common: it is written, or with --check compared with what it should say."""

import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

ROOT = Path(__file__).parents[1]


NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")


def keep_up_to_date(page: Path, text: str, source: str, *, tolerance: float = 0.0) -> None:
    """Write ``page``; with --check end with a clear line where it does not say what ``source`` does.

    What is computed from a simulation may differ by ``tolerance`` in each number: machines round differently.
    """
    if "--check" not in sys.argv[1:]:
        page.write_text(text, encoding="utf-8")
    elif not page.is_file() or not agrees(page.read_text(encoding="utf-8"), text, lambda number: tolerance):
        sys.exit(f"{page.relative_to(ROOT)} does not say what {source} does: run `make docs`")


def agrees(one: str, other: str, tolerance: Callable[[str], float]) -> bool:
    """True where only numbers differ, each by no more than what ``tolerance`` gives for the number as printed."""
    if NUMBER.sub("#", one) != NUMBER.sub("#", other):
        return False
    pairs = zip(NUMBER.findall(one), NUMBER.findall(other), strict=True)
    return all(here == there or abs(float(here) - float(there)) <= tolerance(here) for here, there in pairs)


def key_table(model: type[BaseModel], *without: str) -> str:
    """A table of TOML's keys: default, limits and description of every field of ``model`` but those named."""
    limits = model.model_json_schema()["properties"]
    rows = [
        f"| `{name}` | {default_of(field)} | {limits_of(limits[name])} | {field.description} |"
        for name, field in model.model_fields.items()
        if name not in without
    ]
    return "| key | default | limits | meaning |\n|---|---|---|---|\n" + "\n".join(rows) + "\n"


def default_of(field: FieldInfo) -> str:
    """What holds when the key is absent, as TOML would write it."""
    default = field.get_default(call_default_factory=True)
    if default is PydanticUndefined:
        return "required"
    if default is None:
        return "absent"
    if isinstance(default, bool):
        return f"`{str(default).lower()}`"
    if isinstance(default, tuple):
        return f"`{list(default)}`"
    return f"`{default}`" if isinstance(default, int | float) or default == {} else f'`"{default}"`'


def limits_of(schema: dict[str, Any]) -> str:
    """What the JSON schema of a key allows, in words; empty where it allows all of its kind."""
    if "anyOf" in schema:
        return limits_of(next(one for one in schema["anyOf"] if one.get("type") != "null"))
    if "prefixItems" in schema:
        return f"two numbers, each {limits_of(schema['prefixItems'][0])}"
    if "enum" in schema:
        return " or ".join(f'`"{one}"`' if isinstance(one, str) else f"`{one}`" for one in schema["enum"])
    if schema.get("minLength") or schema.get("minItems"):
        return "not empty"
    words = {"minimum": "from", "exclusiveMinimum": "above", "maximum": "to", "exclusiveMaximum": "below"}
    return " ".join(f"{word} {schema[name]:,g}".replace(",", " ") for name, word in words.items() if name in schema)
