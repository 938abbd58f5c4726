"""One drive of a campaign, read and cut in two."""

from dataclasses import dataclass, field

from gateway.calibration.inspection.log import LogFacts
from gateway.calibration.inspection.rows import RowFacts
from gateway.calibration.known_run import KnownRun
from gateway.records import Batch


@dataclass(frozen=True, slots=True)
class SplitRun:
    """One drive's two parts, either of which may hold no batch, with the facts of its rows and of its log.

    has_identification is False where the campaign keeps the whole drive for validation.
    """

    identification: KnownRun
    validation: KnownRun
    facts: RowFacts = field(default_factory=RowFacts)
    has_identification: bool = True
    log: LogFacts = field(default_factory=LogFacts)

    @property
    def batches(self) -> tuple[Batch, ...]:
        """Of both parts."""
        return self.identification.batches + self.validation.batches

    @property
    def run(self) -> KnownRun:
        """The run with the batches of both parts."""
        one = self.identification
        return KnownRun(one.number, one.name, one.payload_kg, one.front_share_pct, self.batches)
