"""springscale reprocess: a fleet's archive of logs to a data set of estimates, on all cores or on a cluster."""

import sys

import click

from gateway.archive.job_run import JobStatus
from gateway.archive.manifest import load_manifest
from gateway.archive.places import place_of
from gateway.archive.reprocessing import Progress, Summary
from gateway.archive.reprocessing import reprocess as reprocess_archive
from gateway.archive.workers import local_workers, workers_of
from gateway.cli.options import as_json
from gateway.cli.progress import StatusLine
from gateway.records import json_line
from gateway.words import counted, some


@click.command("reprocess")
@click.argument("archive")
@click.option("--output", required=True, help="folder of the data set, here or in an object store (s3://)")
@click.option("--scheduler", default=None, help="address of a Dask scheduler, tcp://HOST:PORT [default: this computer]")
@click.option("--workers", type=click.IntRange(1), default=None, help="processes on this computer [default: its cores]")
@as_json
def reprocess(
    archive: str,
    output: str,
    scheduler: str | None,
    workers: int | None,
    as_json: bool,
) -> None:
    """Reprocesses every log of ARCHIVE: a manifest (.toml), or a folder with an archive.toml in it.

    Jobs with a receipt are not done again, so that a stopped run resumes. See docs/archive.md.
    """
    if scheduler is not None and workers is not None:
        raise click.UsageError("give --scheduler ADDRESS or --workers N, not both")
    dataset, manifest = place_of(output), load_manifest(archive)
    with local_workers(workers) if scheduler is None else workers_of(scheduler) as at_work, StatusLine() as line:
        summary = reprocess_archive(manifest, dataset, at_work, lambda progress: line.show(how_far(progress)))
    click.echo(json_line(summary.to_json()) if as_json else summary_in_words(summary, output))
    if not summary.is_good:
        sys.exit(1)


def how_far(progress: Progress) -> str:
    """ "weighing: 12 of 340 jobs, 1.2 of 34.0 GB, 52 MB/s, 11 min left" """
    pieces = "jobs" if progress.what == "weighing" else "logs"
    share = f"{progress.n_done} of {progress.n_total} {pieces}, {size(progress.done)} of {size(progress.total)}"
    left = "" if progress.remaining_s is None else f", {duration(progress.remaining_s)} left"
    return f"{progress.what}: {share}, {size(progress.rate)}/s{left}"


def summary_in_words(summary: Summary, output: str) -> str:
    batches = sum(outcome.n_batches for outcome in summary.outcomes)
    weighed = sum(outcome.n_weighed for outcome in summary.outcomes)
    counts = summary.counts
    lines = [
        f"{counted(summary.n_vehicles, 'vehicle')}, {counted(summary.n_logs, 'log')}, {size(summary.size)}: "
        f"{counted(summary.n_jobs, 'job')}",
        f"done now: {counts['done']}, {batches} batches, {weighed} of them weighed; done before: {counts['already']}",
        f"took {duration(summary.took_s)}; the data set is in {output}",
    ]
    if summary.copies:
        lines.append(f"left out, copies of other logs: {counted(len(summary.copies), 'log')}:")
        lines += some([f"{copy}: has the content of {log}" for copy, log in summary.copies.items()])
    if summary.of_others:
        lines.append("logs that two vehicles have, and that are weighed for both: one of each is misfiled:")
        lines += some([f"{one}: has the content of {log}" for one, log in summary.of_others.items()])
    failures = [
        reason for outcome in summary.outcomes for reason in outcome.failures if outcome.status is not JobStatus.LOST
    ]
    if failures:
        lines.append(f"failed: {counted(summary.n_failed_logs, 'log')}:")
        lines += some(failures)
    if refused := [text for outcome in summary.outcomes for text in outcome.refused]:
        lines.append("frames refused, which explains batches that were not weighed:")
        lines += some(refused)
    if overlaps := [text for outcome in summary.outcomes for text in outcome.overlaps]:
        lines.append("logs of the same time, whose drives may count twice or not at all: keep one of each:")
        lines += some(overlaps)
    if summary.lost:
        lines.append(f"not done: {len(summary.lost)}; run again to try them:")
        lines += some([f"{what}: {why}" for what, why in summary.lost.items()])
    return "\n".join(lines)


def size(n_bytes: float) -> str:
    """A number of bytes in a suitable unit: 999 B, 1.2 kB, 52.0 MB, ..."""
    for unit in ("B", "kB", "MB", "GB"):
        if n_bytes < 1000.0:
            return f"{n_bytes:.0f} {unit}" if unit == "B" else f"{n_bytes:.1f} {unit}"
        n_bytes /= 1000.0
    return f"{n_bytes:.1f} TB"


def duration(seconds: float) -> str:
    """A duration in a suitable unit: 42 s, 11 min, 3.5 h, 2.1 days."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    if seconds < 6000.0:
        return f"{seconds / 60.0:.0f} min"
    return f"{seconds / 3600.0:.1f} h" if seconds < 48 * 3600.0 else f"{seconds / 86400.0:.1f} days"
