"""springscale reproduce: the paper's section 4 with our simulator."""

from pathlib import Path
from typing import Final

import click

from gateway.cli.options import FILE, Told, prints
from gateway.cli.progress import counted
from gateway.reports.paper.experiments import N_STEPS, Extent
from gateway.reports.paper.reproduction import reproduce as write_report

QUICK_WINDOW_S: Final = 100.0  # chosen: a third of the usual window
QUICK_LONGEST_S: Final = 155.0  # chosen: two thirds of it, which identify, hold one batch


@click.command("reproduce")
@click.option("--output", type=FILE, required=True, help="directory to write; must contain no reproduction yet")
@click.option(
    "--seed", type=click.IntRange(min=0), default=1, show_default=True, help="decides roads, speeds and noise"
)
@click.option(
    "--quick", is_flag=True, help="a quarter of the driving and batches of 100 s: to try it out, not to judge"
)
@click.option("--workers", type=click.IntRange(min=1), default=1, show_default=True, help="processes that simulate")
@prints
def reproduce(output: Path, seed: int, quick: bool, workers: int) -> Told:
    """The paper's figures and tables, its numbers beside ours, as report.html with all its files."""
    whole = Extent(seed, workers=workers)
    extent = Extent(seed, QUICK_WINDOW_S, QUICK_LONGEST_S, workers) if quick else whole
    with counted("starting") as on_step:
        report = write_report(output, extent, lambda what, done, of: on_step(done, of, what))
        on_step(N_STEPS, N_STEPS)
    return {"report": str(report), "results": str(output / "report.json")}, str(report)
