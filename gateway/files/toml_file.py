"""Reads TOML files written by people and checks them against a model; every fault names its file and key."""

import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from difflib import get_close_matches
from math import isnan
from pathlib import Path
from typing import Any, Final, TypeVar, get_args

from pydantic import BaseModel, ValidationError

from gateway.errors import ConfigurationError

Model = TypeVar("Model", bound=BaseModel)
Read = Callable[[Path], bytes]  # reads a file, on a disk or from an object store; raises OSError

SIMILAR: Final = 0.7  # of difflib's ratio: a letter too many, too few or another one, or a unit left out
_OF_KEY: Final = "[key]"  # how pydantic ends the place of a fault in a key itself

_BEYOND: Final = {  # pydantic's type of fault -> (its words, the bound's name in the fault)
    "less_than_equal": ("is above", "le"),
    "less_than": ("is not below", "lt"),
    "greater_than_equal": ("is below", "ge"),
    "greater_than": ("is not above", "gt"),
}
_TAKEN_FOR: Final = (  # (end of the key, factor to its unit, what the number was probably in); the first that fits
    ("_m", 0.001, "millimetres"),
    ("_m", 0.01, "centimetres"),
    ("_kg", 0.001, "grams"),
    ("_kg", 1000.0, "tonnes"),
    ("_pct", 100.0, "a fraction"),
    ("_mps", 1.0 / 3.6, "km/h"),
    ("_s", 0.001, "milliseconds"),
)


def read_toml(
    path: Path, error: type[ConfigurationError] = ConfigurationError, read: Read = Path.read_bytes
) -> dict[str, Any]:
    """The tables of ``path``. Raises ``error`` naming the file, and the line where its syntax breaks."""
    try:
        tables = tomllib.loads(read(path).decode("utf-8-sig"))
        parts = list(_parts(tables, ""))
    except FileNotFoundError:
        raise error(f"{path}: no such file") from None
    except IsADirectoryError:
        raise error(f"{path}: is a folder, a file is wanted") from None
    except PermissionError:
        raise error(f"{path}: no permission to read it") from None
    except OSError as fault:
        raise error(f"{path}: cannot be read: {fault.strerror or fault}") from None
    except UnicodeDecodeError as fault:
        raise error(f"{path}: not UTF-8 text (byte {fault.start})") from None
    except (ValueError, RecursionError) as fault:  # a number of 5,000 digits, a thousand brackets
        raise error(f"{path}: not valid TOML: {fault}") from None
    for where, part in parts:
        if isinstance(part, str) and "\0" in part:
            raise error(f"{path}: {where}: contains a NUL character, which no name or path may")
        if isinstance(part, int) and not -(2**63) <= part < 2**64:
            raise error(f"{path}: {where}: an integer beyond 64 bits")
    return tables


def _parts(part: Any, where: str) -> Iterator[tuple[str, Any]]:
    """Every value with the keys that lead to it."""
    pairs = part.items() if isinstance(part, dict) else enumerate(part) if isinstance(part, list) else None
    if pairs is None:
        yield where, part
        return
    for key, one in pairs:
        yield from _parts(one, f"{where}.{key}" if where else str(key))


def load_toml(
    path: Path,
    model: type[Model],
    error: type[ConfigurationError] = ConfigurationError,
    read: Read = Path.read_bytes,
) -> Model:
    """``path`` as a ``model``. Raises ``error`` with one line for every fault."""
    return checked(read_toml(path, error, read), path, model, error)


def checked(
    tables: dict[str, Any], path: Path, model: type[Model], error: type[ConfigurationError] = ConfigurationError
) -> Model:
    """The tables read from ``path`` as a ``model``. Raises ``error`` with one line for every fault."""
    try:
        return model.model_validate(tables)
    except ValidationError as fault:
        raise error(describe_faults(path, fault, model)) from None


