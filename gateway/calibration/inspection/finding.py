"""Findings about known-load drives before any fit: the table of their kinds, and a verdict for each run."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Self


class Severity(StrEnum):
    """The severity of a finding: a fault makes its run unusable, a warning needs attention, a note is information."""

    FAULT = "fault"
    WARNING = "warning"
    NOTE = "note"


class Topic(StrEnum):
    """The subject that a finding belongs to."""

    DRIVE = "The drive"
    SENSORS = "The sensors"
    SPEED = "The speed"
    LOADS = "The loads"


_FAULT: Final = (Severity.FAULT,)
_WARNING: Final = (Severity.WARNING,)
_NOTE: Final = (Severity.NOTE,)
_FAULT_OR_WARNING: Final = (Severity.FAULT, Severity.WARNING)


class Kind(StrEnum):
    """Every kind of finding: its name, its topic, the severities it may have (the gravest first), what it means, and
    what a fitter should do. The two texts are parts of sentences; docs/findings.md is made from this table.
    """

    topic: Topic
    severities: tuple[Severity, ...]
    means: str
    advice: str

    def __new__(cls, name: str, topic: Topic, severities: tuple[Severity, ...], means: str, advice: str) -> Self:
        kind = str.__new__(cls, name)
        kind._value_ = name
        kind.topic, kind.severities, kind.means, kind.advice = topic, severities, means, advice
        return kind

    # fmt: off
    LOG_UNREADABLE = ("log_unreadable", Topic.DRIVE, _FAULT,
        "the log cannot be read, or contains none of the signals in the signal map",
        "check that it is the log of this drive, that it was recorded on this bus, and that the whole file was copied")
    LOG_DAMAGED = ("log_damaged", Topic.DRIVE, _WARNING,
        "part of the log cannot be read; the rest is used",
        "copy the log from the recorder again; the recorder must close its file before it loses power")
    CUT_AWAY = ("cut_away", Topic.DRIVE, _FAULT,
        "start_s and end_s select no part of the log",
        "correct start_s and end_s; both count in seconds from the first frame of the log")
    SAME_DRIVE = ("same_drive", Topic.DRIVE, _FAULT,
        "two runs use the same part of the same log: one of them adds nothing, or has the wrong log",
        "give each run its own log, or parts of a log that do not overlap")
    TOO_SHORT = ("too_short", Topic.DRIVE, _FAULT,
        "the identification part of the drive is shorter than one batch",
        "drive longer (15 minutes for each load is good), increase identification_fraction, or reduce --window-s")
    NO_USABLE_BATCH = ("no_usable_batch", Topic.DRIVE, _FAULT,
        "every batch of the identification part was rejected; the reasons are listed",
        "look up each reason in docs/reasons.md, then drive this load again")
    BATCHES_LOST = ("batches_lost", Topic.DRIVE, _NOTE,
        "some batches were rejected, for the reasons listed; the others are used",
        "nothing; another drive with this load would narrow the result")
    UNSTEADY = ("unsteady", Topic.DRIVE, _WARNING,
        "the speed changes so often that too few even stretches are left to check the sensors' axes",
        "drive at an even speed: avoid braking and accelerating")
    SMOOTH_ROAD = ("smooth_road", Topic.DRIVE, _WARNING,
        "the vehicle hardly shakes, or shakes far less than in the other runs",
        "drive on an ordinary road, the same for all loads")

    SIGNAL_UNMAPPED = ("signal_unmapped", Topic.SENSORS, _FAULT_OR_WARNING,
        "the signal map does not contain this signal",
        "add it to the signal map: every estimator needs the speed, and cross_spectrum needs both sensors")
    SENSOR_SILENT = ("sensor_silent", Topic.SENSORS, _FAULT_OR_WARNING,
        "the signal map contains this signal, but the log has no valid sample of it",
        "check message, signal and valid_when in the signal map, and that the log was recorded on this bus")
    RATE_LOW = ("rate_low", Topic.SENSORS, _FAULT_OR_WARNING,
        "a sensor sends too rarely",
        "increase its rate in the device; 100 Hz is good")
    RATE_DIFFERS = ("rate_differs", Topic.SENSORS, _FAULT,
        "the sensors' sampling rate differs from that of most runs, so other vibrations alias into their signals",
        "record all runs at one rate, the rate at which the device will weigh")
    JITTER = ("jitter", Topic.SENSORS, _WARNING,
        "the time stamps of a sensor's frames are uneven: the frames were buffered before they were stamped",
        "let the CAN interface stamp the frames, not the program that stores them")
    GAPS = ("gaps", Topic.SENSORS, _WARNING,
        "frames are missing",
        "check the wiring, the bus load, and whether the logger drops frames")
    SENSOR_STUCK = ("sensor_stuck", Topic.SENSORS, _WARNING,
        "a sensor repeated the same number for seconds",
        "power-cycle or replace the device")
    SENSOR_SATURATED = ("sensor_saturated", Topic.SENSORS, _WARNING,
        "a sensor reached the end of its range",
        "set a larger range in the device")
    CHANNELS_SWAPPED = ("channels_swapped", Topic.SENSORS, _FAULT,
        "the signal mapped as pitch rate shows gravity, and the signal mapped as vertical acceleration does not",
        "exchange message and signal of vertical_acceleration and pitch_rate in the signal map")
    ACCELERATION_SIGN = ("acceleration_sign", Topic.SENSORS, _FAULT,
        "the mean of the vertical acceleration is about -9.81 m/s2: its axis points down",
        "change sign of vertical_acceleration in the signal map (an axis that points up reads +9.81 m/s2 at rest)")
    ACCELERATION_UNIT = ("acceleration_unit", Topic.SENSORS, _FAULT,
        "the vertical acceleration shows gravity, but not in the unit that the signal map states",
        "correct unit of vertical_acceleration in the signal map")
    ACCELERATION_AXIS = ("acceleration_axis", Topic.SENSORS, _FAULT,
        "the vertical acceleration does not show gravity: its axis is horizontal, or the device removes gravity",
        "map the axis that reads 9.81 m/s2 at rest, or set the device to send gravity")
    PITCH_RATE_BIAS = ("pitch_rate_bias", Topic.SENSORS, _WARNING,
        "the mean of the pitch rate is larger than any vehicle's",
        "calibrate the device's gyroscope at rest; check the offset in the DBC")
    PITCH_RATE_UNIT = ("pitch_rate_unit", Topic.SENSORS, _FAULT,
        "the pitch rate is far too large or too small for the vertical acceleration",
        "check unit of pitch_rate in the signal map (deg/s or rad/s), and the scale in the DBC")
    PITCH_RATE_AXIS = ("pitch_rate_axis", Topic.SENSORS, _FAULT,
        "pitch rate and vertical acceleration do not move like those of one rigid body",
        "map the rate about the axis that points sideways (not roll or yaw); mount both sensors at one rigid place")
    PITCH_RATE_SIGN = ("pitch_rate_sign", Topic.SENSORS, _FAULT,
        "the pitch rate fits the vehicle only with the opposite sign",
        "change sign of pitch_rate in the signal map (positive: nose down)")
    RATES_SWAPPED = ("rates_swapped", Topic.SENSORS, _FAULT,
        "pitch rate and roll rate fit the vehicle only when they are exchanged",
        "exchange message, signal and sign of pitch_rate and roll_rate in the signal map")
    ROLL_RATE_UNMAPPED = ("roll_rate_unmapped", Topic.SENSORS, _NOTE,
        "no roll rate is mapped: the lateral position of a load and the loads of single wheels stay unknown, and if "
        "the sensor is off the centre line, a load to one side changes the estimated payload",
        "if the device sends a roll rate, add roll_rate to the signal map: it gives the lateral position of a load and "
        "the loads of single wheels, and reduces the effect of a load to one side on the payload")
    ROLL_RATE_LOST = ("roll_rate_lost", Topic.SENSORS, _WARNING,
        "the roll rate is missing, stuck or at the end of its range for part of the drive; the rest is used",
        "check message, signal and valid_when of roll_rate in the signal map, the wiring, and the device's range")
    ROLL_RATE_AXIS = ("roll_rate_axis", Topic.SENSORS, _FAULT,
        "the signal mapped as roll rate is no roll rate: it repeats the pitch rate, or hardly moves",
        "map the rate about the axis that points forward")
    ROLL_RATE_UNIT = ("roll_rate_unit", Topic.SENSORS, _FAULT,
        "the roll rate is far too large or too small for the pitch rate",
        "check unit of roll_rate in the signal map (deg/s or rad/s), the scale in the DBC, and that its axis points "
        "forward")
    ROLL_RATE_SIGN = ("roll_rate_sign", Topic.SENSORS, _FAULT,
        "the roll rate fits the vehicle only with the opposite sign",
        "change sign of roll_rate in the signal map (positive: left side up), or of the lateral position that the "
        "finding names")
    ROLL_RATE_SIGN_UNTOLD = ("roll_rate_sign_untold", Topic.SENSORS, _NOTE,
        "these drives do not show whether the sign of the roll rate is right",
        "look at the roll rate at the beginning of a bend to the left, where it must be positive; or drive a load well "
        "to one side, and state its payload_left_m")
    SENSOR_POSITION = ("sensor_position", Topic.SENSORS, _FAULT_OR_WARNING,
        "the spectra show the sensor at another place than sensor_position_m",
        "measure again from the front axle, check wheelbase_m and the unit of the speed, or increase "
        "sensor_position_std_m")
    SENSOR_OFFSET_UNKNOWN = ("sensor_offset_unknown", Topic.SENSORS, _NOTE,
        "the sensor's distance from the centre line is hardly known; at a sensor off that line, roll looks like heave "
        "when a load lies to one side",
        "measure it with a tape, and state sensor_offset_left_m with its standard deviation in the campaign file")
    COARSE_RESOLUTION = ("coarse_resolution", Topic.SENSORS, _WARNING,
        "a large part of the signal is the sensor's own resolution steps",
        "set a smaller range or more bits in the device")

    SPEED_MISSING = ("speed_missing", Topic.SPEED, _FAULT_OR_WARNING,
        "there is no valid speed for much of the drive",
        "check the antenna, and valid_when in the signal map; also map wheel_speed")
    SPEED_FROZEN = ("speed_frozen", Topic.SPEED, _FAULT_OR_WARNING,
        "the speed stays constant while the vehicle shakes as it does when driven",
        "restart the receiver; check its antenna, and valid_when in the signal map")
    SPEED_OUTSIDE_GATE = ("speed_outside_gate", Topic.SPEED, _FAULT,
        "too much of the drive is slower or faster than a batch may be",
        "drive on an open road; check the unit of speed in the signal map")
    SPEED_UNIT = ("speed_unit", Topic.SPEED, _FAULT,
        "the rear axle follows the front axle with a delay that does not fit the speed in the log",
        "check the unit of speed in the signal map, and wheelbase_m")
    SPEED_DIFFERS = ("speed_differs", Topic.SPEED, _NOTE,
        "the speed differs from that of most runs; the ratio index mistakes the difference for a load",
        "drive all loads at the same speed, or every load at every speed")

    LOAD_BEYOND_RANGE = ("load_beyond_range", Topic.LOADS, _WARNING,
        "a load is far above payload_range_kg, to which errors in percent refer and which limits the planned loads",
        "check payload_kg; if it is right, set payload_range_kg to what the vehicle may carry")
    ONE_LOAD_ONLY = ("one_load_only", Topic.LOADS, _WARNING,
        "all runs carry the same load: it sets the zero point of the half-car, and tells the ratio index nothing",
        "drive at least one more known load; three more are better")
    LOADS_ALIKE = ("loads_alike", Topic.LOADS, _WARNING,
        "the loads differ so little that the scatter hides their effect",
        "drive the vehicle empty, and with nearly its permitted payload")
    SHARES_ALIKE = ("shares_alike", Topic.LOADS, _WARNING,
        "the front share is nearly the same in all runs",
        "drive one load far forward and one far back")
    LOAD_AND_SHARE_TOGETHER = ("load_and_share_together", Topic.LOADS, _WARNING,
        "payload and front share change together, so the ratio index cannot separate them",
        "drive the same load at another place")
    LOADS_SWAPPED = ("loads_swapped", Topic.LOADS, _FAULT,
        "each of these two runs fits the other run's load far better than its own",
        "exchange their loads in the campaign file if your notes allow it; otherwise drive both again")
    LOAD_DISAGREES = ("load_disagrees", Topic.LOADS, _WARNING,
        "the other runs find another load for this run than the campaign file states",
        "check payload and position in the campaign file, and what else was on board")
    # fmt: on


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that the data show; ``text`` has its numbers."""

    kind: Kind
    severity: Severity
    text: str
    advice: str

    @classmethod
    def of(cls, kind: Kind, text: str, severity: Severity | None = None) -> Self:
        """A finding with the advice of its kind, and the kind's gravest severity unless another one is given. Raises
        ValueError for a severity that the kind cannot have.
        """
        severity = severity or kind.severities[0]
        if severity not in kind.severities:
            raise ValueError(f"{kind} is never a {severity}: the table of kinds says otherwise")
        return cls(kind, severity, text, kind.advice)

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
