"""A campaign's drives: read, split into identification and validation, inspected, calibrated and judged."""

import hashlib
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Final, Literal

import numpy as np

from gateway.bus.logs import LogReport, motion_of_log
from gateway.bus.signals import Decoder, SignalMap, load_signal_map
from gateway.bus.signals.decode import SignalCounts
from gateway.bus.signals.mapping import MappedMessage, id_name
from gateway.calibration.campaign_file import Campaign, OnRun, RunTable, chosen_runs, file_sha256
from gateway.calibration.inspection.across_runs import Inspection, inspect_drives
from gateway.calibration.inspection.facts import InspectedRun, LogFacts, row_facts
from gateway.calibration.judgement.evaluation import Judged, judge
from gateway.calibration.stated_drive import StatedDrive
from gateway.core.batch_settings import BatchSettings
from gateway.core.scheduler import Scheduler
from gateway.errors import CalibrationImpossibleError, LogUnreadableError
from gateway.records import Batch, Motion, Signal, joined
from gateway.units import NS_PER_S
from gateway.weighing.calibrated import CalibratedVehicle


def read_whole_log(log: Path, signal_map: SignalMap) -> tuple[Motion, LogReport]:
    """All rows of one log that the estimate needs, and the reader's report.

    Raises LogUnreadableError if nothing can be read.
    """
    motions, report = motion_of_log(log, signal_map)
    parts = list(motions)
    report.require_frames()
    return joined(parts).weighing, report


def rows_within(motion: Motion, start_s: float = 0.0, end_s: float = math.inf) -> Motion:
    """Rows with stamps in [start, end), in seconds from the first row."""
    since_ns = motion.t_ns - motion.t_ns[:1]
    return motion.rows((since_ns >= np.rint(start_s * NS_PER_S)) & (since_ns < np.rint(end_s * NS_PER_S)))


def batches_of_motion(motion: Motion, signal_map: SignalMap, settings: BatchSettings) -> tuple[Batch, ...]:
    """Every batch of these rows."""
    scheduler = Scheduler(settings, signal_map.traits)
    return (*scheduler.feed(motion), *scheduler.flush())


Split = Literal["identification", "validation", "all"]

LOST_LINES_SHARE: Final = 1e-3  # chosen: of a log's lines; fewer are not reported


def split_runs(
    campaign: Campaign,
    settings: BatchSettings,
    *,
    numbers: Sequence[int] | None = None,
    on_run: OnRun = lambda done, of: None,
    keeps_unreadable: bool = False,
) -> list[InspectedRun]:
    """Read the logs of the chosen runs. Batches restart at the cut between the two parts.

    Raises LogUnreadableError for an unreadable log, or keeps it as a run without rows whose ``log`` has the reason.
    """
    signal_map = load_signal_map(campaign.signals)
    runs = chosen_runs(campaign, numbers)
    drives = []
    for done, (number, run) in enumerate(runs):
        on_run(done, len(runs))
        try:
            drives.append(_split_run(campaign, number, run, signal_map, settings))
        except LogUnreadableError as fault:
            if not keeps_unreadable:
                raise
            drives.append(InspectedRun(campaign.drive(number, run, ()), log=LogFacts(unreadable=str(fault))))
    on_run(len(runs), len(runs))
    return drives


def _split_run(
    campaign: Campaign, number: int, run: RunTable, signal_map: SignalMap, settings: BatchSettings
) -> InspectedRun:
    log = campaign.log_of(run)
    whole, report = read_whole_log(log, signal_map)
    motion = rows_within(whole, run.start_s, run.end_s or math.inf)
    fraction = campaign.identification_fraction
    if run.split is not None:
        fraction = 1.0 if run.split == "identification" else 0.0
    duration_s = float(motion.t_ns[-1] - motion.t_ns[0]) / NS_PER_S if len(motion) else 0.0
    cut_s = fraction * duration_s if fraction < 1.0 else math.inf
    parts = rows_within(motion, end_s=cut_s), rows_within(motion, cut_s)
    first, last = (batches_of_motion(rows, signal_map, settings) for rows in parts)
    return InspectedRun(
        campaign.drive(number, run, first),
        last,
        row_facts(parts[0 if fraction > 0.0 else 1], signal_map.traits),
        has_identification=fraction > 0.0,
        log=facts_of_log(log, whole, motion, report, signal_map, run.start_s),
    )


