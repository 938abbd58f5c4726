"""Alarms: each from its first sign to its end, with its acknowledgement.

    watch = AlarmWatch(rules, vehicle_id, known, recent)      # the state when the service stopped
    for alarm in watch.weigh(estimate, vehicle, unsprung): ...      # alarms that one more batch changed
    for alarm in watch.note(says, t_ns): ...                        # alarms that the service itself changed

Alarms follow from estimates and from what the service reports about itself. docs/alarms.md lists the rules.
"""

from gateway.core.alarms.alarm import (
    CAUSE_NAMES,
    Acknowledged,
    Alarm,
    AlarmCause,
    AlarmFigure,
    AlarmKind,
    AlarmState,
    alarm_from_json,
    alarm_to_json,
    sentence,
)
from gateway.core.alarms.rules import NO_DRIVES, AlarmRules, AlarmVerdict, DriveTally, Says, verdicts_of
from gateway.core.alarms.watch import AlarmWatch

ENTRY_KIND = "alarm"
"""The kind of an alarm's row in the store and in the event stream."""

__all__ = [
    "CAUSE_NAMES",
    "ENTRY_KIND",
    "NO_DRIVES",
    "Acknowledged",
    "Alarm",
    "AlarmCause",
    "AlarmFigure",
    "AlarmKind",
    "AlarmRules",
    "AlarmState",
    "AlarmVerdict",
    "AlarmWatch",
    "DriveTally",
    "Says",
    "alarm_from_json",
    "alarm_to_json",
    "sentence",
    "verdicts_of",
]
