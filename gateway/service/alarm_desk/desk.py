"""The alarms of a service: the pipeline reports every batch, a watcher the service's state; people query and
acknowledge them. It owns them all.
"""

import json
import logging
import threading
import time
from collections.abc import Callable, Iterable, Sequence
from typing import Final

from gateway.calibration.trend import Trend
from gateway.config.alarms import AlarmsSection
from gateway.core.alarms import (
    ENTRY_KIND,
    Alarm,
    AlarmRules,
    AlarmState,
    AlarmWatch,
    alarm_from_json,
    alarm_to_json,
    sentence,
)
from gateway.core.alarms.alarm import CAUSES
from gateway.errors import AlarmRefusedError, StoreError
from gateway.estimate import Estimate
from gateway.estimate_json import estimate_from_json
from gateway.log import Event, log_event
from gateway.records import json_line
from gateway.service.alarm_desk.conditions import Silence, drift_says
from gateway.service.subject import Subject
from gateway.status import AlarmsStatus, Status
from gateway.store import Store, StoreReader

REMEMBERED: Final = 1000  # alarms looked back over for those that stand
DRIVEN: Final = 300  # batches, a day of driving, looked back over for when one counted last
ON_DISK_WITHIN_S: Final = 2.0
_EVENTS: Final = {
    AlarmState.EARLY: (Event.ALARM_EARLY, logging.WARNING),
    AlarmState.FINAL: (Event.ALARM_FINAL, logging.WARNING),
    AlarmState.CLEARED: (Event.ALARM_CLEARED, logging.INFO),
}


def rules_of(section: AlarmsSection) -> AlarmRules:
    """The settings as the core has them."""
    chosen = section.model_dump(exclude={"no_estimate_min"})
    return AlarmRules(**chosen, no_estimate_s=60.0 * section.no_estimate_min)


class AlarmDesk:
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
        self._watch = self._restored()
        self._tell(self._watch.end_switched_off(clock_ns()))

    def __call__(self, found: Estimate) -> None:
        """One more batch, by the pipeline once it is stored."""
        if found.is_remainder:
            return
        calibrated = self._subject.calibrated
        with self._lock:
            if calibrated is None:
                self._tell(self._watch.weigh(found, None))
            else:
                self._tell(self._watch.weigh(found, calibrated.vehicle, calibrated.unsprung))

    def watch(self, status: Status, trends: Sequence[Trend]) -> None:
        """The present service, reported often; trends are given if they were judged again."""
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
        """Somebody has seen it -> the alarm as JSON, on disk. Raises AlarmRefusedError."""
        with self._lock:
            alarm = self._watch.acknowledge(alarm_id, by, note, self._clock_ns())
            log_event(Event.ALARM_ACKNOWLEDGED, id=alarm.id, alarm=alarm.cause.name, by=by)
            text = self._kept(alarm)
        if not self._store.flush(ON_DISK_WITHIN_S):
            raise AlarmRefusedError(
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

    def _restored(self) -> AlarmWatch:
        vehicle_id = self._subject.vehicle_id
        try:
            known, recent = remembered(self._store.reader())
        except (StoreError, TimeoutError, ValueError, KeyError) as fault:  # the last two: another version's batches
            log_event(Event.NOT_RESTORED, level=logging.WARNING, fault=str(fault))
            return AlarmWatch(self._rules, vehicle_id)
        return AlarmWatch(self._rules, vehicle_id, known, recent)

    def _tell(self, changed: Iterable[Alarm]) -> None:
        for alarm in changed:
            event, level = _EVENTS[alarm.state]
            log_event(event, level=level, id=alarm.id, alarm=alarm.cause.name, says=sentence(alarm))
            self._n_told += alarm.is_active
            self._kept(alarm)

    def _kept(self, alarm: Alarm) -> str:
        """Into the journal -> its JSON."""
        text = _text(alarm)
        self._store.write_entry(ENTRY_KIND, alarm.id, alarm.t_last_ns, text, alarm.revision)
        return text


def remembered(reader: StoreReader) -> tuple[list[Alarm], list[Estimate]]:
    """The last alarms and the last batches, oldest first. Raises what the store's reader raises.

    An unreadable alarm is skipped: a persisting fault raises it again.
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
