"""The house stays one in which a newcomer finds the way: small files, few in a room, a word at every door."""

import ast
from pathlib import Path

import pytest

GATEWAY = Path(__file__).parents[2] / "gateway"
MOST_FILES = 15
MOST_LINES = 300
ROOMS = sorted(path.parent for path in GATEWAY.rglob("__init__.py"))


@pytest.mark.parametrize("room", ROOMS, ids=lambda room: str(room.relative_to(GATEWAY.parent)))
def test_a_room_is_small_and_says_what_it_is_for(room: Path) -> None:
    files = sorted(room.glob("*.py"))
    assert len(files) <= MOST_FILES
    long = {path.name: n for path in files if (n := len(path.read_text(encoding="utf-8").splitlines())) > MOST_LINES}
    assert not long
    said = ast.get_docstring(ast.parse((room / "__init__.py").read_text(encoding="utf-8")))
    assert said
    assert "TODO" not in said
