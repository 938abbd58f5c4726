"""A known weight as a person types it: the options of one, and several in --load."""

import math
from typing import Any, Final

import click

KINDS: Final = (
    ("axles", ("front_axle_kg", "rear_axle_kg")),
    ("gross", ("gross_kg",)),
    ("payload", ("payload_kg", "position_m")),
)
_WORDS: Final = frozenset({"at", "drive"})


class KnownLoad(click.ParamType[dict[str, Any]]):
    """gross_kg=1890,at=2026-11-21T04:10Z,drive=before -> the object that the service takes."""

    name = "key=value,..."

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> dict[str, Any]:
        """Raises a usage error that lists the keys."""
        if isinstance(value, dict):
            return value
        told: dict[str, Any] = {}
        for part in str(value).split(","):
            key, is_pair, text = part.strip().partition("=")
            if not is_pair or (key not in _WORDS and not any(key in keys for _, keys in KINDS)):
                known = ", ".join([*(key for _, keys in KINDS for key in keys), *sorted(_WORDS)])
                self.fail(f"{part!r} is none of KEY=VALUE with KEY one of {known}", param, ctx)
            told[key] = text if key in _WORDS else _number(text)
            if told[key] is None:
                self.fail(f"{key} = {text!r} is no number", param, ctx)
        return {"by": self._kind(told, param, ctx), **told}

    def _kind(self, told: dict[str, Any], param: click.Parameter | None, ctx: click.Context | None) -> str:
        kinds = [kind for kind, keys in KINDS if any(key in told for key in keys)]
        if len(kinds) != 1:
            self.fail("state one of gross_kg, front_axle_kg with rear_axle_kg, payload_kg with position_m", param, ctx)
        return kinds[0]


def _number(text: str) -> float | None:
    """None unless it is a finite number."""
    try:
        number = float(text)
    except ValueError:
        return None
    return number if math.isfinite(number) else None
