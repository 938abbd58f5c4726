"""Alarms that come from no batch: a silent sensor, a drifting vehicle."""

import time
from collections.abc import Callable, Iterator, Sequence
from typing import Final

from gateway.calibration.trend import Trend
from gateway.core.alarms import AlarmRules, Figure, Says, Verdict
from gateway.core.alarms.alarm import DRIFTING, SILENT
from gateway.service.status import NEEDED_SENSORS
from gateway.status import State, Status

_AT_FAULT: Final = frozenset({State.SENSOR_FAULT, State.READER_FAULT})
_HEARD: Final = frozenset({State.WAITING_FOR_SPEED, State.COLLECTING, State.ESTIMATING, State.STALE})


class Silence:
    """For how long a needed sensor has been silent on a live bus, or the bus unreadable.

    While the bus sleeps this is unknown: an alarm stays, and the time starts again.
    """

    def __init__(self, rules: AlarmRules, clock_s: Callable[[], float] = time.monotonic) -> None:
        self._rules = rules
        self._clock_s = clock_s
        self._since_s: float | None = None

    def says(self, status: Status) -> Says:
        """As the service is now."""
        if status.state not in _AT_FAULT:
            self._since_s = None
            return Says(SILENT, Verdict.CLEAR if status.state in _HEARD else Verdict.HOLD)
        if self._since_s is None:
            self._since_s = self._clock_s()
        silent_s = self._clock_s() - self._since_s
        if silent_s < self._rules.sensor_silent_s:
            return Says(SILENT, Verdict.HOLD)
        is_sure = silent_s >= self._rules.sensor_silent_final_s
        verdict = Verdict.FINAL if is_sure else Verdict.EARLY
        return Says(SILENT, verdict, Figure(detail=what_is_silent(status)))


def what_is_silent(status: Status) -> str:
    """Which needed sensors are not heard; of a bus that cannot be read, why."""
    if status.state is State.READER_FAULT:
        return status.bus.last_fault or "the bus cannot be read"
    silent = [signal.signal for signal in status.signals if signal.is_silent and signal.signal in NEEDED_SENSORS]
    return " and ".join(silent) or "nobody knows which"


def drift_says(trends: Sequence[Trend]) -> Iterator[Says]:
    """Trends are judged over weeks, with 99 % confidence: a drift is final at once."""
    by_name = {trend.name: trend for trend in trends}
    for cause in DRIFTING:
        trend = by_name.get(cause.where or "")
        told = None if trend is None else trend.sentence()
        number = None if trend is None else trend.level if trend.is_off else trend.change
        if trend is None or told is None or number is None:
            yield Says(cause, Verdict.CLEAR)
        else:
            yield Says(cause, Verdict.FINAL, Figure(number, unit=trend.unit, detail=told))
