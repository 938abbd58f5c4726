"""The runner of all studies: cases one after another or in several processes, with progress, and resumed from files."""

import json
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

Found = TypeVar("Found")
OnDone = Callable[[int, int], None]  # (cases done, cases in all)


def run_each(of_one: Callable[[int], Found], n_cases: int, workers: int, on_done: OnDone) -> Iterator[Found]:
    """The result of ``of_one`` for each case by its number, in order, computed in ``workers`` processes.

    The result does not depend on the number of processes, as each case draws from a seed of its own.
    """
    on_done(0, n_cases)
    if workers <= 1:
        for number in range(n_cases):
            yield of_one(number)
            on_done(number + 1, n_cases)
        return
    with ProcessPoolExecutor(workers) as pool:
        for done, found in enumerate(pool.map(of_one, range(n_cases)), 1):
            yield found
            on_done(done, n_cases)


def kept(folder: Path | None, name: str, compute: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """The JSON object of ``compute``, read from ``folder`` if an earlier run stored it there, else stored there.

    Without a folder it is always computed. The object is returned as JSON gives it back, whether stored or not.
    """
    path = None if folder is None else folder / f"{name}.json"
    if path is not None and path.exists():
        text = path.read_text(encoding="utf-8")
    else:
        text = json.dumps(compute())
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
    found: dict[str, Any] = json.loads(text)
    return found
