"""Stored batches of a known load as a run for calibration, with the same inspection and fit as for logs."""

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from gateway.calibration.campaign import Campaign
from gateway.calibration.inspection.campaign import Inspection, inspect_drives
from gateway.calibration.inspection.log import LogFacts, SplitRun
from gateway.calibration.inspection.rows import RowFacts, Stream
from gateway.calibration.kept.batch_file import KeptBatch
from gateway.calibration.known_run import KnownRun
from gateway.core.settings import BatchSettings
from gateway.records import Signal

ESTIMATORS: Final = ("cross_spectrum",)  # the ratio index needs many loads


def split_run_of(run: KnownRun, kept: Sequence[KeptBatch]) -> SplitRun:
    """A run without a log, of stored batches (at least one): ``run`` has its number, name and load.

    All batches are for identification: a calibration is validated on loads that it has not seen.
    """
    batches = tuple(one.batch for one in kept)
    facts = joined_facts([one.facts for one in kept])
    ids = hashlib.sha256("\n".join(one.id for one in kept).encode()).hexdigest()
    span_ns = (min(batch.t_start_ns for batch in batches), max(batch.t_end_ns for batch in batches))
    log = LogFacts(sha256=ids, duration_s=facts.duration_s, span_ns=span_ns)
    return SplitRun(replace(run, batches=batches), replace(run, batches=()), facts, log=log)


def inspect_kept(campaign: Campaign, split: Sequence[SplitRun], settings: BatchSettings) -> Inspection:
    """Findings about each of these runs; ``campaign`` has their vehicle."""
    has_roll_rate = any(Signal.ROLL_RATE in run.facts.streams for run in split)
    return inspect_drives(split, campaign.vehicle, settings, has_roll_rate=has_roll_rate)


def joined_facts(parts: Sequence[RowFacts]) -> RowFacts:
    """Facts of several stretches (at least one) as of one drive; quantiles of the whole are taken from those of the
    parts.
    """
    signals = dict.fromkeys(signal for part in parts for signal in part.streams)
    streams = {
        signal: _joined_stream([part.streams[signal] for part in parts if signal in part.streams]) for signal in signals
    }
    return RowFacts(sum(part.duration_s for part in parts), streams)


def _joined_stream(streams: Sequence[Stream]) -> Stream:
    """Scatter by the law of total variance; the widest range of all parts."""
    spoke = [stream for stream in streams if stream.n >= 2]
    if len(spoke) < 2:
        return spoke[0] if spoke else streams[0]
    n = np.array([stream.n for stream in spoke], float)
    means = np.array([stream.mean for stream in spoke])
    mean = float(np.average(means, weights=n))
    variances = np.array([stream.std for stream in spoke]) ** 2 + (means - mean) ** 2
    return Stream(
        n=int(n.sum()),
        rate_hz=float(np.average([stream.rate_hz for stream in spoke], weights=n)),
        jitter_share=float(np.average([stream.jitter_share for stream in spoke], weights=n)),
        mean=mean,
        std=float(np.sqrt(np.average(variances, weights=n))),
        low=min(stream.low for stream in spoke),
        middle=float(np.average([stream.middle for stream in spoke], weights=n)),
        high=max(stream.high for stream in spoke),
        resolution=spoke[0].resolution,
    )
