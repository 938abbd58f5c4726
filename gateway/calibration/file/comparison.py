"""In what two calibration files differ: facts as they stand, fitted figures in combined standard deviations."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

from gateway.calibration.file.calibration_file import CalibrationFile
from gateway.calibration.file.figures import Figure, figures_of

# Fitted arrays: compared as figures. The rest of these names is identity, which says nothing by itself.
_LEFT_OUT: Final = frozenset({"id", "migrated_from", "parameters", "covariance", "names", "coefficients",
                              "gram_inverse", "terms", "information", "pull"})  # fmt: skip


@dataclass(frozen=True, slots=True)
class Difference:
    """One place where two files differ. ``n_std``: in combined standard deviations; None for a plain fact.

    ``one`` and ``other`` are as in the files; None where that file does not have the place.
    """

    where: str
    one: Any
    other: Any
    n_std: float | None = None


def differences(one: CalibrationFile, other: CalibrationFile) -> tuple[Difference, ...]:
    """All of them: plain facts in the order of the file, then fitted figures, the most different first."""
    fitted = sorted(_fitted(one, other), key=lambda difference: -(difference.n_std or 0.0))
    return (*_plain(one, other), *fitted)


def _plain(one: CalibrationFile, other: CalibrationFile) -> Iterator[Difference]:
    """Of a part that one file lacks, such as the line that the other inherited from, the first fact stands for all."""
    mine, its = (file.model_dump(mode="json") for file in (one, other))
    lacked = {name for name in mine if (mine[name] is None) != (its[name] is None)}
    ours, theirs = dict(_leaves(mine)), dict(_leaves(its))
    told = set()
    for where in dict.fromkeys([*ours, *theirs]):
        part = where.partition(".")[0]
        if ours.get(where) == theirs.get(where) or (part in lacked and part in told):
            continue
        told.add(part)
        yield Difference(where, ours.get(where), theirs.get(where))


def _leaves(content: Any, where: str = "") -> Iterator[tuple[str, Any]]:
    """Every fact of a JSON object with its place; tables in lists are counted from 1."""
    if isinstance(content, dict):
        for key, part in content.items():
            if key not in _LEFT_OUT:
                yield from _leaves(part, f"{where}.{key}" if where else key)
    elif isinstance(content, list) and any(isinstance(part, dict) for part in content):
        for number, part in enumerate(content, 1):
            yield from _leaves(part, f"{where}[{number}]")
    else:
        yield where, content


def _fitted(one: CalibrationFile, other: CalibrationFile) -> Iterator[Difference]:
    ours, theirs = _by_place(one), _by_place(other)
    for where in dict.fromkeys([*ours, *theirs]):
        a, b = ours.get(where), theirs.get(where)
        if a is None or b is None:
            yield Difference(where, a and a.centre, b and b.centre)
        elif (a.centre, a.std) != (b.centre, b.std):
            yield Difference(where, a.centre, b.centre, a.distance(b))


def _by_place(file: CalibrationFile) -> dict[str, Figure]:
    return {f"{part}.{figure.name}": figure for part, figures in figures_of(file).items() for figure in figures}
