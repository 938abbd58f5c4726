"""Metadata of dataclass fields for files, forms and pages: descriptions, bounds, and arrays in JSON.

A record is a plain dataclass. pydantic reads the metadata defined here, although the pure rooms do not import it:
constraints have pydantic's names, and arrays have the two methods that pydantic looks for.
"""

from typing import Any, Final

import numpy as np

STRICT: Final = {"extra": "forbid", "allow_inf_nan": False}
"""``__pydantic_config__`` of a record: an unknown key and a number that is not finite are errors."""


def described(words: str, **constraints: Any) -> dict[str, Any]:
    """A field's metadata: its description, and constraints such as ``ge``, ``lt``, ``min_length`` or ``examples``."""
    return {"description": words, **constraints}


class AsLists:
    """Metadata of an array type: lists of finite numbers in JSON, a float64 array in Python."""

    @staticmethod
    def __get_pydantic_core_schema__(source: Any, handler: Any) -> dict[str, Any]:
        """The core schema that pydantic asks for."""
        return {
            "type": "function-plain",
            "function": {"type": "no-info", "function": array_of},
            "serialization": {"type": "function-plain", "function": np.ndarray.tolist},
        }

    @staticmethod
    def __get_pydantic_json_schema__(schema: Any, handler: Any) -> dict[str, Any]:
        """Numbers, or lists of them."""
        return {"type": "array", "items": {"anyOf": [{"type": "number"}, {"type": "array"}]}}


def array_of(numbers: Any) -> Any:
    """Convert to a float64 array. Raises ValueError if that fails or a number is not finite."""
    try:
        array = np.asarray(numbers, dtype=float)
    except (OverflowError, TypeError, ValueError):
        raise ValueError("is no array of numbers") from None
    if array.ndim == 0:
        raise ValueError("is one number where an array belongs")
    if not np.all(np.isfinite(array)):
        raise ValueError("holds a number that is not finite")
    return array


def check_shapes(**expected: tuple[Any, tuple[int, ...]]) -> None:
    """Arrays by name, each with the shape it must have. Raises ValueError."""
    for name, (array, shape) in expected.items():
        if array.shape != shape:
            raise ValueError(f"{name} has the shape {array.shape}, its terms or names ask for {shape}")
