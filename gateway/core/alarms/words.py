"""An alarm as a sentence for people."""

import math
from typing import Final

from gateway.core.alarms.alarm import Alarm, AlarmFigure, AlarmKind, AlarmState
from gateway.estimate import Z95

_PLACES: Final = {"gross": "The vehicle", "front_axle": "The front axle", "rear_axle": "The rear axle"}
_BALANCES: Final = {"left_right": "one side", "front_rear": "one axle"}
_ENDS: Final = {AlarmState.EARLY: "", AlarmState.FINAL: " (confirmed)", AlarmState.CLEARED: " (ended)"}


def sentence(alarm: Alarm) -> str:
    """The condition that caused the alarm, and its probability, as a sentence."""
    return f"{_said(alarm, alarm.last_active_step.figure)}{_ENDS[alarm.state]}"


def _said(alarm: Alarm, figure: AlarmFigure) -> str:
    cause, where = alarm.cause, alarm.cause.where or ""
    if cause.kind is AlarmKind.OVERLOAD:
        subject = _PLACES.get(where, f"The wheel at the {where.replace('_', ' ')}")
        return f"{subject} weighs {_give_or_take(figure, 'kg')}, limit {figure.limit:.0f} kg"
    if cause.kind is AlarmKind.IMBALANCE:
        return f"{_BALANCES[where].capitalize()} bears {_give_or_take(figure, '%')}, limit {figure.limit:.0f} %"
    if cause.kind is AlarmKind.NO_ESTIMATE:
        return f"{figure.found:.0f} minutes were driven without an estimate: {_detail(figure) or 'no reason is known'}"
    if cause.kind is AlarmKind.DRIFT:
        return f"{where.replace('_', ' ').capitalize()} drifts: {figure.detail}"
    said = "No signal" if where == "silent" else "Batches are refused because of a sensor"
    return f"{said}: {_detail(figure)}" if figure.detail else said


def _detail(figure: AlarmFigure) -> str:
    """Names of reasons in words."""
    return (figure.detail or "").replace("_", " ")


def _give_or_take(figure: AlarmFigure, unit: str) -> str:
    take = "" if math.isnan(figure.std) else f" +- {Z95 * figure.std:.0f}"
    return f"{figure.found:.0f}{take} {unit}"
