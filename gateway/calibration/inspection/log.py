"""A drive as it is inspected: its two parts, and what reading its log showed."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from gateway.calibration.inspection.rows import RowFacts
from gateway.calibration.known_run import KnownRun
from gateway.records import Batch, Signal


@dataclass(frozen=True, slots=True)
class LogFacts:
    """The result of reading a run's log.

    ``duration_s`` is of the whole log, ``span_ns`` the first and last stamp of the run's piece of it, None if that
    piece is empty. ``unreadable`` says why nothing could be read, ``damage`` what was lost of it, ``silent`` why a
    mapped signal has no valid sample. ``mismatches`` say which frames do not fit the signal map: a sentence, their
    share of the message, and the signals that suffer.
    """

    sha256: str = ""
    duration_s: float = 0.0
    start_s: float = 0.0
    span_ns: tuple[int, int] | None = (0, 0)
    unreadable: str | None = None
    damage: str | None = None
    silent: Mapping[Signal, str] = field(default_factory=dict)
    mismatches: tuple[tuple[str, float, frozenset[Signal]], ...] = ()

    def is_of_same_drive(self, other: "LogFacts") -> bool:
        """Whether both are of one log and their pieces of it overlap."""
        if not self.sha256 or self.sha256 != other.sha256 or self.span_ns is None or other.span_ns is None:
            return False
        return self.span_ns[0] < other.span_ns[1] and other.span_ns[0] < self.span_ns[1]


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
        return self.run.batches

    @property
    def run(self) -> KnownRun:
        """The part to inspect."""
        return self.identification if self.has_identification else self.validation
