"""Findings about the known-load drives before any fit: a verdict a run."""

from dataclasses import dataclass
from enum import StrEnum


class Kind(StrEnum):
    """The subject of a finding. docs/calibration.md has the table."""

    LOG_UNREADABLE = "log_unreadable"
    LOG_DAMAGED = "log_damaged"
    CUT_AWAY = "cut_away"
    SAME_DRIVE = "same_drive"
    TOO_SHORT = "too_short"
    NO_USABLE_BATCH = "no_usable_batch"
    BATCHES_LOST = "batches_lost"
    UNSTEADY = "unsteady"
    SIGNAL_UNMAPPED = "signal_unmapped"
    SENSOR_SILENT = "sensor_silent"
    RATE_LOW = "rate_low"
    RATE_DIFFERS = "rate_differs"
    JITTER = "jitter"
    GAPS = "gaps"
    SENSOR_STUCK = "sensor_stuck"
    SENSOR_SATURATED = "sensor_saturated"
    CHANNELS_SWAPPED = "channels_swapped"
    ACCELERATION_SIGN = "acceleration_sign"
    ACCELERATION_UNIT = "acceleration_unit"
    ACCELERATION_AXIS = "acceleration_axis"
    PITCH_RATE_BIAS = "pitch_rate_bias"
    PITCH_RATE_UNIT = "pitch_rate_unit"
    PITCH_RATE_AXIS = "pitch_rate_axis"
    PITCH_RATE_SIGN = "pitch_rate_sign"
    RATES_SWAPPED = "rates_swapped"
    ROLL_RATE_UNMAPPED = "roll_rate_unmapped"
    ROLL_RATE_LOST = "roll_rate_lost"
    ROLL_RATE_AXIS = "roll_rate_axis"
    ROLL_RATE_UNIT = "roll_rate_unit"
    ROLL_RATE_SIGN = "roll_rate_sign"
    ROLL_RATE_SIGN_UNTOLD = "roll_rate_sign_untold"
    SENSOR_POSITION = "sensor_position"
    SENSOR_OFFSET_UNKNOWN = "sensor_offset_unknown"
    SPEED_MISSING = "speed_missing"
    SPEED_FROZEN = "speed_frozen"
    SPEED_OUTSIDE_GATE = "speed_outside_gate"
    SPEED_UNIT = "speed_unit"
    SPEED_DIFFERS = "speed_differs"
    SMOOTH_ROAD = "smooth_road"
    COARSE_RESOLUTION = "coarse_resolution"
    LOAD_BEYOND_RANGE = "load_beyond_range"
    ONE_LOAD_ONLY = "one_load_only"
    LOADS_ALIKE = "loads_alike"
    SHARES_ALIKE = "shares_alike"
    LOAD_AND_SHARE_TOGETHER = "load_and_share_together"
    LOADS_SWAPPED = "loads_swapped"
    LOAD_DISAGREES = "load_disagrees"


class Severity(StrEnum):
    """The severity of a finding: a fault makes its run unusable, a warning needs attention, a note is information."""

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
        """As in ``calibrate --json`` and the report's numbers."""
        return {"kind": str(self.kind), "severity": str(self.severity), "text": self.text, "advice": self.advice}


@dataclass(frozen=True, slots=True)
class RunVerdict:
    """All that was found of one run; ``number`` counts the campaign's runs from 1, ``name`` is its log."""

    number: int
    name: str
    findings: tuple[Finding, ...] = ()

    @property
    def is_usable(self) -> bool:
        """False if a fault excludes the run from the calibration."""
        return all(finding.severity is not Severity.FAULT for finding in self.findings)


class Topic(StrEnum):
    """Where a finding belongs."""

    DRIVE = "The drive"
    SENSORS = "The sensors"
    SPEED = "The speed"
    LOADS = "The loads"


@dataclass(frozen=True, slots=True)
class Explained:
    """A kind in words; ``means`` and ``advice`` are parts of sentences, for use in a table.

    severities are those it may have, the gravest first.
    """

    topic: Topic
    severities: tuple[Severity, ...]
    means: str
    advice: str
