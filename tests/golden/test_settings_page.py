"""docs/settings.md says what gateway/config.py does."""

import importlib.util
from pathlib import Path

from gateway.config import Settings

DOCS = Path(__file__).parents[2] / "docs"


def test_the_page_is_made_from_the_settings() -> None:
    spec = importlib.util.spec_from_file_location("make_settings", DOCS / "make_settings.py")
    assert spec is not None
    assert spec.loader is not None
    maker = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(maker)
    assert (DOCS / "settings.md").read_text(encoding="utf-8") == maker.settings_page(), "run `make docs`"


def test_every_setting_is_described() -> None:
    for name, field in Settings.model_fields.items():
        keys = getattr(field.annotation, "model_fields", None)
        described = {f"{name}.{key}": inner for key, inner in keys.items()} if keys else {name: field}
        assert [key for key, inner in described.items() if not inner.description] == []
