"""Findings about known-load drives before any fit, and the table of their kinds."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Self


class Severity(StrEnum):
    """The severity of a finding: a fault makes its run unusable, a warning needs attention, a note is information."""

    FAULT = "fault"
    WARNING = "warning"
    NOTE = "note"


_FAULT: Final = (Severity.FAULT,)
_WARNING: Final = (Severity.WARNING,)
_NOTE: Final = (Severity.NOTE,)
_FAULT_OR_WARNING: Final = (Severity.FAULT, Severity.WARNING)


class Kind(StrEnum):
    """Every kind of finding: its name, the severities it may have (the gravest first), and what a fitter should do, as
    part of a sentence. docs/reasons.md also says what each means.
    """

    severities: tuple[Severity, ...]
    advice: str

    def __new__(cls, name: str, severities: tuple[Severity, ...], advice: str) -> Self:
        kind = str.__new__(cls, name)
        kind._value_ = name
        kind.severities, kind.advice = severities, advice
        return kind

    # fmt: off
    # The drive
    LOG_UNREADABLE = ("log_unreadable", _FAULT,
        "check that it is the log of this drive, that it was recorded on this bus, and that the whole file was copied")
    LOG_DAMAGED = ("log_damaged", _WARNING,
        "copy the log from the recorder again; the recorder must close its file before it loses power")
    LOG_CLOCK = ("log_clock", _WARNING,
        "record each drive in a log of its own, sort lines by time, or let the recorder set its clock before it begins")
    CUT_AWAY = "cut_away", _FAULT, "correct start_s and end_s; both count in seconds from the first frame of the log"
    SAME_DRIVE = "same_drive", _FAULT, "give each run its own log, or parts of a log that do not overlap"
    TOO_SHORT = ("too_short", _FAULT,
        "drive longer (15 minutes for each load is good), increase identification_fraction, or reduce --window-s")
    NO_USABLE_BATCH = "no_usable_batch", _FAULT, "look up each reason in docs/reasons.md, then drive this load again"
    BATCHES_LOST = "batches_lost", _NOTE, "nothing; another drive with this load would narrow the result"
    UNSTEADY = "unsteady", _WARNING, "drive at an even speed: avoid braking and accelerating"
    SMOOTH_ROAD = "smooth_road", _WARNING, "drive on an ordinary road, the same for all loads"

    # The sensors
    SIGNAL_UNMAPPED = ("signal_unmapped", _FAULT_OR_WARNING,
        "add it to the signal map: every estimator needs the speed, and cross_spectrum needs both sensors")
    MAP_MISMATCH = ("map_mismatch", _FAULT_OR_WARNING,
        "correct length or range in the database, or set minimum, maximum or source_address in the signal map")
    SENSOR_SILENT = ("sensor_silent", _FAULT_OR_WARNING,
        "check message, signal and valid_when in the signal map, and that the log was recorded on this bus")
    RATE_LOW = "rate_low", _FAULT_OR_WARNING, "increase its rate in the device; 100 Hz is good"
    RATE_DIFFERS = "rate_differs", _FAULT, "record all runs at one rate, the rate at which the device will weigh"
    JITTER = "jitter", _WARNING, "let the CAN interface stamp the frames, not the program that stores them"
    GAPS = "gaps", _WARNING, "check the wiring, the bus load, and whether the logger drops frames"
    SENSOR_STUCK = "sensor_stuck", _WARNING, "power-cycle or replace the device"
    SENSOR_SATURATED = "sensor_saturated", _WARNING, "set a larger range in the device"
    CHANNELS_SWAPPED = ("channels_swapped", _FAULT,
        "exchange message and signal of vertical_acceleration and pitch_rate in the signal map")
    ACCELERATION_SIGN = ("acceleration_sign", _FAULT,
        "change sign of vertical_acceleration in the signal map (an axis that points up reads +9.81 m/s2 at rest)")
    ACCELERATION_UNIT = "acceleration_unit", _FAULT, "correct unit of vertical_acceleration in the signal map"
    ACCELERATION_AXIS = ("acceleration_axis", _FAULT,
        "map the axis that reads 9.81 m/s2 at rest, or set the device to send gravity")
    PITCH_RATE_BIAS = ("pitch_rate_bias", _WARNING,
        "calibrate the device's gyroscope at rest; check the offset in the DBC")
    PITCH_RATE_UNIT = ("pitch_rate_unit", _FAULT,
        "check unit of pitch_rate in the signal map (deg/s or rad/s), and the scale in the DBC")
    PITCH_RATE_AXIS = ("pitch_rate_axis", _FAULT,
        "map the rate about the axis that points sideways (not roll or yaw); mount both sensors at one rigid place")
    PITCH_RATE_SIGN = "pitch_rate_sign", _FAULT, "change sign of pitch_rate in the signal map (positive: nose down)"
    RATES_SWAPPED = ("rates_swapped", _FAULT,
        "exchange message, signal and sign of pitch_rate and roll_rate in the signal map")
    ROLL_RATE_UNMAPPED = ("roll_rate_unmapped", _NOTE,
        "if the device sends a roll rate, add roll_rate to the signal map: it gives the lateral position of a load "
        "and the loads of single wheels, and reduces the effect of a load to one side on the payload")
    ROLL_RATE_LOST = ("roll_rate_lost", _WARNING,
        "check message, signal and valid_when of roll_rate in the signal map, the wiring, and the device's range")
    ROLL_RATE_AXIS = "roll_rate_axis", _FAULT, "map the rate about the axis that points forward"
    ROLL_RATE_UNIT = ("roll_rate_unit", _FAULT,
        "check unit of roll_rate in the signal map (deg/s or rad/s), the scale in the DBC, and that its axis points "
        "forward")
    ROLL_RATE_SIGN = ("roll_rate_sign", _FAULT,
        "change sign of roll_rate in the signal map (positive: left side up), or of the lateral position that the "
        "finding names")
    ROLL_RATE_SIGN_UNTOLD = ("roll_rate_sign_untold", _NOTE,
        "look at the roll rate at the beginning of a bend to the left, where it must be positive; or drive a load "
        "well to one side, and state its payload_left_m")
    SENSOR_POSITION = ("sensor_position", _FAULT_OR_WARNING,
        "measure again from the front axle, check wheelbase_m and the unit of the speed, or increase "
        "sensor_position_std_m")
    SENSOR_OFFSET_UNKNOWN = ("sensor_offset_unknown", _NOTE,
        "measure it with a tape, and state sensor_offset_left_m with its standard deviation in the campaign file")
    COARSE_RESOLUTION = "coarse_resolution", _WARNING, "set a smaller range or more bits in the device"

    # The speed
    SPEED_MISSING = ("speed_missing", _FAULT_OR_WARNING,
        "check the antenna, and valid_when in the signal map; also map wheel_speed")
    SPEED_FROZEN = ("speed_frozen", _FAULT_OR_WARNING,
        "restart the receiver; check its antenna, and valid_when in the signal map")
    SPEED_OUTSIDE_GATE = ("speed_outside_gate", _FAULT,
        "drive on an open road; check the unit of speed in the signal map")
    SPEED_UNIT = ("speed_unit", _FAULT,
        "check the unit of speed in the signal map, wheelbase_m, and that the log is of this vehicle")
    SPEED_DIFFERS = "speed_differs", _NOTE, "drive all loads at the same speed, or every load at every speed"

    # The loads
    LOAD_BEYOND_RANGE = ("load_beyond_range", _WARNING,
        "check payload_kg; if it is right, set payload_range_kg to what the vehicle may carry")
    ONE_LOAD_ONLY = "one_load_only", _WARNING, "drive at least one more known load; three more are better"
    LOADS_ALIKE = "loads_alike", _WARNING, "drive the vehicle empty, and with nearly its permitted payload"
    SHARES_ALIKE = "shares_alike", _WARNING, "drive one load far forward and one far back"
    LOAD_AND_SHARE_TOGETHER = "load_and_share_together", _WARNING, "drive the same load at another place"
    LOADS_SWAPPED = ("loads_swapped", _WARNING,
        "exchange their loads in the campaign file if your notes allow it; otherwise drive both again")
    LOAD_DISAGREES = ("load_disagrees", _WARNING,
        "check payload and position in the campaign file, and what else was on board")
    # fmt: on


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that the data show; ``text`` has its numbers."""

    kind: Kind
    severity: Severity
    text: str

    @classmethod
    def of(cls, kind: Kind, text: str, severity: Severity | None = None) -> Self:
        """A finding of the kind's gravest severity unless another one is given. Raises ValueError for a severity that
        the kind cannot have.
        """
        severity = severity or kind.severities[0]
        if severity not in kind.severities:
            raise ValueError(f"{kind} is never a {severity}: the table of kinds says otherwise")
        return cls(kind, severity, text)

    @property
    def advice(self) -> str:
        """What a fitter should do."""
        return self.kind.advice

    def to_json(self) -> dict[str, str]:
        """As in ``calibrate --json`` and the report's numbers."""
        return {"kind": str(self.kind), "severity": str(self.severity), "text": self.text, "advice": self.advice}
