"""Every kind of finding in words for the fitter who drove the campaign: what it means, and what to do about it."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from gateway.calibration.inspection.finding import Explained, Finding, Kind, Severity, Topic
from gateway.calibration.inspection.sensors_explained import SENSORS_EXPLAINED

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
            "two runs are the same piece of the same log, so one of them adds nothing or is wrong",
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
            "docs/reasons.md says what to do about each reason; drive this load again",
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
        Kind.SPEED_MISSING: Explained(
            Topic.SPEED,
            (Severity.FAULT, Severity.WARNING),
            "there is no valid speed for much of the drive",
            "check the antenna and valid_when in the signal map; map wheel_speed too",
        ),
        Kind.SPEED_FROZEN: Explained(
            Topic.SPEED,
            (Severity.FAULT, Severity.WARNING),
            "the speed is constant while the vehicle shakes as it does when driven",
            "restart the receiver; check its antenna and valid_when in the signal map",
        ),
        Kind.SPEED_OUTSIDE_GATE: Explained(
            Topic.SPEED,
            (Severity.FAULT,),
            "too much of the drive is slower or faster than batches allow",
            "drive on an open road; check the unit of speed in the signal map",
        ),
        Kind.SPEED_UNIT: Explained(
            Topic.SPEED,
            (Severity.FAULT,),
            "the rear axle follows the front one at another speed than that in the log",
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
            "a load lies far beyond payload_range_kg, which is the base of errors in percent and the limit of plans",
            "check payload_kg; if it is right, set payload_range_kg to what the vehicle may carry",
        ),
        Kind.ONE_LOAD_ONLY: Explained(
            Topic.LOADS,
            (Severity.WARNING,),
            "all runs carry the same load: a zero point for the physical model, no information for the ratio index",
            "drive at least one more known load, better three",
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
            "payload and front share are correlated, so the ratio index cannot separate them",
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
        **SENSORS_EXPLAINED,
    }
)


def finding_of(kind: Kind, severity: Severity, text: str) -> Finding:
    """A finding with the advice that belongs to its kind. Raises ValueError for a severity its kind does not have."""
    if severity not in EXPLAINED[kind].severities:
        raise ValueError(f"{kind} is never a {severity}: EXPLAINED says otherwise")
    return Finding(kind, severity, text, EXPLAINED[kind].advice)
