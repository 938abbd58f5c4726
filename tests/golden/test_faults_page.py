"""Every row of docs/faults.md names a test that exists."""

import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ROWS = tomllib.loads((ROOT / "tests" / "faults.toml").read_text())["row"]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row["fault"][:40])
def test_every_row_names_a_test_that_exists(row: dict[str, str]) -> None:
    file, _, name = row["test"].partition("::")
    assert f"\ndef {name}(" in (ROOT / file).read_text(encoding="utf-8")


def test_every_fault_test_of_the_machine_has_a_row() -> None:
    named = {row["test"] for row in ROWS}
    found = {
        f"tests/vm/{file.name}::{line.partition('def ')[2].partition('(')[0]}"
        for file in (ROOT / "tests" / "vm").glob("test_[3-7]_*.py")
        for line in file.read_text(encoding="utf-8").splitlines()
        if line.startswith("def test_")
    }
    assert found <= named
