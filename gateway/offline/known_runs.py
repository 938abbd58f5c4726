"""A campaign's drives as known runs: cut into an identification and a validation part, then into batches."""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from gateway.bus.logs.report import LogReport
from gateway.bus.signals.signal_map import SignalMap, load_signal_map
from gateway.calibration.campaign import Campaign, RunTable
from gateway.calibration.inspection_log import LogFacts
from gateway.calibration.inspection_rows import RowFacts, row_facts
from gateway.core.known_run import KnownRun
from gateway.core.settings import BatchSettings
from gateway.errors import CampaignError, LogUnreadableError
from gateway.offline.batches import Stretch, batches_of_motion, read_whole_log, rows_within
from gateway.records import Motion
from gateway.units import NS_PER_S

LOST_LINES_SHARE: Final = 1e-3

OnRun = Callable[[int, int], None]  # (runs done, runs in all)


@dataclass(frozen=True, slots=True)
class SplitRun:
    """One drive's two parts; either may hold no batch. ``sha256`` is of the log file, ``facts`` are of both parts.

    has_identification is False where the campaign keeps the whole drive for validation; ``read`` says how its log
    was read.
    """

    log: Path
    sha256: str
    identification: KnownRun
    validation: KnownRun
    facts: RowFacts = field(default_factory=RowFacts)
    has_identification: bool = True
    read: LogFacts = field(default_factory=LogFacts)


def chosen_runs(campaign: Campaign, numbers: Sequence[int] | None) -> list[tuple[int, RunTable]]:
    """Runs with their numbers from 1; all, or those named. Raises CampaignError for a number that is not there."""
    numbered = list(enumerate(campaign.runs, 1))
    if numbers is None:
        return numbered
    unknown = [n for n in numbers if not 1 <= n <= len(numbered)]
    if unknown:
        raise CampaignError(f"{campaign.path}: there is no run {unknown[0]}: runs are numbered 1 to {len(numbered)}")
    return [numbered[n - 1] for n in dict.fromkeys(numbers)]


def split_runs(
    campaign: Campaign,
    settings: BatchSettings,
    *,
    numbers: Sequence[int] | None = None,
    on_run: OnRun = lambda done, of: None,
    keeps_unreadable: bool = False,
) -> list[SplitRun]:
    """Reads the logs of the chosen runs. Batches begin anew at the cut between the two parts.

    Raises LogUnreadableError for a log that cannot be read, or keeps it as a run without rows whose ``read`` says why.
    """
    signal_map = load_signal_map(campaign.signals)
    runs = chosen_runs(campaign, numbers)
    found = []
    for done, (number, run) in enumerate(runs):
        on_run(done, len(runs))
        try:
            found.append(_split_run(campaign, number, run, signal_map, settings))
        except LogUnreadableError as fault:
            if not keeps_unreadable:
                raise
            blank = KnownRun(number, str(run.log), run.payload_kg, campaign.front_share_pct(run), ())
            found.append(SplitRun(campaign.log_of(run), "", blank, blank, read=LogFacts(unreadable=str(fault))))
    on_run(len(runs), len(runs))
    return found


def _split_run(
    campaign: Campaign, number: int, run: RunTable, signal_map: SignalMap, settings: BatchSettings
) -> SplitRun:
    log = campaign.log_of(run)
    whole, report = read_whole_log(log, signal_map)
    motion = rows_within(whole, Stretch(run.start_s, run.end_s))
    parts = []
    stretches = _parts(motion, run, campaign.identification_fraction)
    for stretch in stretches:
        rows = rows_within(motion, stretch) if stretch and len(motion) else motion.part(0, 0)
        batches = batches_of_motion(rows, signal_map, settings)
        parts.append(KnownRun(number, str(run.log), run.payload_kg, campaign.front_share_pct(run), batches))
    sha256 = file_sha256(log)
    read = LogFacts(
        sha256=sha256,
        duration_s=float(np.ptp(whole.t_ns)) / NS_PER_S,
        start_s=run.start_s,
        span_ns=(int(motion.t_ns.min()), int(motion.t_ns.max())) if len(motion) else None,
        damage=_damage(report),
    )
    facts = row_facts(motion, signal_map.traits)
    return SplitRun(log, sha256, parts[0], parts[1], facts, stretches[0] is not None, read)


def _damage(report: LogReport) -> str | None:
    """What of a log was lost on its way, in words; None where hardly a line was."""
    if report.ended_early is not None:
        return f"the log ends early: {report.ended_early}"
    if report.n_rejected > LOST_LINES_SHARE * report.lines:
        return f"{report.n_rejected} of {report.lines} lines cannot be read"
    return None


def _parts(motion: Motion, run: RunTable, fraction: float) -> tuple[Stretch | None, Stretch | None]:
    """Identification and validation stretch of a run; None where there is none."""
    if run.split is not None:
        whole = Stretch()
        return (whole, None) if run.split == "identification" else (None, whole)
    duration_s = float(motion.t_ns[-1] - motion.t_ns[0]) / NS_PER_S if len(motion) else 0.0
    cut_s = fraction * duration_s
    return (
        Stretch(0.0, cut_s if fraction < 1.0 else None) if fraction > 0.0 else None,
        Stretch(cut_s, None) if fraction < 1.0 else None,
    )


def file_sha256(path: Path) -> str:
    """Hex digest of a file's bytes."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
