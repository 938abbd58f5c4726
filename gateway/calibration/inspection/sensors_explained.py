"""The findings about sensors in words, a part of :mod:`gateway.calibration.inspection.explained`."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from gateway.calibration.inspection.finding import Explained, Kind, Severity, Topic

SENSORS_EXPLAINED: Final[Mapping[Kind, Explained]] = MappingProxyType(
    {
        Kind.SIGNAL_UNMAPPED: Explained(
            Topic.SENSORS,
            (Severity.FAULT, Severity.WARNING),
            "the signal map does not name this signal",
            "add it to the signal map: every estimator needs the speed, cross_spectrum needs both sensors",
        ),
        Kind.SENSOR_SILENT: Explained(
            Topic.SENSORS,
            (Severity.FAULT, Severity.WARNING),
            "the signal map names this signal, and the log has no valid sample of it",
            "check message, signal and valid_when in the signal map, and that the log is of this bus",
        ),
        Kind.RATE_LOW: Explained(
            Topic.SENSORS,
            (Severity.FAULT, Severity.WARNING),
            "a sensor sends too seldom",
            "raise its rate in the device: 100 Hz is good",
        ),
        Kind.RATE_DIFFERS: Explained(
            Topic.SENSORS,
            (Severity.FAULT,),
            "the sensors' sampling rate differs from that in most runs, so other vibration aliases into their signals",
            "drive all runs at one rate of the device, the one that it will weigh at",
        ),
        Kind.JITTER: Explained(
            Topic.SENSORS,
            (Severity.WARNING,),
            "the stamps of a sensor's frames are uneven: they were buffered on their way",
            "let the interface stamp frames as they arrive, not the program that stores them",
        ),
        Kind.GAPS: Explained(
            Topic.SENSORS,
            (Severity.WARNING,),
            "frames are missing",
            "check wiring, bus load and frames dropped by the logger",
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
            "the signal mapped as pitch rate shows gravity, and the one mapped as acceleration does not",
            "exchange message and signal of vertical_acceleration and pitch_rate in the signal map",
        ),
        Kind.ACCELERATION_SIGN: Explained(
            Topic.SENSORS,
            (Severity.FAULT,),
            "the mean of the vertical acceleration is about -9.81 m/s2: its axis points down",
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
            "vertical acceleration does not show gravity: the axis is level, or the device has removed gravity",
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
            "the pitch rate is far too large or too small for the vertical acceleration",
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
        Kind.RATES_SWAPPED: Explained(
            Topic.SENSORS,
            (Severity.FAULT,),
            "roll and pitch rate explain the vehicle only when exchanged",
            "exchange message, signal and sign of pitch_rate and roll_rate in the signal map",
        ),
        Kind.ROLL_RATE_UNMAPPED: Explained(
            Topic.SENSORS,
            (Severity.NOTE,),
            "no roll rate is mapped: the lateral position of a load and the load of each wheel stay unknown, and with "
            "a sensor off the centre line a load to one side changes the estimated payload",
            "add roll_rate to the signal map, if the device sends it: it gives the lateral position of a load and the "
            "load of each wheel, and reduces their effect on the payload",
        ),
        Kind.ROLL_RATE_LOST: Explained(
            Topic.SENSORS,
            (Severity.WARNING,),
            "the roll rate is missing, stuck or at the end of its range for a good part of the drive; the rest is used",
            "check message, signal and valid_when of roll_rate in the signal map, wiring, and the range in the device",
        ),
        Kind.ROLL_RATE_AXIS: Explained(
            Topic.SENSORS,
            (Severity.FAULT,),
            "the signal mapped as roll rate is not one: it repeats the pitch rate, or hardly moves",
            "map the rate about the axis that points forward",
        ),
        Kind.ROLL_RATE_UNIT: Explained(
            Topic.SENSORS,
            (Severity.FAULT,),
            "the roll rate is far too large or too small for the pitch rate",
            "check the unit of roll_rate in the signal map (deg/s or rad/s), the scale in the DBC, and that its axis "
            "points forward",
        ),
        Kind.ROLL_RATE_SIGN: Explained(
            Topic.SENSORS,
            (Severity.FAULT,),
            "the roll rate fits the vehicle only when turned over",
            "turn sign of roll_rate in the signal map (positive left side up), or of the place it was judged by",
        ),
        Kind.ROLL_RATE_SIGN_UNTOLD: Explained(
            Topic.SENSORS,
            (Severity.NOTE,),
            "these drives do not show whether the roll rate's sign is right",
            "watch it as a bend to the left begins: it goes up; or drive a load well to one side, with its "
            "payload_left_m",
        ),
        Kind.SENSOR_POSITION: Explained(
            Topic.SENSORS,
            (Severity.FAULT, Severity.WARNING),
            "the spectra place the sensor elsewhere than sensor_position_m says",
            "measure again from the front axle, check wheelbase_m and the speed's unit, or widen sensor_position_std_m",
        ),
        Kind.SENSOR_OFFSET_UNKNOWN: Explained(
            Topic.SENSORS,
            (Severity.NOTE,),
            "the sensor's distance from the centre line is hardly known; off it, roll looks like heave as soon as a "
            "load lies to one side too",
            "measure it with a tape: sensor_offset_left_m in the campaign file, and its standard deviation",
        ),
        Kind.COARSE_RESOLUTION: Explained(
            Topic.SENSORS,
            (Severity.WARNING,),
            "a good part of the signal is the sensor's own steps",
            "choose a smaller range or more bits in the device",
        ),
    }
)
