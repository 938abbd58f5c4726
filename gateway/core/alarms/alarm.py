"""One alarm: its cause, its steps, its acknowledgement, its JSON object, and its sentence for people."""

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, Final

from gateway.estimate import PLACES, Z95
from gateway.records import iso_utc, ns_of

ENTRY_KIND: Final = "alarm"
"""The kind of an alarm's row in the store and in the event stream."""


class AlarmKind(StrEnum):
    """What the alarm is about."""

    OVERLOAD = "overload"
    IMBALANCE = "imbalance"
    SENSOR_FAULT = "sensor_fault"
    DRIFT = "drift"
    NO_ESTIMATE = "no_estimate"


class AlarmState(StrEnum):
    """The state of an alarm. It only moves forward, and may skip ``EARLY``."""

    EARLY = "early"
    FINAL = "final"
    CLEARED = "cleared"


@dataclass(frozen=True, slots=True)
class AlarmCause:
    """What an alarm is about: its kind, and the place or the part concerned. At most one alarm of a cause is active."""

    kind: AlarmKind
    where: str | None = None

    @property
    def name(self) -> str:
        """The name in settings and topics: ``overload.gross``, ``no_estimate``."""
        return self.kind.value if self.where is None else f"{self.kind}.{self.where}"

    def is_named_in(self, names: tuple[str, ...]) -> bool:
        """Whether ``names`` has this cause's name, or the kind's name, which means all causes of the kind."""
        return self.name in names or self.kind.value in names


SIDES: Final = AlarmCause(AlarmKind.IMBALANCE, "left_right")
AXLES: Final = AlarmCause(AlarmKind.IMBALANCE, "front_rear")
SILENT: Final = AlarmCause(AlarmKind.SENSOR_FAULT, "silent")
REFUSED: Final = AlarmCause(AlarmKind.SENSOR_FAULT, "refused")
NO_ESTIMATE: Final = AlarmCause(AlarmKind.NO_ESTIMATE)
DRIFTING: Final = tuple(
    AlarmCause(AlarmKind.DRIFT, what) for what in ("damper_front", "damper_rear", "delay", "gyro_gain", "zero")
)
OVERLOADS: Final = tuple(AlarmCause(AlarmKind.OVERLOAD, place) for place in PLACES)
CAUSES: Final = (*OVERLOADS, SIDES, AXLES, SILENT, REFUSED, *DRIFTING, NO_ESTIMATE)
CAUSE_NAMES: Final = tuple(dict.fromkeys([*map(str, AlarmKind), *(cause.name for cause in CAUSES)]))
"""Every name that the setting ``off`` accepts."""


@dataclass(frozen=True, slots=True)
class AlarmFigure:
    """The number that was found, its limit, and the probability that it exceeds the limit; NaN where there is none."""

    found: float = math.nan
    std: float = math.nan
    limit: float = math.nan
    unit: str = ""
    probability: float = math.nan
    detail: str | None = None


NOTHING_FOUND: Final = AlarmFigure()


@dataclass(frozen=True, slots=True)
class AlarmStep:
    """The time at which an alarm entered a state, and the number that caused it."""

    state: AlarmState
    t_ns: int
    figure: AlarmFigure


@dataclass(frozen=True, slots=True)
class Acknowledged:
    """Who acknowledged the alarm, when, and with which note."""

    by: str
    t_ns: int
    note: str | None = None


@dataclass(frozen=True, slots=True)
class Alarm:
    """An alarm in one revision; each step and the acknowledgement make a new revision."""

    cause: AlarmCause
    vehicle_id: str | None
    steps: tuple[AlarmStep, ...]
    acknowledged: Acknowledged | None = None
    revision: int = 1

    @classmethod
    def begun(cls, cause: AlarmCause, vehicle_id: str | None, step: AlarmStep) -> "Alarm":
        return cls(cause, vehicle_id, (step,))

    @property
    def id(self) -> str:
        """The id, the same in every revision."""
        t_ns = self.steps[0].t_ns // 1000 * 1000  # as its JSON has it
        digest = hashlib.sha256(f"alarm|{self.vehicle_id}|{self.cause.name}|{t_ns}".encode()).hexdigest()
        return f"alarm-{t_ns}-{digest[:12]}"

    @property
    def state(self) -> AlarmState:
        return self.steps[-1].state

    @property
    def is_active(self) -> bool:
        return self.state is not AlarmState.CLEARED

    @property
    def last_active_step(self) -> AlarmStep:
        """The last step in which the alarm was active; its figure is the one that the sentence states."""
        return [step for step in self.steps if step.state is not AlarmState.CLEARED][-1]

    @property
    def t_last_ns(self) -> int:
        """The time of the last change."""
        return max(self.steps[-1].t_ns, self.acknowledged.t_ns if self.acknowledged else self.steps[-1].t_ns)

    def stepped(self, step: AlarmStep) -> "Alarm":
        return replace(self, steps=(*self.steps, step), revision=self.revision + 1)

    def seen(self, acknowledged: Acknowledged) -> "Alarm":
        return replace(self, acknowledged=acknowledged, revision=self.revision + 1)


def alarm_to_json(alarm: Alarm, words: str) -> dict[str, Any]:
    """The JSON object; ``words`` is its sentence. Unknown is None."""
    shown = alarm.acknowledged
    return {
        "id": alarm.id,
        "revision": alarm.revision,
        "vehicle_id": alarm.vehicle_id,
        "kind": alarm.cause.kind.value,
        "where": alarm.cause.where,
        "state": alarm.state.value,
        "is_active": alarm.is_active,
        "t_start": iso_utc(alarm.steps[0].t_ns),
        "t_end": None if alarm.is_active else iso_utc(alarm.steps[-1].t_ns),
        "sentence": words,
        "steps": [
            {"state": step.state.value, "t": iso_utc(step.t_ns), **_figure_to_json(step.figure)} for step in alarm.steps
        ],
        "acknowledged": shown and {"by": shown.by, "at": iso_utc(shown.t_ns), "note": shown.note},
    }


def alarm_from_json(told: Mapping[str, Any]) -> Alarm:
    """The inverse of alarm_to_json. Raises ValueError, KeyError or TypeError for an object that is not an alarm."""
    shown = told["acknowledged"]
    if not any(step["state"] != AlarmState.CLEARED for step in told["steps"]):
        raise ValueError("an alarm without an early or final step")
    return Alarm(
        AlarmCause(AlarmKind(told["kind"]), told["where"]),
        told["vehicle_id"],
        tuple(
            AlarmStep(AlarmState(step["state"]), ns_of(step["t"]), _figure_from_json(step)) for step in told["steps"]
        ),
        shown and Acknowledged(shown["by"], ns_of(shown["at"]), shown["note"]),
        int(told["revision"]),
    )


def _figure_to_json(figure: AlarmFigure) -> dict[str, Any]:
    return {
        "probability": _known(figure.probability, 4),
        "found": _known(figure.found, 1),
        "std": _known(figure.std, 1),
        "limit": _known(figure.limit, 1),
        "unit": figure.unit or None,
        "detail": figure.detail,
    }


def _figure_from_json(told: Mapping[str, Any]) -> AlarmFigure:
    names = ("found", "std", "limit", "probability")
    numbers = {name: math.nan if told[name] is None else float(told[name]) for name in names}
    return AlarmFigure(**numbers, unit=told["unit"] or "", detail=told["detail"])


def _known(x: float, digits: int) -> float | None:
    return round(x, digits) + 0.0 if math.isfinite(x) else None


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
