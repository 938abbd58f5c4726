"""Which small mistakes in a module its tests do not notice.

    python -m benchmarks.mutation gateway/core/sample_clock.py tests/properties/test_sample_clock.py --sample 60

changes one operator, comparison or number of the module at a time, runs these tests on each changed copy of the
checkout, and prints a table of the changes that pass. A survivor is a missing test, or a change without effect.
"""

import argparse
import ast
import os
import random
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from importlib.util import cache_from_source
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

ROOT: Final = Path(__file__).parents[1]
COPIED: Final = ("gateway", "tests", "benchmarks", "dbc", "docs", "deploy", "examples")
SLOWER: Final = 5.0  # chosen: tests that take this many times as long as usual hang
ALLOWANCE_S: Final = 30.0  # chosen: for the start of a process on a busy computer

SWAPPED: Final[dict[type[ast.AST], type[ast.AST]]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.And: ast.Or,
    ast.Or: ast.And,
    ast.USub: ast.UAdd,
    ast.Not: ast.UAdd,  # +True is as true as True
}
COMPARED: Final[dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]]] = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}


@dataclass(frozen=True, slots=True)
class Mutant:
    """A module's text with one change in an expression of this line."""

    line: int
    before: str
    after: str
    text: str


def mutants_of(text: str) -> Iterator[Mutant]:
    """Every change of one operator, comparison or number in a module's functions.

    Numbers with names are left out: most were chosen, and others would do as well.
    """
    tree = ast.parse(text)
    holders: list[ast.Module | ast.ClassDef] = [tree, *(node for node in tree.body if isinstance(node, ast.ClassDef))]
    functions = [node for holder in holders for node in holder.body if isinstance(node, ast.FunctionDef)]
    for node in (node for function in functions for line in function.body for node in ast.walk(line)):
        for change in _changes_of(node):
            before = ast.unparse(node)
            undo = change()
            yield Mutant(getattr(node, "lineno", 0), before, ast.unparse(node), ast.unparse(tree))
            undo()


def _changes_of(node: ast.AST) -> list[Callable[[], Callable[[], None]]]:
    """What can be changed about a node; each change returns what undoes it."""
    if isinstance(node, ast.BinOp | ast.BoolOp | ast.UnaryOp) and type(node.op) in SWAPPED:
        return [partial(_set, node, "op", SWAPPED[type(node.op)]())]
    if isinstance(node, ast.Compare):
        return [
            partial(_set, node, "ops", [*node.ops[:i], other(), *node.ops[i + 1 :]])
            for i, one in enumerate(node.ops)
            for other in COMPARED[type(one)]
        ]
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float | complex):
        return [partial(_set, node, "value", _other_number(node.value))]
    return []


def _set(node: ast.AST, name: str, changed: object) -> Callable[[], None]:
    undo = partial(setattr, node, name, getattr(node, name))
    setattr(node, name, changed)
    return undo


def _other_number(number: complex) -> complex:
    if isinstance(number, bool):
        return not number
    if isinstance(number, int):
        return number + 1
    return 1.5 * number if number else 1.0


def survivors(module: Path, tests: list[str], mutants: list[Mutant], until_s: float) -> tuple[int, list[Mutant]]:
    """How many mutants the tests judged before ``until_s`` (monotonic), and which of these no test noticed.

    ``module`` is relative to the checkout. RuntimeError where the tests fail on the module as it is.
    """
    with TemporaryDirectory(prefix="mutation-") as folder:
        checkout = Path(folder) / "checkout"
        for name in COPIED:
            shutil.copytree(ROOT / name, checkout / name, ignore=shutil.ignore_patterns("node_modules", "out"))
        for path in ROOT.glob("*.*"):
            if path.is_file():
                shutil.copy(path, checkout)
        began_s = time.monotonic()
        if not _pass(checkout, tests, timeout_s=until_s - began_s):
            raise RuntimeError(f"the tests fail on {module} as it is, or take too long")
        timeout_s = SLOWER * (time.monotonic() - began_s) + ALLOWANCE_S
        n_judged, passed = 0, []
        for mutant in mutants:
            if time.monotonic() > until_s:
                break
            (checkout / module).write_text(mutant.text, encoding="utf-8")
            Path(cache_from_source(str(checkout / module))).unlink(missing_ok=True)
            n_judged += 1
            if _pass(checkout, tests, timeout_s):
                passed.append(mutant)
        return n_judged, passed


def _pass(checkout: Path, tests: list[str], timeout_s: float) -> bool:
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:xdist", "-p", "no:cacheprovider", *tests]
    environment = {**os.environ, "PYTHONPATH": str(checkout), "OPENBLAS_NUM_THREADS": "1"}
    try:
        done = subprocess.run(
            command, cwd=checkout, env=environment, capture_output=True, timeout=timeout_s, check=False
        )
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0


def main() -> None:
    """Print the survivors as a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("module", type=Path, help="relative to the checkout")
    parser.add_argument("tests", nargs="+", help="what pytest takes")
    parser.add_argument("--sample", type=int, default=60, help="so many mutants, drawn at random")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=600.0, help="no mutant starts later")
    asked = parser.parse_args()
    mutants = list(mutants_of((ROOT / asked.module).read_text(encoding="utf-8")))
    drawn = random.Random(asked.seed).sample(mutants, min(asked.sample, len(mutants)))
    n_judged, found = survivors(asked.module, asked.tests, drawn, time.monotonic() + asked.seconds)
    print(f"{asked.module}: {n_judged} of {len(mutants)} mutants judged, {len(found)} survived\n")
    print("| line | before | after |\n|---:|---|---|")
    for one in sorted(found, key=lambda mutant: mutant.line):
        print(f"| {one.line} | `{one.before}` | `{one.after}` |")


if __name__ == "__main__":
    main()
