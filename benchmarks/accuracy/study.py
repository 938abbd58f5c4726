"""What every study is: cases that are computed one by one, the numbers made of them, and their table.

    STUDY = Study("coverage", ..., of_case=of_one_van, numbers=numbers, section=section)
    found = STUDY.run(n_cases, seed)

The command line (``__main__``) is made from these objects. Cases run one after another or in several processes, with
progress; with a directory for finished cases a broken run resumes where it ended.
"""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Generic, TypeVar, get_type_hints

from pydantic import ConfigDict, TypeAdapter

Case = TypeVar("Case")
OnDone = Callable[[int, int], None]  # (cases done, cases in all)


@dataclass(frozen=True, slots=True)
class Study(Generic[Case]):
    """One study. ``of_case`` computes one case, of ``n`` vans, from the seed and its number, independent of all others.

    ``numbers`` makes what the JSON file holds from the seed, how many were asked for and the cases in order;
    ``section`` makes the part of docs/accuracy.md from these numbers alone.
    """

    name: str
    does: str
    doing: str
    of_case: Callable[[int, int], Case]
    numbers: Callable[[int, int, Sequence[Case]], dict[str, Any]]
    section: Callable[[Mapping[str, Any]], str]
    seed: int
    n: int

    def run(
        self,
        n: int,
        seed: int,
        *,
        workers: int = 1,
        kept: Path | None = None,
        on_done: OnDone = lambda done, of: None,
    ) -> dict[str, Any]:
        """Compute the cases and return the numbers."""
        return self.numbers(seed, n, self.cases(n, seed, workers=workers, kept=kept, on_done=on_done))

    def cases(
        self,
        n: int,
        seed: int,
        *,
        workers: int = 1,
        kept: Path | None = None,
        on_done: OnDone = lambda done, of: None,
    ) -> list[Case]:
        """The result of each case, in order. It does not depend on the number of processes."""
        one, stored = partial(self.of_case, seed), partial(self._stored, seed)
        return cases_of(one, n, workers=workers, kept=kept, stored=stored, on_done=on_done)

    def _stored(self, seed: int, number: int) -> str:
        return f"{self.name}-{seed}-{number}"


def cases_of(
    of_case: Callable[[int], Case],
    n_cases: int,
    *,
    workers: int,
    kept: Path | None,
    stored: Callable[[int], str],
    on_done: OnDone,
) -> list[Case]:
    """Every case, read from ``kept`` if an earlier run left it there under its name, else computed and left there."""
    one = partial(_case, of_case, kept, stored)
    cases: list[Case] = []
    on_done(0, n_cases)
    if workers <= 1:
        for number in range(n_cases):
            cases.append(one(number))
            on_done(len(cases), n_cases)
        return cases
    with ProcessPoolExecutor(workers) as pool:
        for case in pool.map(one, range(n_cases)):
            cases.append(case)
            on_done(len(cases), n_cases)
    return cases


def _case(of_case: Callable[[int], Case], kept: Path | None, stored: Callable[[int], str], number: int) -> Case:
    if kept is None:
        return of_case(number)
    path, adapter = kept / f"{stored(number)}.json", _adapter_of(of_case)
    if path.exists():
        (found,) = adapter.validate_json(b"[" + path.read_bytes() + b"]")
        return found
    found = of_case(number)
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_suffix(".part")
    unfinished.write_bytes(adapter.dump_json((found,))[1:-1])
    unfinished.replace(path)
    return found


def _adapter_of(of_case: Callable[..., Case]) -> TypeAdapter[tuple[Case]]:
    """For a tuple of what the function says it returns: inside a tuple NaN is written, and read again."""
    function = of_case
    while isinstance(function, partial):
        function = function.func
    returned: Any = get_type_hints(function)["return"]
    return TypeAdapter(tuple[returned], config=ConfigDict(ser_json_inf_nan="constants"))
