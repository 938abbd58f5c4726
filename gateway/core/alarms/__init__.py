"""Alarms: a weight over its limit, and a faulty sensor; each from its beginning to its end.

    watch = AlarmWatch(rules, vehicle_id, known, recent)      # the state when the service stopped
    for alarm in watch.weigh(estimate, vehicle, unsprung): ...      # alarms that one more batch changed
    for alarm in watch.note(says, t_ns): ...                        # alarms that the service itself changed

Alarms follow from estimates and from what the service reports about itself. docs/alarms.md lists the rules.
"""
