"""README.md's table of errors says what the numbers beside the documents say."""

import importlib.util
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_the_table_is_made_from_the_numbers() -> None:
    spec = importlib.util.spec_from_file_location("make_readme_table", ROOT / "docs" / "make_readme_table.py")
    assert spec is not None
    assert spec.loader is not None
    maker = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(maker)
    assert maker.readme() == (ROOT / "README.md").read_text(encoding="utf-8"), "run `make docs`"
