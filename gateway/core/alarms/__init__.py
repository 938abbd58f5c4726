"""Who must know now: alarms, each from the first sign to its end, and who has seen it.

    watch = AlarmWatch(rules, vehicle_id, known, recent)      # as they stood when the service stopped
    for alarm in watch.weigh(estimate, vehicle, unsprung): ...      # what one more batch changed
    for alarm in watch.note(says, t_ns): ...                        # likewise of what is no batch's to say

Purely from estimates and from what the service tells of itself. docs/alarms.md says when what is told.
"""

from gateway.core.alarms.alarm import (
    CAUSE_NAMES,
    Acknowledged,
    Alarm,
    AlarmKind,
    AlarmState,
    Cause,
    Figure,
    alarm_from_json,
    alarm_to_json,
)
from gateway.core.alarms.drives import NO_DRIVES, Drives
from gateway.core.alarms.rules import AlarmRules, Says, Verdict
from gateway.core.alarms.watch import AlarmWatch
from gateway.core.alarms.weighing import verdicts_of
from gateway.core.alarms.words import sentence

ENTRY_KIND = "alarm"
"""How the store and the stream name an alarm."""

__all__ = [
    "CAUSE_NAMES",
    "ENTRY_KIND",
    "NO_DRIVES",
    "Acknowledged",
    "Alarm",
    "AlarmKind",
    "AlarmRules",
    "AlarmState",
    "AlarmWatch",
    "Cause",
    "Drives",
    "Figure",
    "Says",
    "Verdict",
    "alarm_from_json",
    "alarm_to_json",
    "sentence",
    "verdicts_of",
]
