"""One drive of a campaign, read and cut in two."""

from dataclasses import dataclass, field

from gateway.calibration.inspection.log import LogFacts
from gateway.calibration.inspection.rows import RowFacts
from gateway.calibration.known_run import KnownRun
from gateway.records import Batch


@dataclass(frozen=True, slots=True)
class SplitRun:
    """One drive's two parts, either of which may hold no batch, with the facts of its rows and of its log.

    has_identification is False where the campaign keeps the whole drive for validation. Only what identifies can spoil
    a calibration, so facts, batches and run are of that part alone, and of validation only where there is no other:
    judging a calibration shall not change it.
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
