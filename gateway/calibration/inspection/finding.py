"""What the known-load drives say of themselves before anything is fitted to them: a verdict a run."""

from dataclasses import dataclass
from enum import StrEnum


class Severity(StrEnum):
    """How much a finding weighs: a fault makes its run unusable, a warning wants a look, a note is to know."""

    FAULT = "fault"
    WARNING = "warning"
    NOTE = "note"


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that the data show. ``kind`` is snake_case; docs/calibration.md lists every kind."""

    kind: StrEnum
    severity: Severity
    text: str
    advice: str

    def to_json(self) -> dict[str, str]:
        """As ``calibrate --json`` and the report's numbers hold it."""
        return {"kind": str(self.kind), "severity": str(self.severity), "text": self.text, "advice": self.advice}


@dataclass(frozen=True, slots=True)
class RunVerdict:
    """All that was found of one run; ``number`` counts the campaign's runs from 1, ``name`` is its log."""

    number: int
    name: str
    findings: tuple[Finding, ...] = ()

    @property
    def is_usable(self) -> bool:
        """False where a fault keeps the run out of the calibration."""
        return all(finding.severity is not Severity.FAULT for finding in self.findings)


class Topic(StrEnum):
    """Where a finding belongs."""

    DRIVE = "The drive"
    SENSORS = "The sensors"
    SPEED = "The speed"
    LOADS = "The loads"


@dataclass(frozen=True, slots=True)
class Explained:
    """A kind in words; ``means`` and ``advice`` are parts of sentences, as a table holds them.

    severities are those it may have, the gravest first.
    """

    topic: Topic
    severities: tuple[Severity, ...]
    means: str
    advice: str
