"""A campaign's drives as known runs: cut into an identification and a validation part, then into batches."""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from gateway.bus.signal_map import load_signal_map
from gateway.calibration.campaign import Campaign, RunTable
from gateway.calibration.inspection_rows import RowFacts, row_facts
from gateway.core.known_run import KnownRun
from gateway.core.settings import BatchSettings
from gateway.errors import CampaignError
from gateway.offline.batches import Stretch, batches_of_motion, motion_of_whole_log, rows_within
from gateway.records import Motion
from gateway.units import NS_PER_S

OnRun = Callable[[int, int], None]  # (runs done, runs in all)


@dataclass(frozen=True, slots=True)
class SplitRun:
    """One drive's two parts; either may hold no batch. ``sha256`` is of the log file, ``facts`` are of both parts.

    has_identification is False where the campaign keeps the whole drive for validation.
    """

    log: Path
    sha256: str
    identification: KnownRun
    validation: KnownRun
    facts: RowFacts = field(default_factory=RowFacts)
    has_identification: bool = True


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
) -> list[SplitRun]:
    """Reads the logs of the chosen runs. Batches begin anew at the cut between the two parts."""
    signal_map = load_signal_map(campaign.signals)
    runs = chosen_runs(campaign, numbers)
    found = []
    for done, (number, run) in enumerate(runs):
        on_run(done, len(runs))
        log = campaign.log_of(run)
        motion = rows_within(motion_of_whole_log(log, signal_map), Stretch(run.start_s, run.end_s))
        parts = []
        stretches = _parts(motion, run, campaign.identification_fraction)
        for stretch in stretches:
            rows = rows_within(motion, stretch) if stretch and len(motion) else motion.part(0, 0)
            batches = batches_of_motion(rows, signal_map, settings)
            parts.append(KnownRun(number, str(run.log), run.payload_kg, campaign.front_share_pct(run), batches))
        facts = row_facts(motion, signal_map.traits)
        found.append(SplitRun(log, file_sha256(log), parts[0], parts[1], facts, stretches[0] is not None))
    on_run(len(runs), len(runs))
    return found


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
