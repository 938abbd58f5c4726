"""Every kind of finding in words for the fitter who drove the campaign: what it means, and what to do about it."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType
from typing import Final

from gateway.calibration.inspection.finding import Finding, Severity
from gateway.calibration.inspection.kinds import Kind


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


EXPLAINED: Final[Mapping[Kind, Explained]] = MappingProxyType(
    {
        Kind.LOG_UNREADABLE: Explained(
            Topic.DRIVE,
            (Severity.FAULT,),
            "nothing in the log can be read, or nothing that the signal map names",
            "check that it is the log of this drive, recorded on this bus, and copied whole",
        ),
        Kind.LOG_DAMAGED: Explained(
            Topic.DRIVE,
            (Severity.WARNING,),
            "a part of the log cannot be read; the rest is used",
            "copy the log again from the recorder; let the recorder close its file before power goes",
        ),
        Kind.CUT_AWAY: Explained(
            Topic.DRIVE,
            (Severity.FAULT,),
            "start_s and end_s leave nothing of the log",
            "correct start_s and end_s: seconds from the first frame of the log",
        ),
        Kind.SAME_DRIVE: Explained(
            Topic.DRIVE,
            (Severity.FAULT,),
            "two runs are the same piece of the same log, so one of them tells nothing new or something wrong",
            "name the right log for each run, or pieces of it that do not overlap",
        ),
        Kind.TOO_SHORT: Explained(
            Topic.DRIVE,
            (Severity.FAULT,),
            "the part of the drive that identifies is shorter than one batch",
            "drive longer (15 minutes a load is good), raise identification_fraction, or shorten --window-s",
        ),
        Kind.NO_USABLE_BATCH: Explained(
            Topic.DRIVE,
            (Severity.FAULT,),
            "every batch of the identification part was rejected, for the reasons named",
            "docs/reasons.md tells what each reason asks for; drive this load again",
        ),
        Kind.BATCHES_LOST: Explained(
            Topic.DRIVE,
            (Severity.NOTE,),
            "some batches were rejected, for the reasons named; the others are used",
            "nothing, or drive this load again for a narrower result",
        ),
        Kind.UNSTEADY: Explained(
            Topic.DRIVE,
            (Severity.WARNING,),
            "the speed changes so much that hardly any even stretch is left for spectra, so axes cannot be checked",
            "drive at an even speed, without braking and pulling away",
        ),
        Kind.SMOOTH_ROAD: Explained(
            Topic.DRIVE,
            (Severity.WARNING,),
            "the vehicle hardly shakes, or far less than in the other runs",
            "drive on an ordinary road, the same for all loads",
        ),
        Kind.SIGNAL_UNMAPPED: Explained(
            Topic.SENSORS,
            (Severity.FAULT, Severity.WARNING),
            "the signal map does not name this signal",
            "add it to the signal map: every estimator wants the speed, cross_spectrum wants both sensors",
        ),
        Kind.SENSOR_SILENT: Explained(
            Topic.SENSORS,
            (Severity.FAULT,),
            "the signal map names this signal, and the log holds no valid sample of it",
            "check message, signal and valid_when in the signal map, and that the log is of this bus",
        ),
        Kind.RATE_LOW: Explained(
            Topic.SENSORS,
            (Severity.FAULT,),
            "a sensor sends too seldom",
            "raise its rate in the device: 100 Hz is good",
        ),
        Kind.JITTER: Explained(
            Topic.SENSORS,
            (Severity.WARNING,),
            "the stamps of a sensor's frames are uneven: they were buffered on their way",
            "let the interface stamp frames as they arrive, not the program that stores them",
        ),
        Kind.GAPS: Explained(
            Topic.SENSORS, (Severity.WARNING,), "frames are missing", "check wiring, bus load and what the logger drops"
        ),
        Kind.SENSOR_STUCK: Explained(
            Topic.SENSORS,
            (Severity.WARNING,),
            "a sensor repeated one number for seconds",
            "power-cycle or replace the device",
        ),
        Kind.SENSOR_SATURATED: Explained(
            Topic.SENSORS,
            (Severity.WARNING,),
            "a sensor sat at the end of its range",
            "choose a larger range in the device",
        ),
        Kind.CHANNELS_SWAPPED: Explained(
            Topic.SENSORS,
            (Severity.FAULT,),
            "what is mapped as pitch rate carries gravity, and what is mapped as acceleration does not",
            "exchange message and signal of vertical_acceleration and pitch_rate in the signal map",
        ),
        Kind.ACCELERATION_SIGN: Explained(
            Topic.SENSORS,
            (Severity.FAULT,),
            "vertical acceleration reads about -9.81 m/s2 in the mean: its axis points down",
            "turn sign of vertical_acceleration in the signal map (z up reads +9.81 at rest)",
        ),
        Kind.ACCELERATION_UNIT: Explained(
            Topic.SENSORS,
            (Severity.FAULT,),
            "gravity is there, in another unit than the signal map says",
            "set unit of vertical_acceleration in the signal map",
        ),
        Kind.ACCELERATION_AXIS: Explained(
            Topic.SENSORS,
            (Severity.FAULT,),
            "vertical acceleration does not carry gravity: the axis lies level, or the device has removed gravity",
            "map the axis that reads 9.81 m/s2 at rest, or let the device send gravity",
        ),
        Kind.PITCH_RATE_BIAS: Explained(
            Topic.SENSORS,
            (Severity.WARNING,),
            "the pitch rate has a large mean, which no vehicle has",
            "let the device calibrate its gyroscope at rest; check the offset in the DBC",
        ),
        Kind.PITCH_RATE_UNIT: Explained(
            Topic.SENSORS,
            (Severity.FAULT,),
            "the pitch rate is far too large or too small beside the vertical acceleration",
            "check the unit of pitch_rate in the signal map (deg/s or rad/s) and the scale in the DBC",
        ),
        Kind.PITCH_RATE_AXIS: Explained(
            Topic.SENSORS,
            (Severity.FAULT,),
            "pitch rate and vertical acceleration do not move together as one body does",
            "map the rate about the axis that points sideways (not roll or yaw); both sensors on the same rigid place",
        ),
        Kind.PITCH_RATE_SIGN: Explained(
            Topic.SENSORS,
            (Severity.FAULT,),
            "the pitch rate fits the vehicle only when turned over",
            "turn sign of pitch_rate in the signal map (positive nose down)",
        ),
        Kind.SENSOR_POSITION: Explained(
            Topic.SENSORS,
            (Severity.FAULT, Severity.WARNING),
            "the spectra put the sensor elsewhere than sensor_position_m says",
            "measure again from the front axle, check wheelbase_m and the speed's unit, or widen sensor_position_std_m",
        ),
        Kind.COARSE_RESOLUTION: Explained(
            Topic.SENSORS,
            (Severity.WARNING,),
            "a good part of the signal is the sensor's own steps",
            "choose a smaller range or more bits in the device",
        ),
        Kind.SPEED_MISSING: Explained(
            Topic.SPEED,
            (Severity.FAULT, Severity.WARNING),
            "there is no valid speed for much of the drive",
            "check the antenna and valid_when in the signal map; map wheel_speed too",
        ),
        Kind.SPEED_FROZEN: Explained(
            Topic.SPEED,
            (Severity.FAULT, Severity.WARNING),
            "the speed repeats one number while the vehicle shakes as it does when driven",
            "restart the receiver; check its antenna and valid_when in the signal map",
        ),
        Kind.SPEED_OUTSIDE_GATE: Explained(
            Topic.SPEED,
            (Severity.FAULT,),
            "too much of the drive is slower or faster than batches may be",
            "drive on an open road; check the unit of speed in the signal map",
        ),
        Kind.SPEED_UNIT: Explained(
            Topic.SPEED,
            (Severity.FAULT,),
            "the rear axle follows the front one at another speed than the log says",
            "check the unit of speed in the signal map, and wheelbase_m",
        ),
        Kind.SPEED_DIFFERS: Explained(
            Topic.SPEED,
            (Severity.NOTE,),
            "the speed is another than in most runs, which the ratio index takes for a load",
            "drive all loads at the same speed, or every load at every speed",
        ),
        Kind.LOAD_BEYOND_RANGE: Explained(
            Topic.LOADS,
            (Severity.WARNING,),
            "a load lies far beyond payload_range_kg, which errors are stated in percent of and plans keep within",
            "check payload_kg; if it is right, set payload_range_kg to what the vehicle may carry",
        ),
        Kind.ONE_LOAD_ONLY: Explained(
            Topic.LOADS,
            (Severity.WARNING,),
            "all runs carry the same load: a zero point for the physical model, nothing for the ratio index",
            "drive at least once more with a known load, better three times",
        ),
        Kind.LOADS_ALIKE: Explained(
            Topic.LOADS,
            (Severity.WARNING,),
            "the loads differ so little that their effect drowns in the scatter",
            "drive empty, and loaded near the permitted payload",
        ),
        Kind.SHARES_ALIKE: Explained(
            Topic.LOADS,
            (Severity.WARNING,),
            "the front share is nearly the same in all runs",
            "drive one load far forward and one far back",
        ),
        Kind.LOAD_AND_SHARE_TOGETHER: Explained(
            Topic.LOADS,
            (Severity.WARNING,),
            "payload and front share go up and down together, so the ratio index cannot tell one from the other",
            "drive the same load at another place",
        ),
        Kind.LOADS_SWAPPED: Explained(
            Topic.LOADS,
            (Severity.FAULT,),
            "these two runs explain each other's load far better than their own",
            "exchange their loads in the campaign file if your notes allow it, else drive both again",
        ),
        Kind.LOAD_DISAGREES: Explained(
            Topic.LOADS,
            (Severity.WARNING,),
            "the other runs weigh this one at another load than the file says",
            "check payload and position in the campaign file, and what else was on board",
        ),
    }
)


def finding_of(kind: Kind, severity: Severity, text: str) -> Finding:
    """A finding with the advice that belongs to its kind. Raises ValueError for a severity its kind does not have."""
    if severity not in EXPLAINED[kind].severities:
        raise ValueError(f"{kind} is never a {severity}: EXPLAINED says otherwise")
    return Finding(kind, severity, text, EXPLAINED[kind].advice)
