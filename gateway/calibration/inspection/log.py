"""Findings about a drive's log before its rows are inspected: is it readable, and is it used for this drive only?"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations

from gateway.calibration.inspection.explained import finding_of
from gateway.calibration.inspection.finding import Finding, Kind, Severity
from gateway.calibration.inspection.rows import RowFacts
from gateway.calibration.known_run import KnownRun
from gateway.records import Batch, Signal


@dataclass(frozen=True, slots=True)
class LogFacts:
    """The result of reading a run's log.

    ``duration_s`` is of the whole log, ``span_ns`` the first and last stamp of the run's piece of it, None if that
    piece is empty. ``unreadable`` says why nothing could be read, ``damage`` what was lost of it, ``silent`` why a
    mapped signal has no valid sample.
    """

    sha256: str = ""
    duration_s: float = 0.0
    start_s: float = 0.0
    span_ns: tuple[int, int] | None = (0, 0)
    unreadable: str | None = None
    damage: str | None = None
    silent: Mapping[Signal, str] = field(default_factory=dict)


def log_findings(facts: LogFacts) -> Iterator[Finding]:
    """At most one fault: no log, or no piece of it; or a warning that some of it was lost."""
    if facts.unreadable is not None:
        yield finding_of(Kind.LOG_UNREADABLE, Severity.FAULT, facts.unreadable)
    elif facts.span_ns is None:
        text = f"the log lasts {facts.duration_s:.0f} s, the run begins at {facts.start_s:g} s"
        yield finding_of(Kind.CUT_AWAY, Severity.FAULT, text)
    elif facts.damage is not None:
        yield finding_of(Kind.LOG_DAMAGED, Severity.WARNING, facts.damage)


def same_drive_findings(
    logs: Mapping[int, LogFacts], loads: Mapping[int, tuple[float, float]]
) -> Iterator[tuple[int, Finding]]:
    """Runs, by number, that are the same piece of the same log: all but the first; all of them if loads differ."""
    for one, other in combinations(logs, 2):
        if _is_same_drive(logs[one], logs[other]):
            is_same_load = loads[one] == loads[other]
            text = f"runs {one} and {other} are the same drive" + ("" if is_same_load else " with two different loads")
            numbers: Sequence[int] = (other,) if is_same_load else (one, other)
            for number in numbers:
                yield number, finding_of(Kind.SAME_DRIVE, Severity.FAULT, text)


def _is_same_drive(one: LogFacts, other: LogFacts) -> bool:
    if not one.sha256 or one.sha256 != other.sha256 or one.span_ns is None or other.span_ns is None:
        return False
    return one.span_ns[0] < other.span_ns[1] and other.span_ns[0] < one.span_ns[1]


@dataclass(frozen=True, slots=True)
class SplitRun:
    """One drive's two parts, either of which may have no batch, with the facts of its rows and of its log.

    has_identification is False if the campaign keeps the whole drive for validation. Only the identification part can
    spoil a calibration, so facts, batches and run are of that part alone, and of validation only if there is no other:
    the data that judge a calibration must not change it.
    """

    identification: KnownRun
    validation: KnownRun
    facts: RowFacts = field(default_factory=RowFacts)
    has_identification: bool = True
    log: LogFacts = field(default_factory=LogFacts)

    @property
    def batches(self) -> tuple[Batch, ...]:
        """Those to inspect."""
        return (self.identification if self.has_identification else self.validation).batches

    @property
    def run(self) -> KnownRun:
        """The part to inspect."""
        return self.identification if self.has_identification else self.validation
