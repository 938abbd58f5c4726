"""One alarm: its cause, its beginning and its end, its JSON object, and its sentence for people."""

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, Final

from gateway.estimates.batch_estimate import PLACES
from gateway.estimates.quantity import UNKNOWN_INTERVAL, half_width
from gateway.estimates.reasons import EXPLANATIONS
from gateway.records import iso_utc, ns_of, rounded

ENTRY_KIND: Final = "alarm"
"""The kind of an alarm's row in the store and in the event stream."""


class AlarmKind(StrEnum):
    """The subject of an alarm."""

    OVERLOAD = "overload"
    SENSOR_FAULT = "sensor_fault"


@dataclass(frozen=True, slots=True)
class AlarmCause:
    """The cause of an alarm: its kind, and the place or the part concerned. At most one alarm of a cause is active."""

    kind: AlarmKind
    where: str

    @property
    def name(self) -> str:
        """The name in settings and topics: ``overload.gross``, ``sensor_fault.silent``."""
        return f"{self.kind}.{self.where}"


SILENT: Final = AlarmCause(AlarmKind.SENSOR_FAULT, "silent")
REFUSED: Final = AlarmCause(AlarmKind.SENSOR_FAULT, "refused")
OVERLOADS: Final = tuple(AlarmCause(AlarmKind.OVERLOAD, place) for place in PLACES)
CAUSES: Final = (*OVERLOADS, SILENT, REFUSED)
CAUSE_NAMES: Final = (*map(str, AlarmKind), *(cause.name for cause in CAUSES))
"""Every name that the setting ``off`` accepts."""


@dataclass(frozen=True, slots=True)
class AlarmFigure:
    """The weight that was found, its limit, and the probability that it exceeds the limit; NaN where there is none."""

    found_kg: float = math.nan
    std_kg: float = math.nan
    limit_kg: float = math.nan
    probability: float = math.nan
    interval95_kg: tuple[float, float] = UNKNOWN_INTERVAL
    detail: str | None = None


@dataclass(frozen=True, slots=True)
class Alarm:
    """An alarm. Its first revision is that in which it is raised, its second that in which it ends.

    ``figure`` is what raised it.
    """

    cause: AlarmCause
    vehicle_id: str | None
    t_start_ns: int
    figure: AlarmFigure
    t_end_ns: int | None = None

    @property
    def id(self) -> str:
        """The id, the same in every revision."""
        t_ns = self.t_start_ns // 1000 * 1000  # as its JSON has it
        digest = hashlib.sha256(f"alarm|{self.vehicle_id}|{self.cause.name}|{t_ns}".encode()).hexdigest()
        return f"alarm-{t_ns}-{digest[:12]}"

    @property
    def is_active(self) -> bool:
        return self.t_end_ns is None

    @property
    def revision(self) -> int:
        return 1 if self.is_active else 2

    @property
    def t_last_ns(self) -> int:
        """The time of the last change."""
        return self.t_start_ns if self.t_end_ns is None else self.t_end_ns

    def ended(self, t_ns: int) -> "Alarm":
        """The alarm after its end; never earlier than its beginning: batches carry the time of the bus, other verdicts
        the computer's.
        """
        return replace(self, t_end_ns=max(t_ns, self.t_start_ns))


def alarm_to_json(alarm: Alarm) -> dict[str, Any]:
    """The JSON object. Unknown is None."""
    figure = alarm.figure
    return {
        "id": alarm.id,
        "revision": alarm.revision,
        "vehicle_id": alarm.vehicle_id,
        "kind": alarm.cause.kind.value,
        "where": alarm.cause.where,
        "is_active": alarm.is_active,
        "t_start": iso_utc(alarm.t_start_ns),
        "t_end": None if alarm.t_end_ns is None else iso_utc(alarm.t_end_ns),
        "sentence": sentence(alarm),
        "probability": rounded(figure.probability, 4),
        "found_kg": rounded(figure.found_kg, 1),
        "std_kg": rounded(figure.std_kg, 1),
        "interval95_kg": None if math.isnan(figure.interval95_kg[0]) else [round(x, 1) for x in figure.interval95_kg],
        "limit_kg": rounded(figure.limit_kg, 1),
        "detail": figure.detail,
    }


def alarm_from_json(told: Mapping[str, Any]) -> Alarm:
    """The inverse of alarm_to_json. Raises ValueError, KeyError or TypeError for an object that is not an alarm."""
    names = ("found_kg", "std_kg", "limit_kg", "probability")
    numbers = {name: math.nan if told[name] is None else float(told[name]) for name in names}
    low_kg, high_kg = told["interval95_kg"] or UNKNOWN_INTERVAL
    return Alarm(
        AlarmCause(AlarmKind(told["kind"]), told["where"]),
        told["vehicle_id"],
        ns_of(told["t_start"]),
        AlarmFigure(**numbers, interval95_kg=(float(low_kg), float(high_kg)), detail=told["detail"]),
        None if told["t_end"] is None else ns_of(told["t_end"]),
    )


_HAPPENED: Final[Mapping[str, str]] = {why: told.happened.replace("`", "") for why, told in EXPLANATIONS.items()}
_PLACES: Final = {"gross": "The vehicle", "front_axle": "The front axle", "rear_axle": "The rear axle"}


def sentence(alarm: Alarm) -> str:
    """The condition that raised the alarm, as a sentence."""
    figure, detail = alarm.figure, alarm.figure.detail
    if alarm.cause.kind is AlarmKind.OVERLOAD:
        where = alarm.cause.where
        subject = _PLACES.get(where, f"The wheel at the {where.replace('_', ' ')}")
        half_kg = half_width(figure.interval95_kg)
        take = "" if math.isnan(half_kg) else f" +- {half_kg:.0f}"
        said = f"{subject} weighs {figure.found_kg:.0f}{take} kg, limit {figure.limit_kg:.0f} kg"
    elif alarm.cause == SILENT:
        said = f"No signal: {detail}" if detail else "No signal"
    else:
        reasons = "; ".join(_HAPPENED.get(code, code) for code in (detail or "").split(", "))
        said = "Batches are refused because of a sensor" + (f": {reasons}" if detail else "")
    return said if alarm.is_active else f"{said} (ended)"
