"""springscale fleet-report: a page of a fleet's data set, and one for each vehicle."""

from pathlib import Path

import click

from gateway.archive import place_of
from gateway.archive.fleet.fleet import fleet_of
from gateway.cli.options import FILE, Told, prints
from gateway.cli.progress import counted
from gateway.reports.fleet.report import write_fleet_report


@click.command("fleet-report")
@click.argument("dataset")
@click.option("--output", type=FILE, required=True, help="directory to write; an earlier report is written over")
@prints
def fleet_report(dataset: str, output: Path) -> Told:
    """A report on each vehicle of DATASET, the output of `springscale reprocess`.

    Loads over time with intervals, refused batches by reason, drifts beyond the fleet's seasons and beyond chance,
    faulty sensors: report.html with what needs attention, a page for each vehicle, and report.json. DATASET is a folder
    or a URL (s3://). Only batches with a receipt are counted.
    """
    with counted("reading vehicles") as on_step:
        fleet = fleet_of(place_of(dataset), lambda done, of: on_step(done, 2 * of + 1))
        report = write_fleet_report(
            output, fleet, dataset, lambda done, of: on_step(of - 1 + done, 2 * of - 1, "pages")
        )
    return {"report": str(report), "numbers": str(output / "report.json")}, str(report)
