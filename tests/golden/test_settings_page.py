"""docs/settings.md says what gateway/config/ does."""

from pathlib import Path

import make_settings

from gateway.config import Settings

DOCS = Path(__file__).parents[2] / "docs"


def test_the_page_is_made_from_the_settings() -> None:
    assert (DOCS / "settings.md").read_text(encoding="utf-8") == make_settings.settings_page(), "run `make docs`"


def test_every_setting_is_described() -> None:
    for name, field in Settings.model_fields.items():
        keys = getattr(field.annotation, "model_fields", None)
        described = {f"{name}.{key}": inner for key, inner in keys.items()} if keys else {name: field}
        assert [key for key, inner in described.items() if not inner.description] == []
