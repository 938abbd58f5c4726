"""Alarms, and how they are pushed, as Prometheus metrics."""

from collections.abc import Iterator
from typing import Final

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric

from gateway.status import AlarmsStatus, WebhookStatus

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


def webhook_metrics(webhook: WebhookStatus) -> Iterator[Metric]:
    """As of the uplink's."""
    yield GaugeMetricFamily("springscale_webhook_waiting_rows", "Rows still to be delivered.", value=webhook.n_waiting)
    if webhook.waiting_age_s is not None:
        yield GaugeMetricFamily(
            "springscale_webhook_oldest_waiting_age_seconds",
            "Of the oldest of these rows.",
            value=webhook.waiting_age_s,
        )
    yield CounterMetricFamily("springscale_webhook_failed_attempts", "Attempts not taken.", value=webhook.n_failed)
    rows = CounterMetricFamily("springscale_webhook_rows", "Rows by what became of them.", labels=["outcome"])
    for outcome, n in (("delivered", webhook.n_delivered), ("dead", webhook.n_dead), ("pruned", webhook.n_pruned)):
        rows.add_metric([outcome], n)
    yield rows
