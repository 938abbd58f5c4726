"""The texts of `springscale reprocess`: progress, amounts, results."""

from typing import Final

from gateway.archive.inventory import Forecast
from gateway.archive.reprocess import Progress, Summary
from gateway.archive.run import Status
from gateway.words import counted

MOST_TOLD: Final = 10  # failures, one line each; the data set has them all


def how_far(progress: Progress) -> str:
    """ "weighing: 12 of 340 jobs, 1.2 of 34.0 GB, 52 MB/s, 11 min left" """
    pieces = "jobs" if progress.what == "weighing" else "groups of logs"
    share = f"{progress.n_done} of {progress.n_total} {pieces}, {size(progress.done)} of {size(progress.total)}"
    left = "" if progress.remaining_s is None else f", {duration(progress.remaining_s)} left"
    return f"{progress.what}: {share}, {size(progress.rate)}/s{left}"


def forecast_in_words(ahead: Forecast) -> str:
    """What a run would do."""
    lines = [
        f"{counted(ahead.n_vehicles, 'vehicle')}, {counted(ahead.n_logs, 'log')}, {size(ahead.size)}",
        f"{counted(ahead.n_jobs, 'job')}: {ahead.n_done} done, {ahead.n_failed} failed before, "
        f"{ahead.n_jobs - ahead.n_done - ahead.n_failed} to do",
    ]
    if ahead.n_new_logs:
        new = counted(ahead.n_new_logs, "log")
        lines.append(f"not scanned yet: {new}; the scan shows their jobs")
    lines.append(f"to read: {size(ahead.size_to_do)}")
    if ahead.rate is not None and ahead.remaining_s is not None and ahead.size_to_do:
        source = "as earlier jobs went" if ahead.is_timed_before else "as one log went just now"
        lines.append(
            f"about {duration(ahead.remaining_s)} on {counted(ahead.n_workers, 'worker')}, "
            f"each reading {size(ahead.rate)}/s ({source})"
        )
    return "\n".join(lines)


def summary_in_words(summary: Summary, output: str) -> str:
    """What a run has done."""
    batches = sum(outcome.n_batches for outcome in summary.outcomes)
    weighed = sum(outcome.n_weighed for outcome in summary.outcomes)
    counts = summary.counts
    lines = [
        f"{counted(summary.n_vehicles, 'vehicle')}, {counted(summary.n_logs, 'log')}, {size(summary.size)}: "
        f"{counted(summary.n_jobs, 'job')}",
        f"done now: {counts['done']}, {batches} batches, of which {weighed} weighed; done before: {counts['already']}",
        f"took {duration(summary.took_s)}; the data set is in {output}",
    ]
    if counts["failed_before"]:
        lines.append(f"failed in an earlier run: {counts['failed_before']}; --retry-failed tries them again")
    failures = [
        reason for outcome in summary.outcomes for reason in outcome.failures if outcome.status is not Status.LOST
    ]
    if failures:
        lines.append(f"failed: {counted(counts['failed'], 'job')}, {counted(summary.n_failed_logs, 'log')}:")
        lines += _some(failures)
    if summary.lost:
        lines.append(f"not done: {len(summary.lost)}; run again to try them:")
        lines += _some([f"{what}: {why}" for what, why in summary.lost.items()])
    return "\n".join(lines)


def size(n_bytes: float) -> str:
    """In a suitable unit: 999 B, 1.2 kB, 52.0 MB, ..."""
    for unit in ("B", "kB", "MB", "GB"):
        if n_bytes < 1000.0:
            return f"{n_bytes:.0f} {unit}" if unit == "B" else f"{n_bytes:.1f} {unit}"
        n_bytes /= 1000.0
    return f"{n_bytes:.1f} TB"


def duration(seconds: float) -> str:
    """In a suitable unit: 42 s, 11 min, 3.5 h, 2.1 days."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    if seconds < 6000.0:
        return f"{seconds / 60.0:.0f} min"
    return f"{seconds / 3600.0:.1f} h" if seconds < 48 * 3600.0 else f"{seconds / 86400.0:.1f} days"


def _some(lines: list[str]) -> list[str]:
    rest = len(lines) - MOST_TOLD
    return [*(f"  {line}" for line in lines[:MOST_TOLD]), *([f"  and {rest} more"] if rest > 0 else [])]
