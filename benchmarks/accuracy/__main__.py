"""python -m benchmarks.accuracy: the studies that docs/accuracy.md shows. Each takes minutes.

    python -m benchmarks.accuracy coverage --vans 5 --seed 20265 --workers 2 --kept build/coverage --output docs

prints its table; ``--output`` writes the numbers (NAME.json). With ``--kept`` a study that was broken off resumes with
the cases that were finished.
"""

import json
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

import click

from benchmarks.accuracy import coverage, disturbances, ordinary_days
from benchmarks.accuracy import faults as on_faults
from benchmarks.accuracy.study import Study
from gateway.cli.options import FILE
from gateway.cli.progress import counted
from gateway.errors import SpringscaleError

STUDIES: Final[tuple[Study[Any], ...]] = (coverage.STUDY, disturbances.STUDY, ordinary_days.STUDY)
Command = Callable[..., None]
_workers = click.option("--workers", type=click.IntRange(min=1), default=1, show_default=True, help="processes")
_kept = click.option("--kept", type=FILE, default=None, help="directory of cases to resume from: read and stored there")
_output = click.option("--output", type=FILE, default=None, help="directory to write the numbers to")


def _seed(seed: int) -> Callable[[Command], Command]:
    return click.option("--seed", type=click.IntRange(min=0), default=seed, show_default=True)


@click.group()
def studies() -> None:
    """Experiments on calibration and estimation. Each takes minutes."""


def _add(study: Study[Any]) -> None:
    """The command of a study that needs nothing but its cases."""

    @studies.command(study.name, help=study.does)
    @click.option("--vans", "n", type=click.IntRange(min=2), default=study.n, show_default=True)
    @_seed(study.seed)
    @_workers
    @_kept
    @_output
    def _(n: int, seed: int, workers: int, kept: Path | None, output: Path | None) -> None:
        with counted(study.doing) as on_done:
            found = study.run(n, seed, workers=workers, kept=kept, on_done=on_done)
        _hand_out(study.name, found, study.section(found), output)


for one in STUDIES:
    _add(one)


@studies.command("faults")
@click.argument("campaign", type=FILE)
@click.option("--calibration", type=FILE, required=True, help="calibration file of that vehicle")
@click.option("--runs", type=click.IntRange(min=1), multiple=True, help="numbers of the drives [default: all]")
@_seed(on_faults.SEED)
@_workers
@_kept
@_output
def faults(
    campaign: Path,
    calibration: Path,
    runs: tuple[int, ...],
    seed: int,
    workers: int,
    kept: Path | None,
    output: Path | None,
) -> None:
    """The effect of faulty sensors on CAMPAIGN's drives: each log rewritten with each fault; ~2 minutes a drive."""
    drives = on_faults.Drives(campaign, calibration, runs or None, seed=seed)
    with counted("weighing drives with faulty sensors") as on_case:
        found = on_faults.faults(drives, workers=workers, kept=kept, on_case=on_case)
    _hand_out("sensor-faults", found, on_faults.section(found), output)


def _hand_out(name: str, found: Mapping[str, Any], section: str, output: Path | None) -> None:
    """Print the table; with ``output`` also write the numbers as a file."""
    if output is not None:
        output.mkdir(parents=True, exist_ok=True)
        (output / f"{name}.json").write_text(json.dumps(found, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    click.echo(section, nl=False)


if __name__ == "__main__":
    try:
        studies(prog_name="python -m benchmarks.accuracy")
    except SpringscaleError as fault:
        click.echo(str(fault), err=True)
        sys.exit(fault.exit_code)
