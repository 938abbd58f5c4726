"""springscale calibrate: known-load drives to a calibration file."""

import shlex
from collections.abc import Iterable, Iterator, Sequence
from math import isnan
from pathlib import Path
from typing import get_args

import click

from gateway.calibration.campaign_file import Campaign, file_sha256, load_campaign
from gateway.calibration.file import CalibrationFile, load_calibration
from gateway.calibration.fitter_answers import doubts_of_vehicle
from gateway.calibration.from_drives import Outcome, calibrate_inspected, with_statements_tested
from gateway.calibration.inspection.across_runs import Inspection
from gateway.calibration.inspection.facts import InspectedRun
from gateway.calibration.inspection.finding import Finding, Kind
from gateway.calibration.judgement.advice import Verdict, verdicts_of
from gateway.calibration.judgement.assessment import Assessment, assess_calibration
from gateway.calibration.ratio_index.bands import BandChoice
from gateway.cli.options import (
    FILE,
    Parsed,
    as_json,
    batch_settings,
    run_numbers,
    window,
)
from gateway.cli.progress import counted, on_share
from gateway.config import ESTIMATOR_NAMES
from gateway.errors import CalibrationImpossibleError, ConfigurationError
from gateway.files.whole import refusal_told, write_whole
from gateway.offline.campaigns import inspect
from gateway.records import json_line
from gateway.stated.doubt import DoubtKind
from gateway.words import known, span


def inspection_sentences(inspection: Inspection) -> str:
    """A line a run, its findings below with what to do about each; then those of all runs together, and the usable
    runs.
    """
    lines: list[str] = []
    for one in inspection.runs:
        lines += [_run_line(one), *_finding_lines(one.findings)]
    if inspection.findings:
        lines += ["all runs together", *_finding_lines(inspection.findings)]
    return "\n".join([*lines, _in_all(inspection)])


def _in_all(inspection: Inspection) -> str:
    """How many runs are usable, and the loads they cover."""
    runs = [one.identification for one in inspection.usable if one.has_identification]
    counted = f"{len(inspection.usable)} of {len(inspection.runs)} runs can be used"
    if not runs:
        return counted
    payloads_kg, shares_pct = [run.payload_kg for run in runs], [run.front_share_pct for run in runs]
    loads = span(min(payloads_kg), max(payloads_kg), "kg")
    shares = span(min(shares_pct), max(shares_pct), "%", 1)
    return f"{counted}: {loads}, {shares} in front"


def _run_line(one: InspectedRun) -> str:
    batches = [batch for batch in (*one.identification.batches, *one.validating) if not batch.rejected]
    n_identifying = sum(not batch.rejected for batch in one.identification.batches)
    seconds = sum(batch.usable_share * batch.duration_s for batch in batches)
    n_validating = len(batches) - n_identifying
    driven = f"{n_identifying} batches for fitting, {n_validating} for validation, {seconds:.0f} s can be used"
    words = "left out" if not one.is_usable else "sound" if not one.findings else "usable"
    load = "load unknown" if isnan(one.run.payload_kg) else known(one.run.payload_kg, " kg")
    return f"run {one.run.number} {one.run.log} ({load}): {words}; {driven}"


def _finding_lines(findings: Iterable[Finding]) -> Iterator[str]:
    for finding in findings:
        yield f"    {finding.severity} {finding.kind}: {finding.text}"
        yield f"        {finding.advice}"


def inspection_json(inspection: Inspection) -> dict[str, object]:
    """The verdict on each run, the findings about all runs, and the refusal of the calibration, or null."""
    return {
        "refusal": inspection.refusal,
        "runs": [
            {
                "number": one.run.number,
                "log": one.run.log,
                "is_usable": one.is_usable,
                "findings": [finding.to_json() for finding in one.findings],
            }
            for one in inspection.runs
        ],
        "campaign_findings": [finding.to_json() for finding in inspection.findings],
    }


