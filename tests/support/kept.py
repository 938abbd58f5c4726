"""Results that are expensive to make and shared by tests: the first test that needs one makes it, in any process.

It lasts as long as the run of the tests, so no change of the package can meet an older one.
"""

import fcntl
import hashlib
import os
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")
PLACE = "SPRINGSCALE_TESTS_KEPT"  # the run's folder, which conftest.py sets for all of its processes


def kept_file(name: str, make: Callable[[Path], object]) -> Path:
    """The file of this name, which ``make`` writes where it is not there; others wait for it."""
    folder = Path(os.environ[PLACE])
    folder.mkdir(exist_ok=True)
    path = folder / name
    with (folder / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not path.exists():
            unfinished = folder / f"unfinished-{name}"
            make(unfinished)
            unfinished.rename(path)
    return path


def kept(make: Callable[P, T]) -> Callable[P, T]:
    """A function of plain arguments whose answers are kept; each caller gets a copy of his own."""

    def answer(*args: P.args, **kwargs: P.kwargs) -> T:
        asked = hashlib.sha256(repr((args, sorted(kwargs.items()))).encode()).hexdigest()[:16]
        name = f"{make.__module__}.{make.__qualname__}-{asked}"
        path = kept_file(name, lambda path: path.write_bytes(pickle.dumps(make(*args, **kwargs))))
        return pickle.loads(path.read_bytes())

    return answer