def describe_faults(where: Path | str, fault: ValidationError, model: type) -> str:
    """One line a fault of ``model``: file, key, what is wrong and what stands there.

    A list is not reported as too short when the missing entries are already reported as wrong.
    """
    faults = fault.errors(include_url=False)
    within = {each["loc"][:n] for each in faults for n in range(len(each["loc"]))}
    told = (each for each in faults if each["type"] != "too_short" or each["loc"] not in within)
    return "\n".join(f"{where}: {_key(each['loc'])}: {_what(dict(each), model)}" for each in told)


def _key(location: tuple[int | str, ...]) -> str:
    key = ""
    for part in location:
        if part == _OF_KEY:
            continue
        key += f"[{part + 1}]" if isinstance(part, int) else f".{part}" if key else part
    return key or "(file)"


def _what(fault: dict[str, Any], model: type) -> str:
    if fault["type"] in ("extra_forbidden", "unexpected_keyword_argument"):
        *table, key = fault["loc"]
        return _unknown(str(key), _keys_of(model, table))
    if fault["type"] == "enum" and fault["loc"][-1] == _OF_KEY:
        return _unknown(str(fault["input"]), re.findall("'([^']+)'", fault["ctx"]["expected"]))
    if fault["type"] in ("missing", "missing_keyword_only_argument", "missing_argument"):
        return "missing; it must be given"
    if (told := beyond(fault)) is not None:
        return told
    message = fault["msg"].removeprefix("Value error, ")
    shown = repr(fault.get("input"))
    return message if fault["type"] == "value_error" or len(shown) > 60 else f"{message} (it says {shown})"


def _unknown(key: str, known: Sequence[str]) -> str:
    meant = get_close_matches(key, known, 1, SIMILAR)
    return f"unknown key; did you mean {meant[0]}?" if meant else "unknown key; remove it or check its spelling"


def _keys_of(model: type, table: Sequence[int | str]) -> list[str]:
    """The keys that a table may have; for a union of models, the keys of all of them."""
    models = [model]
    for part in table:
        types = [hints[part] for one in models if isinstance(part, str) and part in (hints := _fields_of(one))]
        inner = [found for each in types for found in _models_in(each)]
        models = inner or models  # an index, or a name that the writer chose, leads no deeper
    return [key for one in models for key in _fields_of(one)]


def _fields_of(model: type) -> dict[str, Any]:
    """Types by key, of a pydantic model or of a dataclass."""
    if issubclass(model, BaseModel):
        return {name: field.annotation for name, field in model.model_fields.items()}
    return {field.name: field.type for field in fields(model)} if is_dataclass(model) else {}


def _models_in(annotation: Any) -> Iterator[type]:
    if isinstance(annotation, type) and (issubclass(annotation, BaseModel) or is_dataclass(annotation)):
        yield annotation
    for part in get_args(annotation):
        yield from _models_in(part)


def beyond(fault: Mapping[str, Any]) -> str | None:
    """What pydantic found of a number out of its bounds: "1240 is above 30: millimetres?"; None of another fault."""
    if fault["type"] not in _BEYOND:
        return None
    said, name = _BEYOND[fault["type"]]
    number, bound = fault["input"], fault["ctx"][name]
    if isinstance(number, float) and isnan(number):
        return f"{number} is no number"
    key = next((part for part in reversed(fault["loc"]) if isinstance(part, str)), "")
    unit = _taken_for(key, number, bound) if isinstance(number, int | float) else None
    return f"{number} {said} {bound:g}" + (f": {unit}?" if unit else "")


def _taken_for(key: str, number: float, bound: float) -> str | None:
    """The unit in which ``number`` would be within the bound and of a plausible size."""
    speck = min(1.0, abs(bound) / 20.0)
    for end, factor, unit in _TAKEN_FOR:
        meant = factor * number
        keeps_it = meant > bound if number < bound else meant < bound
        if key.endswith(end) and keeps_it and abs(meant) >= speck:
            return unit
    return None
