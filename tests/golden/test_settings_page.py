"""Every setting is described for docs/settings.md."""

from gateway.config import Settings


def test_every_setting_is_described() -> None:
    for name, field in Settings.model_fields.items():
        keys = getattr(field.annotation, "model_fields", None)
        described = {f"{name}.{key}": inner for key, inner in keys.items()} if keys else {name: field}
        assert [key for key, inner in described.items() if not inner.description] == []
