"""One drive of a campaign, cut in two."""

from dataclasses import dataclass, field
from pathlib import Path

from gateway.calibration.inspection.log import LogFacts
from gateway.calibration.inspection.rows import RowFacts
from gateway.calibration.known_run import KnownRun


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
