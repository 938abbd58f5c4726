"""The tables of errors, README.md's and the whole one, say what the numbers beside the documents say."""

from pathlib import Path

import make_readme_table

ROOT = Path(__file__).parents[2]


def test_the_table_is_made_from_the_numbers() -> None:
    assert make_readme_table.readme() == (ROOT / "README.md").read_text(encoding="utf-8"), "run `make docs`"


def test_the_whole_table_is_made_from_the_numbers() -> None:
    assert make_readme_table.errors_page() == make_readme_table.PAGE.read_text(encoding="utf-8"), "run `make docs`"
