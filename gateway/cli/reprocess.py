"""springscale reprocess: a fleet's archive of logs to a data set of estimates, on all cores or on a cluster."""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Final

import click

from gateway.archive.cluster import Cluster, cluster
from gateway.archive.inventory import forecast, look
from gateway.archive.manifest import load_manifest
from gateway.archive.places import place_of
from gateway.archive.processes import Processes
from gateway.archive.reprocess import Progress
from gateway.archive.reprocess import reprocess as reprocess_archive
from gateway.cli.options import as_json, trusted_keys
from gateway.cli.text.progress import StatusLine
from gateway.cli.text.reprocess import forecast_in_words, how_far, summary_in_words
from gateway.files.signed import pinned_by
from gateway.records import json_line

TOLD_EVERY_S: Final = 5.0


@click.command("reprocess")
@click.argument("archive")
@click.option(
    "--output", required=True, help="folder of the data set, here or in an object store (s3://, gs://, az://)"
)
@click.option("--scheduler", default=None, help="address of a Dask scheduler, tcp://HOST:PORT [default: this computer]")
@click.option("--workers", type=click.IntRange(1), default=None, help="processes on this computer [default: its cores]")
@click.option("--dry-run", is_flag=True, help="print how much there is and how long it will take; write nothing")
@click.option("--keep-going", is_flag=True, help="end with 0 although logs could not be read or jobs failed")
@click.option("--retry-failed", is_flag=True, help="also try those jobs again that gave no result")
@trusted_keys
@as_json
def reprocess(
    archive: str,
    output: str,
    scheduler: str | None,
    workers: int | None,
    dry_run: bool,
    keep_going: bool,
    retry_failed: bool,
    trusted_keys: Path | None,
    as_json: bool,
) -> None:
    """Reprocesses every log of ARCHIVE: a manifest (.toml or .parquet), or a folder with an archive.toml in it.

    Jobs with a receipt are not done again, so that a stopped run resumes. With --json, progress
    comes as JSON lines on standard error. See docs/archive.md.
    """
    if scheduler is not None and workers is not None:
        raise click.UsageError("give --scheduler ADDRESS or --workers N, not both")
    dataset, manifest = place_of(output), load_manifest(archive, pinned_by(trusted_keys))
    with _workers(scheduler, workers) as at_work:
        if dry_run:
            ahead = forecast(look(manifest, dataset), at_work.n_workers)
            click.echo(json_line(ahead.to_json()) if as_json else forecast_in_words(ahead))
            return
        with StatusLine() as line:
            tell = _Progress() if as_json else lambda progress: line.show(how_far(progress))
            summary = reprocess_archive(manifest, dataset, at_work, tell, retry_failed=retry_failed)
    click.echo(json_line(summary.to_json()) if as_json else summary_in_words(summary, output))
    if not (summary.is_good or (keep_going and not summary.lost)):
        sys.exit(1)


class _Progress:
    """A line of JSON on standard error every few seconds, for a scheduler that watches the run."""

    def __init__(self) -> None:
        self._next_s = 0.0

    def __call__(self, progress: Progress) -> None:
        """Print the progress if it is time to, or at the last piece."""
        if time.monotonic() >= self._next_s or progress.n_done == progress.n_total:
            self._next_s = time.monotonic() + TOLD_EVERY_S
            click.echo(json_line(asdict(progress) | {"remaining_s": progress.remaining_s}), err=True)


@contextmanager
def _workers(scheduler: str | None, n_workers: int | None) -> Iterator[Processes | Cluster]:
    """The executor of the jobs; stopped at once when the command stops."""
    workers = Processes(n_workers) if scheduler is None else cluster(scheduler)
    try:
        yield workers
    except BaseException:
        workers.shutdown(wait=False, cancel_futures=True)
        raise
    workers.shutdown()
