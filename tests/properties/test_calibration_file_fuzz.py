"""A calibration file of any content is used or refused in words: nothing else."""

import copy
import json
import random
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from gateway.calibration.file import load_calibration
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


GOOD = json.loads((Path(__file__).parents[2] / "gateway" / "demo" / "paper_van.json").read_text())


def test_any_content_is_used_or_refused_in_words(tmp_path: Path) -> None:
    n_used, refusals = tried(GOOD, tmp_path / "vehicle.json", lambda path: load_calibration(path).for_core())
    assert min(n_used, len(refusals)) > N_TRIALS / 10


@pytest.mark.parametrize("text", ["[" * 100_000, '{"id": ' + "9" * 5000 + "}", '{"format": "\\ud83d"}', "\ufeff{}", ""])
def test_what_json_can_hold_but_we_cannot_is_refused_in_words(tmp_path: Path, text: str) -> None:
    path = tmp_path / "vehicle.json"
    path.write_text(text)
    with pytest.raises(CalibrationFileError, match=re.escape(str(path))):
        load_calibration(path)
