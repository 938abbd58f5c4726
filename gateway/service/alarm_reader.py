"""The alarms of the service: raised from batches and from the service's status, stored in the journal."""

import json
import logging
import threading
import time
from collections.abc import Callable, Iterable, Sequence
from typing import Final

from gateway.config.sections import AlarmsSection
from gateway.core.alarms.alarm import (
    CAUSES,
    ENTRY_KIND,
    SILENT,
    Alarm,
    AlarmFigure,
    alarm_from_json,
    alarm_to_json,
    sentence,
)
from gateway.core.alarms.rules import AlarmRules, Says
from gateway.core.alarms.watch import AlarmWatch
from gateway.estimates.as_json import read_estimate
from gateway.estimates.batch_estimate import Estimate
from gateway.log import Event, log_event
from gateway.records import json_line
from gateway.service.journal_reader import place_of
from gateway.service.status_of_parts import NEEDED_SENSORS
from gateway.setup import Subject
from gateway.status import AlarmsStatus, SignalHealth, State, Status
from gateway.store import Store, StoreReader, restored
from gateway.store.journal import up_to

_AT_FAULT: Final = frozenset({State.SENSOR_FAULT, State.READER_FAULT})
_HEARD: Final = frozenset({State.WAITING_FOR_SPEED, State.COLLECTING, State.ESTIMATING, State.NOT_WEIGHED, State.STALE})


class Silence:
    """Measures for how long a needed sensor has been silent on a live bus, or the bus unreadable.

    While the bus sleeps this is unknown: an alarm stays active, and the time starts again.
    """

    def __init__(self, rules: AlarmRules, clock_s: Callable[[], float] = time.monotonic) -> None:
        self._rules = rules
        self._clock_s = clock_s
        self._since_s: float | None = None

    def says(self, status: Status, causes: Sequence[str] = ()) -> Says:
        """The verdict for the present status; ``causes`` are what the decoder refuses so often that it explains it."""
        if status.state not in _AT_FAULT:
            self._since_s = None
            return Says(SILENT, False if status.state in _HEARD else None)
        if self._since_s is None:
            self._since_s = self._clock_s()
        silent_s = self._clock_s() - self._since_s
        if silent_s < self._rules.sensor_silent_s:
            return Says(SILENT, None)
        return Says(SILENT, True, AlarmFigure(detail=what_is_silent(status, causes)))


def what_is_silent(status: Status, causes: Sequence[str] = ()) -> str:
    """The needed sensors that are silent, each with what came of it, and the causes; or the fault of a bus that cannot
    be read.
    """
    if status.state is State.READER_FAULT:
        return status.bus.last_fault or "the bus cannot be read"
    silent = [one for one in status.signals if one.is_silent and one.signal in NEEDED_SENSORS]
    told = " and ".join(f"{one.signal.replace('_', ' ')}{status.why_silent(one) or _age(one)}" for one in silent)
    return "; ".join([told or "an unknown sensor", *causes])


def _age(silent: SignalHealth) -> str:
    return "" if silent.last_age_s is None else f" (last heard {silent.last_age_s:.0f} s ago)"


REMEMBERED: Final = 1000  # chosen: alarms read at the start to find the active ones
RECENT: Final = 20  # chosen: batches read at the start to find how many were refused in a row


def rules_of(section: AlarmsSection) -> AlarmRules:
    """The settings as the rules of the core."""
    return AlarmRules(**section.model_dump())


class AlarmService:
    """Every method may be called from any thread."""

    NAME: Final = "alarms"

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
        self._lock = threading.Lock()
        self._n_raised = 0
        nothing: tuple[list[Alarm], list[Estimate]] = ([], [])
        known, recent = restored(lambda: remembered(store.reader(), place_of(store, self.NAME)), nothing)
        self._watch = AlarmWatch(rules, subject.vehicle_id, known, recent)
        self._tell(self._watch.end_switched_off(clock_ns()))

    def __call__(self, found: Estimate) -> None:
        """Process a stored batch."""
        if found.is_remainder:
            return
        calibrated = self._subject.calibrated
        with self._lock:
            if calibrated is None:
                self._tell(self._watch.weigh(found, None))
            else:
                self._tell(self._watch.weigh(found, calibrated.vehicle, calibrated.unsprung))

    def watch(self, status: Status, causes: Sequence[str] = ()) -> None:
        """Process the present status, several times a minute."""
        with self._lock:
            self._tell(self._watch.note([self._silence.says(status, causes)], self._clock_ns()))

    def standing(self) -> str:
        """JSON: an array of the active alarms, the oldest first."""
        with self._lock:
            return f"[{','.join(map(_text, self._watch.active()))}]"

    def summary(self) -> AlarmsStatus:
        """The alarms in numbers, for status and metrics."""
        with self._lock:
            return AlarmsStatus(
                active=tuple(alarm.cause.name for alarm in self._watch.active()),
                n_raised=self._n_raised,
                watched=tuple(cause.name for cause in CAUSES if self._rules.is_on(cause)),
            )

    def _tell(self, changed: Iterable[Alarm]) -> None:
        for alarm in changed:
            event, level = (Event.ALARM, logging.WARNING) if alarm.is_active else (Event.ALARM_ENDED, logging.INFO)
            log_event(event, level=level, id=alarm.id, alarm=alarm.cause.name, says=sentence(alarm))
            self._n_raised += alarm.is_active
            self._store.write_entry(ENTRY_KIND, alarm.id, alarm.t_last_ns, _text(alarm))


def remembered(reader: StoreReader, place: str | None) -> tuple[list[Alarm], list[Estimate]]:
    """The last stored alarms, and the last batches up to a place in the journal, oldest first. Raises what the store's
    reader raises.

    An alarm that cannot be read is left out: if its cause persists, it is raised again.
    """
    told = reader.entries(kind=ENTRY_KIND, limit=REMEMBERED, newest_first=True)
    page = reader.estimates(limit=RECENT, newest_first=True, with_spectra=False, cursor=up_to(place))
    alarms = reader.understood(reversed(told.items), lambda text: alarm_from_json(json.loads(text)))
    return alarms, reader.understood(reversed(page.items), read_estimate)


def _text(alarm: Alarm) -> str:
    return json_line(alarm_to_json(alarm))
