"""A drive as it is inspected, and findings about its log: is it readable, and is it used for this drive only?"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations

from gateway.calibration.inspection.finding import Finding, Kind
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
        yield Finding.of(Kind.LOG_UNREADABLE, facts.unreadable)
    elif facts.span_ns is None:
        text = f"the log lasts {facts.duration_s:.0f} s, and the run begins at {facts.start_s:g} s"
        yield Finding.of(Kind.CUT_AWAY, text)
    elif facts.damage is not None:
        yield Finding.of(Kind.LOG_DAMAGED, facts.damage)


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


def same_drive_findings(drives: Sequence[SplitRun]) -> Iterator[tuple[int, Finding]]:
    """Runs, by number, that are the same piece of the same log: all but the first; all of them if loads differ."""
    for one, other in combinations(drives, 2):
        if _is_same_drive(one.log, other.log):
            numbers = (one.identification.number, other.identification.number)
            is_same_load = one.run.load == other.run.load
            text = f"runs {numbers[0]} and {numbers[1]} are the same drive"
            for number in numbers[1:] if is_same_load else numbers:
                yield number, Finding.of(Kind.SAME_DRIVE, text if is_same_load else f"{text} with two different loads")


def _is_same_drive(one: LogFacts, other: LogFacts) -> bool:
    if not one.sha256 or one.sha256 != other.sha256 or one.span_ns is None or other.span_ns is None:
        return False
    return one.span_ns[0] < other.span_ns[1] and other.span_ns[0] < one.span_ns[1]
