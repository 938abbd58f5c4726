"""The alarms of the service: raised from batches and from the service's status, stored in the journal, queried and
acknowledged over HTTP.
"""

import json
import logging
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Final

from gateway.calibration.trend import Trend
from gateway.config.sections import AlarmsSection
from gateway.core.alarms.alarm import (
    CAUSES,
    DRIFTING,
    ENTRY_KIND,
    SILENT,
    Alarm,
    AlarmFigure,
    AlarmState,
    alarm_from_json,
    alarm_to_json,
    sentence,
)
from gateway.core.alarms.rules import AlarmRules, AlarmVerdict, Says
from gateway.core.alarms.watch import AlarmWatch
from gateway.errors import RefusedError
from gateway.estimate import Estimate
from gateway.estimate_json import estimate_from_json
from gateway.log import Event, log_event
from gateway.records import json_line
from gateway.service.status import NEEDED_SENSORS
from gateway.setup import Subject
from gateway.status import AlarmsStatus, State, Status
from gateway.store import Store, StoreReader, restored

_AT_FAULT: Final = frozenset({State.SENSOR_FAULT, State.READER_FAULT})
_HEARD: Final = frozenset({State.WAITING_FOR_SPEED, State.COLLECTING, State.ESTIMATING, State.STALE})


class Silence:
    """Measures for how long a needed sensor has been silent on a live bus, or the bus unreadable.

    While the bus sleeps this is unknown: an alarm stays active, and the time starts again.
    """

    def __init__(self, rules: AlarmRules, clock_s: Callable[[], float] = time.monotonic) -> None:
        self._rules = rules
        self._clock_s = clock_s
        self._since_s: float | None = None

    def says(self, status: Status) -> Says:
        """The verdict for the present status."""
        if status.state not in _AT_FAULT:
            self._since_s = None
            return Says(SILENT, AlarmVerdict.CLEAR if status.state in _HEARD else AlarmVerdict.HOLD)
        if self._since_s is None:
            self._since_s = self._clock_s()
        silent_s = self._clock_s() - self._since_s
        if silent_s < self._rules.sensor_silent_s:
            return Says(SILENT, AlarmVerdict.HOLD)
        is_sure = silent_s >= self._rules.sensor_silent_final_s
        verdict = AlarmVerdict.FINAL if is_sure else AlarmVerdict.EARLY
        return Says(SILENT, verdict, AlarmFigure(detail=what_is_silent(status)))


def what_is_silent(status: Status) -> str:
    """The needed sensors that are silent, or the fault of a bus that cannot be read."""
    if status.state is State.READER_FAULT:
        return status.bus.last_fault or "the bus cannot be read"
    silent = [signal.signal for signal in status.signals if signal.is_silent and signal.signal in NEEDED_SENSORS]
    return " and ".join(silent) or "an unknown sensor"


def drift_says(trends: Sequence[Trend]) -> Iterator[Says]:
    """Verdicts for drifts. Trends cover weeks and have 99 % confidence, so a drift is confirmed at once."""
    by_name = {trend.name: trend for trend in trends}
    for cause in DRIFTING:
        trend = by_name.get(cause.where or "")
        told = None if trend is None else trend.sentence()
        number = None if trend is None else trend.level if trend.is_off else trend.change
        if trend is None or told is None or number is None:
            yield Says(cause, AlarmVerdict.CLEAR)
        else:
            yield Says(cause, AlarmVerdict.FINAL, AlarmFigure(number, unit=trend.unit, detail=told))


REMEMBERED: Final = 1000  # chosen: alarms read at the start to find the active ones
DRIVEN: Final = 300  # chosen: batches (a day of driving) read at the start to find when one last counted
ON_DISK_WITHIN_S: Final = 2.0  # chosen: for an acknowledgement to reach the disk before it is answered
_EVENTS: Final = {
    AlarmState.EARLY: (Event.ALARM_EARLY, logging.WARNING),
    AlarmState.FINAL: (Event.ALARM_FINAL, logging.WARNING),
    AlarmState.CLEARED: (Event.ALARM_CLEARED, logging.INFO),
}


def rules_of(section: AlarmsSection) -> AlarmRules:
    """The settings as the rules of the core."""
    chosen = section.model_dump(exclude={"no_estimate_min"})
    return AlarmRules(**chosen, no_estimate_s=60.0 * section.no_estimate_min)


