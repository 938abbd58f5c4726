"""Alarms as Prometheus metrics."""

from collections.abc import Iterator
from typing import Final

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric

from gateway.status import AlarmsStatus

_LEVELS: Final = {"early": 1.0, "final": 2.0}


def alarm_metrics(alarms: AlarmsStatus) -> Iterator[Metric]:
    """One sample for each alarm that is not switched off."""
    levels = GaugeMetricFamily(
        "springscale_alarm", "0 while nothing is the matter, 1 told early, 2 confirmed.", labels=["alarm"]
    )
    for name in alarms.watched:
        levels.add_metric([name], _LEVELS.get(alarms.standing.get(name, ""), 0.0))
    yield levels
    yield GaugeMetricFamily(
        "springscale_alarms_unacknowledged", "Alarms that nobody has acknowledged.", value=alarms.n_unacknowledged
    )
    yield CounterMetricFamily("springscale_alarms_told", "Early and final words since the start.", value=alarms.n_told)
