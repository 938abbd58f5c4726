"""All alarms of one vehicle: at most one of each cause is active, and each change is reported once."""

from collections.abc import Iterable, Sequence

from gateway.core.alarms.alarm import CAUSES, REFUSED, Alarm, AlarmCause, AlarmFigure
from gateway.core.alarms.rules import REFUSED_BATCHES, SENSORS, AlarmRules, Says, overload_says
from gateway.core.vehicle import Vehicle
from gateway.core.weights.on_the_road import NOT_CALIBRATED, Unsprung
from gateway.estimates.batch_estimate import Estimate
from gateway.records import Why


class AlarmWatch:
    """The active alarms. Inputs must come in order of time."""

    def __init__(
        self,
        rules: AlarmRules,
        vehicle_id: str | None,
        known: Iterable[Alarm] = (),
        recent: Iterable[Estimate] = (),
    ) -> None:
        """Resume from stored alarms and from the last whole batches, both oldest first."""
        self._rules = rules
        self._vehicle_id = vehicle_id
        last = {alarm.cause: alarm for alarm in known if alarm.cause in CAUSES}
        self._active: dict[AlarmCause, Alarm] = {cause: alarm for cause, alarm in last.items() if alarm.is_active}
        self._n_refused: int | None = None  # in a row because of a sensor; None after a batch that counted
        self._reasons: tuple[Why, ...] = ()
        for estimate in recent:
            self._refusal_says(estimate)

    def weigh(self, estimate: Estimate, vehicle: Vehicle | None, unsprung: Unsprung = NOT_CALIBRATED) -> list[Alarm]:
        """The alarms that one more batch changed, counted or refused. Provisional estimates change none."""
        if estimate.is_provisional:
            return []
        says = [self._refusal_says(estimate)]
        if estimate.counted:
            says += overload_says(self._rules, estimate, vehicle, unsprung)
        return self.note(says, estimate.t_end_ns)

    def note(self, says: Sequence[Says], t_ns: int) -> list[Alarm]:
        """The alarms that these verdicts raised or ended."""
        changed = (self._after(one, t_ns) for one in says)
        return [alarm for alarm in changed if alarm is not None]

    def end_switched_off(self, t_ns: int) -> list[Alarm]:
        """End the active alarms of causes that the settings now switch off."""
        off = [alarm for alarm in self.active() if not self._rules.is_on(alarm.cause)]
        return [self._active.pop(alarm.cause).ended(t_ns) for alarm in off]

    def active(self) -> list[Alarm]:
        """The active alarms, the oldest first."""
        return sorted(self._active.values(), key=lambda one: one.t_start_ns)

    def _refusal_says(self, estimate: Estimate) -> Says:
        """The evidence on the sensors after one more whole batch.

        The first batch that counts ends the alarm, and a refusal for another reason leaves it. A batch without a
        calibration changes nothing, as it cannot count.
        """
        if estimate.counted:
            self._n_refused, self._reasons = None, ()
        elif Why.NO_CALIBRATION not in estimate.rejected:
            self._reasons = tuple(why for why in estimate.rejected if why in SENSORS)
            self._n_refused = (self._n_refused or 0) + 1 if self._reasons else 0
        if self._n_refused is None:
            return Says(REFUSED, False)
        is_raised = True if self._n_refused >= REFUSED_BATCHES else None
        return Says(REFUSED, is_raised, AlarmFigure(detail=", ".join(self._reasons) or None))

    def _after(self, says: Says, t_ns: int) -> Alarm | None:
        """The alarm in its new revision; None if the verdict changes nothing."""
        is_active = says.cause in self._active
        if says.is_raised and not is_active and self._rules.is_on(says.cause):
            raised = self._active[says.cause] = Alarm(says.cause, self._vehicle_id, t_ns, says.figure)
            return raised
        if says.is_raised is False and is_active:
            return self._active.pop(says.cause).ended(t_ns)
        return None
