"""Alarms in the running service, from batches and from the service's own state: stored, shown, logged, acknowledged."""

from gateway.service.alarm_desk.conditions import Silence, drift_says
from gateway.service.alarm_desk.desk import AlarmDesk, rules_of

__all__ = ["AlarmDesk", "Silence", "drift_says", "rules_of"]
