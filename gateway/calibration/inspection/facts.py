"""A drive as it is inspected: its two parts, the facts of its rows before they are cut into batches, those of its log,
and what was found of it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import nan

import numpy as np

from gateway.calibration.inspection.finding import Finding, Severity
from gateway.calibration.stated_drive import StatedDrive
from gateway.core.batch import Traits
from gateway.core.timeline import sample_rate_hz
from gateway.records import ASIDE, Batch, Motion, SensorTraits, Signal
from gateway.units import NS_PER_S


@dataclass(frozen=True, slots=True)
class Stream:
    """One signal's samples: rate, unevenness as a share of the interval, and its distribution in SI."""

    n: int
    rate_hz: float
    jitter_share: float
    mean: float
    std: float
    low: float
    high: float
    resolution: float


@dataclass(frozen=True, slots=True)
class RowFacts:
    """Facts about one drive's rows; ``streams`` has every mapped signal that an estimate uses."""

    duration_s: float = 0.0
    streams: Mapping[Signal, Stream] = field(default_factory=dict)

    def mean(self, signal: Signal) -> float:
        """NaN without a sample."""
        return self.streams[signal].mean if signal in self.streams else nan


def row_facts(motion: Motion, traits: Traits) -> RowFacts:
    """Facts of the rows in any order; low and high of a stream are its 5 and 95 % quantiles.

    A journey's signals are left out: they need no check here, and the vehicle's positions are private.
    """
    motion = motion.weighing
    duration_s = float(np.ptp(motion.t_ns)) / NS_PER_S if len(motion) else 0.0
    signals = [signal for signal in motion.signals if signal not in ASIDE]
    return RowFacts(duration_s, {one: _stream(motion, one, traits.get(one, SensorTraits())) for one in signals})


def _stream(motion: Motion, signal: Signal, trait: SensorTraits) -> Stream:
    t_ns, x = motion.of(signal)
    if len(x) < 2:
        return Stream(len(x), 0.0, nan, nan, nan, nan, nan, trait.resolution)
    early, usual, late = np.quantile(np.diff(np.sort(t_ns)), [0.1, 0.5, 0.9])
    low, high = (float(q) for q in np.quantile(x, [0.05, 0.95]))
    return Stream(
        n=len(x),
        rate_hz=sample_rate_hz(np.unique(t_ns)),
        jitter_share=float((late - early) / 2.0 / usual) if usual > 0.0 else nan,
        mean=float(np.mean(x)),
        std=float(np.std(x)),
        low=low,
        high=high,
        resolution=trait.resolution,
    )


def joined_facts(parts: Sequence[RowFacts]) -> RowFacts:
    """Facts of several stretches (at least one) as of one drive: scatter by the law of total variance, the widest range
    of all parts.
    """
    streams = {}
    for signal in dict.fromkeys(signal for part in parts for signal in part.streams):
        each = [part.streams[signal] for part in parts if signal in part.streams]
        spoke = [stream for stream in each if stream.n >= 2]
        streams[signal] = _joined(spoke) if len(spoke) > 1 else (spoke or each)[0]
    return RowFacts(sum(part.duration_s for part in parts), streams)


def _joined(streams: Sequence[Stream]) -> Stream:
    n = np.array([stream.n for stream in streams], float)
    means = np.array([stream.mean for stream in streams])
    mean = float(np.average(means, weights=n))
    variances = np.array([stream.std for stream in streams]) ** 2 + (means - mean) ** 2
    return Stream(
        n=int(n.sum()),
        rate_hz=float(np.average([stream.rate_hz for stream in streams], weights=n)),
        jitter_share=float(np.average([stream.jitter_share for stream in streams], weights=n)),
        mean=mean,
        std=float(np.sqrt(np.average(variances, weights=n))),
        low=min(stream.low for stream in streams),
        high=max(stream.high for stream in streams),
        resolution=streams[0].resolution,
    )


@dataclass(frozen=True, slots=True)
class LogFacts:
    """The result of reading a run's log.

    ``samples`` is the hash of what was decoded, which a log has in common with its copies of any packing and format.
    ``duration_s`` is of the whole log, ``span_ns`` the first and last stamp of the run's piece of it, None if that
    piece is empty. ``unreadable`` says why nothing could be read, ``damage`` what was lost of it, ``silent`` why a
    mapped signal has no valid sample. ``mismatches`` say which frames do not fit the signal map: a sentence, their
    share of the message, and the signals that suffer.
    """

    sha256: str = ""
    samples: str = ""
    duration_s: float = 0.0
    start_s: float = 0.0
    span_ns: tuple[int, int] | None = (0, 0)
    unreadable: str | None = None
    damage: str | None = None
    silent: Mapping[Signal, str] = field(default_factory=dict)
    mismatches: tuple[tuple[str, float, frozenset[Signal]], ...] = ()

    def is_of_same_drive(self, other: "LogFacts") -> bool:
        """Whether both are of one log, or of its copy, and their pieces of it overlap."""
        if not self.samples or self.samples != other.samples or self.span_ns is None or other.span_ns is None:
            return False
        return self.span_ns[0] < other.span_ns[1] and other.span_ns[0] < self.span_ns[1]


@dataclass(frozen=True, slots=True)
class InspectedRun:
    """A drive in two parts, the facts of its rows and of its log, and the findings of the inspection.

    ``validating`` are the batches of the second part; either part may have none. has_identification is False if the
    campaign keeps the whole drive for validation. Only the identification part can spoil a calibration, so facts,
    batches and run are of that part alone, and of validation only if there is no other: the data that judge a
    calibration must not change it.
    """

    identification: StatedDrive
    validating: tuple[Batch, ...] = ()
    facts: RowFacts = field(default_factory=RowFacts)
    has_identification: bool = True
    log: LogFacts = field(default_factory=LogFacts)
    findings: tuple[Finding, ...] = ()

    @property
    def is_usable(self) -> bool:
        """False if a fault excludes the run from the calibration."""
        return all(finding.severity is not Severity.FAULT for finding in self.findings)

    @property
    def validation(self) -> StatedDrive:
        """The second part."""
        return replace(self.identification, batches=self.validating)

    @property
    def run(self) -> StatedDrive:
        """The part to inspect."""
        return self.identification if self.has_identification else self.validation
