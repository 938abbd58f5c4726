"""Reasons in words for people: why a batch gave no estimate, or an uncertain one, and what to do about it.

docs/reasons.md and the dashboard show these texts. Names in backquotes are settings of ``[batch]`` unless the
text gives another place.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType
from typing import Any, Final

from gateway.estimates.budget import OWN, Remedy
from gateway.estimates.posterior import Source
from gateway.records import Why


class Cause(StrEnum):
    """The part of the program that gives a reason."""

    NOTHING_YET = "Nothing to say yet"
    DRIVE = "The drive"
    SENSORS = "The sensors"
    ANSWER = "The answer"


@dataclass(frozen=True, slots=True)
class Explanation:
    """One reason in words; ``happened`` and ``advice`` are parts of sentences, for use in a table."""

    cause: Cause
    happened: str
    advice: str


def _missing(sensor: str) -> Explanation:
    return Explanation(
        Cause.SENSORS,
        f"the {sensor} sensor was silent, marked its samples as not available, or its frames were refused for their "
        "length or range",
        "see what the log's remarks or the status say of refused frames; check the signal map and the device",
    )


def _stuck(sensor: str) -> Explanation:
    return Explanation(
        Cause.SENSORS, f"the {sensor} repeated the same number for `stuck_s`", "power-cycle or replace the device"
    )


def _saturated(sensor: str) -> Explanation:
    return Explanation(Cause.SENSORS, f"the {sensor} reached the end of its range", "set a larger range in the device")


EXPLANATIONS: Final[Mapping[Why, Explanation]] = MappingProxyType(
    {
        Why.NO_ESTIMATE_YET: Explanation(
            Cause.NOTHING_YET,
            "there has been no estimate since the store was created",
            "drive; the first batch ends after `window_s`",
        ),
        Why.NO_CALIBRATION: Explanation(
            Cause.NOTHING_YET,
            "no calibration file is given, or it does not contain the chosen estimator",
            "`springscale learn LOGS --vehicle van.toml --statements notes.csv --output vehicle.json` makes one of "
            "ordinary drives and notes of their loads, `springscale calibrate` one of drives with known loads; then "
            "name the file under `calibration`, or with `--calibration`",
        ),
        Why.TOO_SHORT: Explanation(
            Cause.DRIVE,
            "the drive ended before the window was full (`last_batch_share_min`), or left too little even driving",
            "drive on, or shorten `window_s`",
        ),
        Why.GAP: Explanation(
            Cause.DRIVE,
            "frames of both sensors are missing (`gap_s`, `gap_share_max`), or silence ended the drive (`silence_s`)",
            "look at dropped frames and the bus state in `/api/v1/status`; check the wiring and the gateway's load",
        ),
        Why.CLOCK_STEP: Explanation(
            Cause.DRIVE,
            "time stamps stepped back by more than `clock_step_s`",
            "set the computer's clock before the service starts",
        ),
        Why.TRAILER: Explanation(
            Cause.DRIVE,
            "the vehicle pulled a trailer for too much of the window (the signal `trailer`): it pushes and pulls at "
            "the vehicle, and the weight on its drawbar is no load in the vehicle",
            "nothing; the vehicle is weighed again without the trailer",
        ),
        Why.TOO_SLOW: Explanation(
            Cause.DRIVE,
            "the speed was below `speed_min_mps` for too much of the window: town traffic, a queue, a yard",
            "nothing; an open road is enough. If it was one, correct the speed's unit or factor in its database",
        ),
        Why.TOO_FAST: Explanation(
            Cause.DRIVE,
            "the speed was above `speed_max_mps` for too much of the window",
            "correct the speed's unit or factor in its database",
        ),
        Why.SPEED_SPREAD: Explanation(
            Cause.DRIVE,
            "the speed varied more than the ratio index tolerates, or no stretch was driven at an even speed",
            "drive more steadily; `cross_spectrum` tolerates more than `ratio_index`",
        ),
        Why.SPEED_UNCALIBRATED: Explanation(
            Cause.DRIVE,
            "the mean speed is outside the range of the calibration drives",
            "calibrate with drives at this speed too",
        ),
        Why.NOT_ENOUGH_EXCITATION: Explanation(
            Cause.DRIVE, "the road was too smooth to distinguish loads", "nothing; an ordinary road is enough"
        ),
        Why.SPEED_MISSING: Explanation(
            Cause.SENSORS,
            "there was no valid speed for too much of the window (`speed_hold_s`)",
            "see what the log's remarks or the status say of refused frames; check the antenna and `valid_when` in the "
            "signal map; map `wheel_speed` too",
        ),
        Why.SPEED_FROZEN: Explanation(
            Cause.SENSORS,
            "the speed repeated the same number for `speed_frozen_s` although frames arrived",
            "restart the receiver; check its antenna",
        ),
        Why.ACCELERATION_MISSING: _missing("acceleration"),
        Why.PITCH_RATE_MISSING: _missing("pitch rate"),
        Why.ACCELERATION_STUCK: _stuck("acceleration"),
        Why.PITCH_RATE_STUCK: _stuck("pitch rate"),
        Why.ACCELERATION_SATURATED: _saturated("acceleration"),
        Why.PITCH_RATE_SATURATED: _saturated("pitch rate"),
        Why.GRAVITY_MISSING: Explanation(
            Cause.SENSORS,
            "the mean vertical acceleration is far from 9.81 m/s2",
            "check axis, sign, unit and scaling in the signal map, and whether the device removes gravity",
        ),
        Why.TIME_STAMPS: Explanation(
            Cause.SENSORS,
            "time stamps are so uneven, or so many frames are lost, that the sampling times are unknown",
            "stamp frames in the kernel (socketcan), reduce the computer's load, or name the message `counter` in the "
            "signal map",
        ),
        Why.SENSOR_RATE_LOW: Explanation(
            Cause.SENSORS,
            "the sensor sends too rarely for `rate_hz`",
            "increase its rate; of a log, see whether its stamps are seconds",
        ),
        Why.SAMPLE_RATE: Explanation(
            Cause.SENSORS,
            "the sensors' sampling rate differs from that in calibration by more than a quarter, so other vibrations "
            "alias into their signals",
            "set the device to its rate in calibration, or calibrate again at this rate",
        ),
        Why.SENSOR_CHANGED: Explanation(
            Cause.SENSORS,
            "the sensor differs from calibration: it was moved, turned, replaced, or has another gain",
            "mount it as it was, or calibrate again",
        ),
        Why.SENSOR_NOISY: Explanation(
            Cause.SENSORS,
            "a sensor's noise is more than twice that in calibration, too much to weigh",
            "look for a loose mount, a bad power supply, or a changed filter or range in the device; or replace it",
        ),
        Why.LOAD_CHANGED: Explanation(
            Cause.DRIVE,
            "the load changed at a stop, and the drive with the load before it was too short to weigh (a minute)",
            "nothing; the load after the stop is weighed",
        ),
        Why.SENSOR_DISAGREEMENT: Explanation(
            Cause.SENSORS,
            "acceleration and pitch rate do not move like those of one rigid body",
            "check that both sensors are mounted at one rigid place and have consistent time stamps",
        ),
        Why.WRONG_SIGN: Explanation(
            Cause.SENSORS,
            "the pitch rate fits the vehicle only with the opposite sign",
            "change `sign` of `pitch_rate` in the signal map (positive: nose down)",
        ),
        Why.OUT_OF_RANGE: Explanation(
            Cause.ANSWER,
            "the 95 % interval lies entirely above half as much again as the vehicle may carry, below nothing, or at a "
            "share that no load between the axles gives; for the ratio index: outside the loads and shares of the "
            "calibration",
            "check the vehicle, its stated limits and the sensor; for the ratio index calibrate with such loads",
        ),
        Why.TOO_UNCERTAIN: Explanation(
            Cause.ANSWER,
            "the interval would be too wide to be of use (a standard deviation of more than 15 % of the empty sprung "
            "mass)",
            "calibrate with loads nearer to this one; drive on a rougher road or for longer",
        ),
        Why.AMBIGUOUS: Explanation(
            Cause.ANSWER,
            "two very different loads explain these spectra about equally well",
            "drive on, on another road or at another speed; calibrate with more loads",
        ),
        Why.MODEL_MISFIT: Explanation(
            Cause.ANSWER,
            "no payload and front share explain these spectra as well as in calibration",
            "make sure that the calibration is this vehicle's; look for a changed tyre, spring or sensor mount; "
            "calibrate again",
        ),
        Why.NO_SOLUTION: Explanation(
            Cause.ANSWER,
            "the search for the load did not settle, or its numbers broke down",
            "nothing, if it is rare; otherwise check the sensors' signals, and calibrate again",
        ),
    }
)


SOURCES: Final[Mapping[str, str]] = MappingProxyType(
    {
        OWN: "this drive's own length and road",
        Source.CALIBRATION: "parameters of the vehicle that the known loads did not determine",
        Source.GOODS: "the usual length and height of this vehicle's loads",
        Source.LOAD_LENGTH: "the length and height of this very load",
        Source.DAY: "temperature and wear of springs, tyres and dampers",
        Source.SENSOR: "the sensor's gain",
        Source.SIDEWAYS: "the lateral position of the load",
        Source.EMPTY_SHARE: "the empty vehicle's weight on its front axle",
        Source.MODEL: "effects that the model of the vehicle neglects",
    }
)
"""The sources of an estimate's error, as parts of sentences."""

REMEDIES: Final[Mapping[Remedy, str]] = MappingProxyType(
    {
        Remedy.DRIVE_ON: "drive another ten minutes with the same load",
        Remedy.WEIGH_ONCE: "weigh the vehicle once, loaded, and state what the scale shows",
        Remedy.SAY_WHAT_IS_CARRIED: "state in the vehicle's data what it carries, with its length and height",
        Remedy.WEIGH_EMPTY: "state that the vehicle is empty, when it is",
        Remedy.READ_ROLL_RATE: "map the roll rate, if the device sends it",
        Remedy.WEIGH_AXLES_EMPTY: "weigh both axles of the empty vehicle",
    }
)
"""Remedies that narrow an error, as parts of sentences."""


def unexplained(*tables: tuple[type[StrEnum], Mapping[Any, str | Explanation]]) -> list[str]:
    """The members that their table lacks."""
    return [f"{names.__name__}.{one.name}" for names, table in tables for one in names if one not in table]


if _lacking := unexplained((Why, EXPLANATIONS), (Source, SOURCES), (Remedy, REMEDIES)):
    raise AssertionError(
        f"gateway/estimates/reasons.py explains no {', '.join(_lacking)}: add a row"
    )  # before any page is asked
