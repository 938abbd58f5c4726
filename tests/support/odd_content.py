"""JSON objects with one odd thing in one place, and files of them."""

import copy
import json
import random
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from gateway.errors import CalibrationFileError

N_TRIALS = 120

ODD: tuple[Any, ...] = (
    *(None, True, False, "", "x", "\ud83d", "0", [], {}, [[]], [None], {"a": 1}, [1.0, [2.0]], [[1.0], [2.0, 3.0]]),
    *(0, -1, 1, 2, 3, 0.5, 1e308, -1e308, 5e-324, 2**63, 10**400, -(2**70)),
)
GONE = object()


def places(part: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Every place in the file; of a long list the first two and the last."""
    if path:
        yield path
    inner = part.items() if isinstance(part, dict) else enumerate(part) if isinstance(part, list) else ()
    for key, child in inner:
        if not isinstance(part, list) or key in {0, 1, len(part) - 1}:
            yield from places(child, (*path, key))


def changed(good: dict[str, Any], path: tuple[Any, ...], odd: Any) -> dict[str, Any]:
    """``good`` with something odd at a place, or with nothing there."""
    content: dict[str, Any] = copy.deepcopy(good)
    inner: Any = content
    for key in path[:-1]:
        inner = inner[key]
    if odd is GONE:
        del inner[path[-1]]
    else:
        inner[path[-1]] = odd
    return content


def tried(good: dict[str, Any], path: Path, use: Callable[[Path], object]) -> tuple[int, list[str]]:
    """The number of changed contents out of N_TRIALS that could be used, and the messages about the others."""
    dice, all_places = random.Random(58), list(places(good))
    n_used, refusals = 0, []
    for _ in range(N_TRIALS):
        content = changed(good, dice.choice(all_places), dice.choice((*ODD, GONE)))
        path.write_text(json.dumps(content))
        try:
            use(path)
            n_used += 1
        except CalibrationFileError as fault:
            refusals.append(str(fault))
    assert all(str(path) in refusal for refusal in refusals)
    return n_used, refusals