def facts_of_log(
    log: Path, whole: Motion, motion: Motion, report: LogReport, signal_map: SignalMap, start_s: float = 0.0
) -> LogFacts:
    """What reading a log showed, of which ``motion`` is the piece that is used."""
    return LogFacts(
        sha256=file_sha256(log),
        samples=hashlib.sha256(np.ascontiguousarray(whole.columns).data).hexdigest(),
        duration_s=float(np.ptp(whole.t_ns)) / NS_PER_S,
        start_s=start_s,
        span_ns=(int(motion.t_ns.min()), int(motion.t_ns.max())) if len(motion) else None,
        damage=_damage(report),
        silent=_silent(report.decoder, motion, signal_map) if report.decoder else {},
        mismatches=tuple((one.text, one.share, one.signals) for one in report.causes()),
    )


def _silent(decoder: Decoder, motion: Motion, signal_map: SignalMap) -> dict[Signal, str]:
    """Why mapped inertial signals have hardly a sample."""
    wanted = (Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE, Signal.ROLL_RATE)
    silent = [signal for signal in wanted if signal in motion.signals and len(motion.of(signal)[1]) < 2]
    return {signal: _why_silent(decoder.counts[signal], signal_map.message_of(signal)) for signal in silent}


def _why_silent(counts: SignalCounts, message: MappedMessage) -> str:
    named = f"{message.name} ({id_name(message.frame_id)})"
    if n := sum(counts.rejected.values()):
        reasons = ", ".join(f"{k} {reason.replace('_', ' ')}" for reason, k in sorted(counts.rejected.items()))
        return f"{n} frames of {named} came, none valid: {reasons}"
    if counts.samples:
        return f"{counts.samples} frames of {named} came, none of them within the run"
    return f"nothing of {named} came; springscale look shows what did"


def _damage(report: LogReport) -> str | None:
    """The lost part of a log, in words; None if it is negligible."""
    if report.ended_early is not None:
        return f"the log ends early: {report.ended_early}"
    if report.n_rejected > LOST_LINES_SHARE * report.lines:
        return f"{report.n_rejected} of {report.lines} lines cannot be read"
    return None


def inspect(
    campaign: Campaign,
    settings: BatchSettings,
    *,
    numbers: Sequence[int] | None = None,
    on_run: OnRun = lambda done, of: None,
) -> Inspection:
    """Read the logs of the chosen runs and find their faults."""
    split = split_runs(campaign, settings, numbers=numbers, on_run=on_run, keeps_unreadable=True)
    signal_map = load_signal_map(campaign.signals)
    has_roll_rate = Signal.ROLL_RATE in signal_map.signals
    return inspect_drives(split, campaign.vehicle, settings, has_roll_rate=has_roll_rate)


def judge_campaign(
    campaign: Campaign,
    calibrated: CalibratedVehicle,
    settings: BatchSettings,
    *,
    estimator: str,
    split: Split = "validation",
    on_run: OnRun = lambda done, of: None,
) -> list[Judged]:
    """Every batch of one part of every run with its estimate.

    Raises CalibrationImpossibleError if that part has no batch to judge.
    """
    runs = split_runs(campaign, settings, on_run=on_run)
    judged = judge((part for run in runs for part in _judged_parts(run, split)), calibrated, estimator)
    if not judged:
        raise CalibrationImpossibleError(
            f"{campaign.path}: the {split} part of its runs holds no batch: identification_fraction "
            f"{campaign.identification_fraction:g} and the runs' split leave nothing to evaluate"
        )
    return judged


def _judged_parts(run: InspectedRun, split: Split) -> list[StatedDrive]:
    parts = {"identification": [run.identification], "validation": [run.validation]}
    return parts.get(split, [run.identification, run.validation])