@click.command("calibrate")
@click.argument("campaign", type=FILE)
@click.option("--output", type=FILE, default=None, help="calibration file to write; not needed with --check")
@click.option("--estimator", "estimators", type=click.Choice(ESTIMATOR_NAMES), multiple=True, help="[default: all]")
@click.option(
    "--runs",
    "numbers",
    type=Parsed("numbers", run_numbers),
    default=None,
    help="these runs only, counted from 1: 1,5,10",
)
@click.option(
    "--like",
    "like",
    type=FILE,
    default=None,
    help="calibration of a vehicle of the same model, as the prior: one empty drive is then enough",
)
@click.option(
    "--bands",
    type=click.Choice(get_args(BandChoice)),
    default="campaign",
    show_default=True,
    help="of the ratio index: found on these drives, or the paper's Table 2",
)
@click.option("--check", "only_checks", is_flag=True, help="inspect the drives and write nothing; exits 1 on a refusal")
@click.option("--report", type=FILE, default=None, help="directory to write a report into: report.html, figures")
@window
@as_json
def calibrate(
    campaign: Path,
    output: Path | None,
    estimators: tuple[str, ...],
    numbers: tuple[int, ...] | None,
    like: Path | None,
    bands: BandChoice,
    only_checks: bool,
    report: Path | None,
    window_s: float | None,
    as_json: bool,
) -> None:
    """Fit every estimator on the identification parts of CAMPAIGN's runs."""
    if output is None and not only_checks:
        raise click.UsageError("name the calibration file to write with --output, or ask with --check")
    if like and estimators and "cross_spectrum" not in estimators:
        raise click.UsageError("--like is for cross_spectrum: the ratio index has nothing to inherit")
    require_places(output, report)
    loaded = load_campaign(campaign)
    sister = load_calibration(like) if like else None
    tell_doubts(loaded, sister)
    with counted("reading drives") as on_run:
        inspection = inspect(loaded, batch_settings(window_s), numbers=numbers, on_run=on_run)
    if sister:
        inspection = inspection.excusing(Kind.ONE_LOAD_ONLY)  # other loads were driven with the sister
    if only_checks and inspection.refusal is None:
        inspection = with_statements_tested(inspection, loaded.vehicle, sister)
    _tell_inspection(inspection, as_json=as_json, is_all=only_checks)
    if inspection.refusal is not None:
        raise CalibrationImpossibleError(f"{campaign}: {inspection.refusal}; the findings say how to mend it")
    if only_checks:
        return
    with counted("fitting") as on_step:
        outcome = calibrate_inspected(
            loaded.vehicle,
            inspection,
            where=str(loaded.path),
            sha256=file_sha256(loaded.path),
            estimators=estimators or ESTIMATOR_NAMES,
            bands=bands,
            like=sister,
            command=_command(campaign, estimators, numbers, sister, bands, window_s),
            on_fit=on_share(on_step, estimators or ESTIMATOR_NAMES),
        )
    verdict = written_and_judged(outcome, output, report)
    if as_json:
        told = {"verdict": verdict.to_json(), "inspection": inspection_json(outcome.inspection)}
        click.echo(json_line(_record(outcome.file, output) | told))
    else:
        click.echo(_sentences(outcome.file, output, said=inspection.warnings))
        click.echo(verdict.text)


def _command(
    campaign: Path,
    estimators: Sequence[str],
    numbers: Sequence[int] | None,
    like: CalibrationFile | None,
    bands: BandChoice,
    window_s: float | None,
) -> str:
    """The options that decide the result: the calibration's id depends on them too.

    The sister by her id. Without the places of its files: the same drives give the same calibration under any name.
    """
    words = ["springscale", "calibrate", campaign.name]
    words += [word for name in estimators for word in ("--estimator", name)]
    words += [] if numbers is None else ["--runs", ",".join(map(str, numbers))]
    words += [] if like is None else ["--like", like.id]
    words += ["--bands", bands]
    words += [] if window_s is None else ["--window-s", f"{window_s:g}"]
    return shlex.join(words)


