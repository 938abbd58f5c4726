"""Alarms over HTTP: those that stand, what became of the others, and a word of somebody who has seen one."""

from gateway.web.routes.alarms.routes import AlarmDesk, NoAlarmDesk, alarms_router

__all__ = ["AlarmDesk", "NoAlarmDesk", "alarms_router"]