class AlarmService:
    """Every method may be called from any thread."""

    def __init__(
        self,
        rules: AlarmRules,
        subject: Subject,
        store: Store,
        clock_ns: Callable[[], int] = time.time_ns,
        clock_s: Callable[[], float] = time.monotonic,
    ) -> None:
        """Resumes from the stored alarms."""
        self._rules = rules
        self._subject = subject
        self._store = store
        self._clock_ns = clock_ns
        self._silence = Silence(rules, clock_s)
        self._trends: Sequence[Trend] | None = None
        self._lock = threading.Lock()
        self._n_told = 0
        nothing: tuple[list[Alarm], list[Estimate]] = ([], [])
        known, recent = restored(lambda: remembered(store.reader()), nothing)
        self._watch = AlarmWatch(rules, subject.vehicle_id, known, recent)
        self._tell(self._watch.end_switched_off(clock_ns()))

    def __call__(self, found: Estimate) -> None:
        """Process a batch; called by the pipeline after it is stored."""
        if found.is_remainder:
            return
        calibrated = self._subject.calibrated
        with self._lock:
            if calibrated is None:
                self._tell(self._watch.weigh(found, None))
            else:
                self._tell(self._watch.weigh(found, calibrated.vehicle, calibrated.unsprung))

    def watch(self, status: Status, trends: Sequence[Trend]) -> None:
        """Process the present status, several times a minute. ``trends`` is a new object after each new judgement."""
        with self._lock:
            says = [self._silence.says(status)]
            if trends is not self._trends:
                says += drift_says(trends)
                self._trends = trends
            self._tell(self._watch.note(says, self._clock_ns()))

    def standing(self) -> str:
        """JSON: an array of the active alarms, the worst first."""
        with self._lock:
            return f"[{','.join(map(_text, self._watch.active()))}]"

    def acknowledge(self, alarm_id: str, by: str, note: str | None) -> str:
        """Acknowledge an alarm -> its JSON, on disk. Raises RefusedError."""
        with self._lock:
            alarm = self._watch.acknowledge(alarm_id, by, note, self._clock_ns())
            log_event(Event.ALARM_ACKNOWLEDGED, id=alarm.id, alarm=alarm.cause.name, by=by)
            text = self._kept(alarm)
        if not self._store.flush(ON_DISK_WITHIN_S):
            raise RefusedError(
                "not_stored",
                f"it is noted and shown, but not on disk yet: {self._store.health().reason or 'the disk is slow'}",
            )
        return text

    def summary(self) -> AlarmsStatus:
        """For status and metrics."""
        with self._lock:
            standing = {alarm.cause.name: alarm.state.value for alarm in self._watch.active()}
            unseen = [alarm for alarm in self._watch.active() if alarm.acknowledged is None] + self._watch.unseen()
            return AlarmsStatus(
                standing=standing,
                n_unacknowledged=len(unseen),
                n_told=self._n_told,
                watched=tuple(cause.name for cause in CAUSES if self._rules.is_on(cause)),
            )

    def _tell(self, changed: Iterable[Alarm]) -> None:
        for alarm in changed:
            event, level = _EVENTS[alarm.state]
            log_event(event, level=level, id=alarm.id, alarm=alarm.cause.name, says=sentence(alarm))
            self._n_told += alarm.is_active
            self._kept(alarm)

    def _kept(self, alarm: Alarm) -> str:
        """Write the alarm to the journal -> its JSON."""
        text = _text(alarm)
        self._store.write_entry(ENTRY_KIND, alarm.id, alarm.t_last_ns, text, alarm.revision)
        return text


def remembered(reader: StoreReader) -> tuple[list[Alarm], list[Estimate]]:
    """The last stored alarms and batches, oldest first. Raises what the store's reader raises.

    An unreadable alarm is skipped: if its fault persists, it is raised again.
    """
    told = reader.entries(kind=ENTRY_KIND, limit=REMEMBERED, newest_first=True)
    page = reader.estimates(limit=DRIVEN, newest_first=True, with_spectra=False)
    alarms = []
    for text in reversed(told.items):
        try:
            alarms.append(alarm_from_json(json.loads(text)))
        except (ValueError, KeyError, TypeError) as fault:
            log_event(Event.NOT_RESTORED, level=logging.WARNING, fault=f"an alarm: {fault!r}")
    return alarms, [estimate_from_json(json.loads(text)) for text in reversed(page.items)]


def _text(alarm: Alarm) -> str:
    return json_line(alarm_to_json(alarm, sentence(alarm)))
