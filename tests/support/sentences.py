"""What the gateway writes on /teach, read from its source, and which rows of a table of translations it meets."""

import ast
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

GATEWAY = Path(__file__).parents[2] / "gateway"
NUMBER = "12"
RAISED = {"ImpossibleError": "{}", "_CellError": "from: {}"}  # on the page a fault of a cell follows its column
MODULES = ("calibration/assigned.py", "calibration/statements_csv.py", "calibration/learning/work.py")
FIELD = re.compile(r"\{(\w+)\}")


def raised() -> Iterator[str]:
    """Every message about a statement or a cell, with a number for what varies."""
    for module in MODULES:
        for node in ast.walk(ast.parse((GATEWAY / module).read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in RAISED:
                yield from (RAISED[node.func.id].format(text) for text in _texts(node.args[0]))
            if isinstance(node, ast.FunctionDef) and node.name in ("_why_waiting", "_why_worse"):
                returns = (one.value for one in ast.walk(node) if isinstance(one, ast.Return) and one.value)
                yield from (text for value in returns for text in _texts(value))


def _texts(node: ast.expr) -> Iterator[str]:
    if isinstance(node, ast.IfExp):
        yield from (*_texts(node.body), *_texts(node.orelse))
    elif isinstance(node, ast.JoinedStr):
        yield "".join(str(one.value) if isinstance(one, ast.Constant) else NUMBER for one in node.values)
    elif isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value


def unmet(rows: Sequence[str], texts: Iterable[str]) -> list[str]:
    """The rows that translate none of these texts, nor a part of one."""
    patterns = {row: re.compile(_pattern(row), re.DOTALL) for row in rows}
    met: set[str] = set()
    waiting = list(texts)
    while waiting:
        text = waiting.pop()
        row, found = next(((row, one) for row, each in patterns.items() if (one := each.fullmatch(text))), (None, None))
        if row is not None and found is not None:
            met.add(row)
            waiting += found.groups()
    return [row for row in rows if row not in met]


def _pattern(row: str) -> str:
    parts = FIELD.split(row)
    fields = [r"(\d+)" if name == "n" else "(.+?)" for name in parts[1::2]]
    return "".join(re.escape(part) + field for part, field in zip(parts[::2], [*fields, ""], strict=True))
