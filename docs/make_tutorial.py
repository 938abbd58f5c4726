"""Runs the commands of tutorial.md and writes their output below them; with --check only compares.

Commands are in fences of kind sh, their output in a fence of kind text below. All run in one shell in an empty folder.
A comment above an output gives what may differ from run to run, as a regular expression:

    <!-- may differ: "age_s":[0-9.]+ -->

Numbers may differ by one in their last printed digit, as machines round differently. The port is a free one.
"""

import os
import re
import socket
import subprocess
import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from made import ROOT

NUMBER: Final = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")
PAGE: Final = Path(__file__).with_name("tutorial.md")
PORT: Final = "8000"
MARK: Final = "@@ block"
PATIENCE_S: Final = 600.0  # chosen: timeout
STEP: Final = re.compile(
    r"```sh\n(?P<commands>.*?)```\n"
    r"(?:\n(?:<!-- may differ: (?P<rule>[^\n]+) -->\n\n)?```text\n(?P<output>.*?)```\n)?",
    re.DOTALL,
)


def printed_by(blocks: list[str]) -> list[str]:
    """What each block of commands prints, errors too, in one shell. RuntimeError where a command fails."""
    port = _free_port()
    marked = [f"echo '{MARK}'\n{commands.replace(PORT, port)}" for commands in blocks]
    ending = "trap 'kill $(jobs -p) 2>/dev/null; wait' EXIT\n"
    with TemporaryDirectory(prefix="tutorial-") as folder:
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        environment = {**os.environ, "PATH": path, "HOME": folder, "LC_ALL": "C.UTF-8", "OPENBLAS_NUM_THREADS": "1"}
        done = subprocess.run(
            ["bash", "-eu", "-c", ending + "".join(marked)],
            cwd=folder,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=PATIENCE_S,
            check=False,
        )
    if done.returncode:
        raise RuntimeError(f"a command of {PAGE.name} failed; this was printed last:\n{done.stdout[-2000:]}")
    printed = done.stdout.replace(f":{port}", f":{PORT}").split(f"{MARK}\n")[1:]
    return [text if text.endswith("\n") or not text else f"{text}\n" for text in printed]


def is_same(kept: str, printed: str, rule: str | None) -> bool:
    """Whether what was printed is what the page says, apart from what may differ."""
    if rule is not None:
        kept, printed = (re.sub(rule, "...", text) for text in (kept, printed))
    return agrees(kept, printed, _last_digit)


def agrees(one: str, other: str, tolerance: Callable[[str], float]) -> bool:
    """True if only numbers differ, each by at most ``tolerance`` of the number as printed."""
    if NUMBER.sub("#", one) != NUMBER.sub("#", other):
        return False
    pairs = zip(NUMBER.findall(one), NUMBER.findall(other), strict=True)
    return all(here == there or abs(float(here) - float(there)) <= tolerance(here) for here, there in pairs)


def with_outputs(page: str) -> str:
    """The page with today's outputs; an output that is the same but for what may differ stays as it is."""
    steps = list(STEP.finditer(page))
    printed = printed_by([step["commands"] for step in steps])
    starts = [0, *(step.end() for step in steps), len(page)]
    pieces = [page[begin:end] for begin, end in pairwise(starts)]
    fitted = [_fitted(piece, *pair) for piece, *pair in zip(pieces[:-1], steps, printed, strict=True)]
    return "".join([*fitted, pieces[-1]])


def _fitted(piece: str, step: re.Match[str], printed: str) -> str:
    """A piece of the page that ends with this step's output."""
    kept = step["output"]
    if kept is None and printed:
        raise ValueError(f"{PAGE.name} has no place for what this prints:\n{step['commands']}{printed}")
    if kept is None or is_same(kept, printed, step["rule"]):
        return piece
    ending = f"```text\n{kept}```\n"
    return f"{piece.removesuffix(ending)}```text\n{printed}```\n"


def _last_digit(number: str) -> float:
    decimals = len(number.partition(".")[2])
    return 1.001 * 10.0**-decimals


def _free_port() -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return str(probe.getsockname()[1])


def main() -> None:
    """Write the page, or compare it."""
    page = PAGE.read_text(encoding="utf-8")
    now = with_outputs(page)
    if "--check" not in sys.argv[1:]:
        PAGE.write_text(now, encoding="utf-8")
    elif now != page:
        sys.exit(f"{PAGE.relative_to(ROOT)} does not say what its commands print: run `python docs/make_tutorial.py`")


if __name__ == "__main__":
    main()