def tell_doubts(campaign: Campaign, sister: CalibrationFile | None) -> None:
    """Prints what is unlikely of the vehicle, and the payload range to which percentages refer if none is stated: a van
    of 3.5 t carries far more than the default.
    """
    if not campaign.states_payload_range:
        low_kg, high_kg = campaign.vehicle.payload_range_kg
        click.echo(
            f"{campaign.path}: vehicle.payload_range_kg: not stated: using {low_kg:g} to {high_kg:g} kg, errors are in "
            "percent of it; write the axle weights with gross_limit_kg, or payload_range_kg = [0.0, 1200.0]",
            err=True,
        )
    for doubt in doubts_of_vehicle(campaign.vehicle, sister.vehicle if sister else None):
        if doubt.kind is DoubtKind.PAYLOAD and not campaign.states_payload_range:
            continue  # said above
        click.echo(f"{campaign.path}: unlikely: {doubt.sentence}", err=True)


def _tell_inspection(inspection: Inspection, *, as_json: bool, is_all: bool) -> None:
    """Print the inspection: as text always, as JSON only if no calibration follows, whose JSON contains it."""
    if not as_json:
        click.echo(inspection_sentences(inspection))
    elif is_all or inspection.refusal is not None:
        click.echo(json_line(inspection_json(inspection)))


def require_places(output: Path | None, report: Path | None) -> None:
    """Checked before minutes of work: the file and the directory can be written."""
    if output is not None and output.is_dir():
        raise click.UsageError(f"--output {output}: is a folder, not a file")
    if output is not None and not output.parent.is_dir():
        raise click.UsageError(f"--output {output}: there is no folder {output.parent}; make it first")
    if report is not None and report.exists() and not report.is_dir():
        raise click.UsageError(f"--report {report}: is a file, not a directory")


def written_and_judged(outcome: Outcome, output: Path | None, report: Path | None) -> Verdict:
    """Writes the calibration file, judges it by the estimator that the service runs, and writes the report if one is
    wanted.
    """
    if output is not None:
        with refusal_told(output, ConfigurationError):
            write_whole(output, outcome.file.to_json())
    with counted("judging"):
        assessment = assess_calibration(outcome)
    if report is not None:
        report_written(report, assessment)
    return verdicts_of(assessment)[0]


def report_written(directory: Path, assessment: Assessment) -> None:
    """Write the report, and print its path."""
    from gateway.reports.calibration.calibration_report import write_report_of  # noqa: PLC0415 # a vehicle has no matplotlib

    with counted("drawing") as on_chart:
        written = write_report_of(directory, assessment, on_chart)
    click.echo(str(written), err=True)


def _record(file: CalibrationFile, output: Path | None) -> dict[str, object]:
    return {
        "calibration_id": file.id,
        "output": str(output) if output else None,
        "estimators": list(file.estimators),
        "seen": file.seen.model_dump(mode="json"),
        "expected_errors": {name: errors.model_dump(mode="json") for name, errors in file.expected_errors.items()},
        "warnings": list(file.warnings),
    }


def _sentences(file: CalibrationFile, output: Path | None, said: Sequence[str]) -> str:
    """The finished calibration in sentences, without the warnings that were printed already (``said``)."""
    low, high = file.seen.payload_kg
    lines = [
        f"{output or 'no file written'}: {', '.join(file.estimators)}; payloads {low:.4g} to {high:.4g} kg, "
        f"{len(file.provenance.drives)} runs, {sum(one.n_batches for one in file.provenance.drives)} batches",
        f"id {file.id}",
        *([f"prior from its sister {file.sister_id}"] if file.sister_id else []),
        *(f"warning: {warning}" for warning in file.warnings if warning not in said),
    ]
    return "\n".join(lines)
