"""Writes docs/settings.md from gateway/config/; with --check only tells whether it is up to date."""

from pathlib import Path
from typing import Any

from generated import default_of, keep_up_to_date
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from gateway.config import Settings

PAGE = Path(__file__).with_name("settings.md")

INTRODUCTION = """\
# Settings of springscale.toml

Generated from `gateway/config/` by `python docs/make_settings.py`; do not edit by hand.

Paths are relative to the file. An unknown key is an error that names it. An environment variable wins over the file.
"""


def settings_page() -> str:
    """The whole page as Markdown."""
    top = {name: field for name, field in Settings.model_fields.items() if _section_of(field) is None}
    parts = [INTRODUCTION, _table("Top of the file", top, prefix="SPRINGSCALE_")]
    for name, field in Settings.model_fields.items():
        section = _section_of(field)
        if section is not None:
            title = f"[{name}]: {_first_line(section)}"
            parts.append(_table(title, section.model_fields, prefix=f"SPRINGSCALE_{name.upper()}__"))
    return "\n".join(parts)


def _section_of(field: FieldInfo) -> type[BaseModel] | None:
    """The model behind a table of the file; None for a plain key."""
    kind: Any = field.annotation
    return kind if isinstance(kind, type) and issubclass(kind, BaseModel) else None


def _first_line(section: type[BaseModel]) -> str:
    line = (section.__doc__ or "").strip().splitlines()[0].rstrip(".")
    return line[0].lower() + line[1:]


def _table(title: str, fields: dict[str, FieldInfo], *, prefix: str) -> str:
    rows = [
        f"| `{name}` | {_default(field)} | {field.description} | `{prefix}{name.upper()}` |"
        for name, field in fields.items()
    ]
    head = "| key | default | meaning | variable |\n|---|---|---|---|"
    return f"## {title}\n\n{head}\n" + "\n".join(rows) + "\n"


def _default(field: FieldInfo) -> str:
    return "required" if field.is_required() else default_of(field.get_default(call_default_factory=True))


def main() -> None:
    """Write the page, or compare it."""
    keep_up_to_date(PAGE, settings_page(), "gateway/config/")


if __name__ == "__main__":
    main()
