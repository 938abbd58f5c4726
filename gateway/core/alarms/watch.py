"""All alarms of one vehicle: at most one of each cause is active, and each change is reported once."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from gateway.core.alarms.alarm import CAUSES, Acknowledged, Alarm, AlarmCause, AlarmFigure, AlarmState, AlarmStep
from gateway.core.alarms.rules import NO_DRIVES, AlarmRules, Says, verdicts_of
from gateway.core.vehicle import Vehicle
from gateway.core.weights.on_the_road import NOT_CALIBRATED, Unsprung
from gateway.errors import RefusedError
from gateway.estimate import Estimate

SWITCHED_OFF = AlarmFigure(detail="switched off")


class AlarmWatch:
    """The last alarm of each cause, ended or not. Inputs must come in order of time."""

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
        self._last: dict[AlarmCause, Alarm] = {alarm.cause: alarm for alarm in known if alarm.cause in CAUSES}
        self._drives = NO_DRIVES
        for estimate in recent:
            self._drives = self._drives.after(estimate)

    def weigh(self, estimate: Estimate, vehicle: Vehicle | None, unsprung: Unsprung = NOT_CALIBRATED) -> list[Alarm]:
        """The alarms that one more batch changed, counted or refused. Provisional estimates change none."""
        if estimate.is_provisional:
            return []
        self._drives = self._drives.after(estimate)
        says = list(self._drives.verdicts(self._rules))
        if estimate.counted:
            says += verdicts_of(self._rules, estimate, vehicle, unsprung)
        return self.note(says, estimate.t_end_ns)

    def note(self, says: Sequence[Says], t_ns: int) -> list[Alarm]:
        """The alarms that these verdicts changed."""
        changed = (self._after(one, t_ns) for one in says)
        return [alarm for alarm in changed if alarm is not None]

    def end_switched_off(self, t_ns: int) -> list[Alarm]:
        """End the active alarms of causes that the settings now switch off."""
        off = [alarm.cause for alarm in self.active() if not self._rules.is_on(alarm.cause)]
        return [self._stepped(cause, AlarmStep(AlarmState.CLEARED, t_ns, SWITCHED_OFF)) for cause in off]

    def acknowledge(self, alarm_id: str, by: str, note: str | None, t_ns: int) -> Alarm:
        """Acknowledge an alarm. Raises RefusedError if it is not the last of its cause, or is already
        acknowledged.
        """
        alarm = next((one for one in self._last.values() if one.id == alarm_id), None)
        if alarm is None:
            raise RefusedError("no_such_alarm", f"{alarm_id} is none of the alarms that can be acknowledged")
        if alarm.acknowledged is not None:
            who = alarm.acknowledged.by
            raise RefusedError("acknowledged_already", f"{alarm_id} was acknowledged by {who}")
        seen = self._last[alarm.cause] = alarm.seen(Acknowledged(by, t_ns, note))
        return seen

    def active(self) -> list[Alarm]:
        """The active alarms: final before early, then the oldest first."""
        standing = [alarm for alarm in self._last.values() if alarm.is_active]
        return sorted(standing, key=lambda one: (one.state is AlarmState.EARLY, one.steps[0].t_ns))

    def unseen(self) -> list[Alarm]:
        """The last alarm of each cause, where it ended without an acknowledgement."""
        return [alarm for alarm in self._last.values() if not alarm.is_active and alarm.acknowledged is None]

    def _after(self, says: Says, t_ns: int) -> Alarm | None:
        """The alarm in its new revision; None if the verdict changes nothing."""
        if not self._rules.is_on(says.cause):
            return None
        last = self._last.get(says.cause)
        before = None if last is None else last.state
        after = says.verdict.state_after(before)
        if after is None or after is before:
            return None
        return self._stepped(says.cause, AlarmStep(after, t_ns, says.figure))

    def _stepped(self, cause: AlarmCause, step: AlarmStep) -> Alarm:
        """The alarm with one more step, never earlier than the step before: batches carry the time of the bus, other
        verdicts the computer's.
        """
        last = self._last.get(cause)
        if last is not None and last.is_active:
            alarm = last.stepped(replace(step, t_ns=max(step.t_ns, last.steps[-1].t_ns)))
        else:
            alarm = Alarm.begun(cause, self._vehicle_id, step)
        self._last[cause] = alarm
        return alarm
