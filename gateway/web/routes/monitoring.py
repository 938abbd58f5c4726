"""For monitoring: health, and the status as Prometheus metrics.

Metrics are one table. Base units, counters end in _total, unknown is absent.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from fastapi import APIRouter, Request
from prometheus_client import CONTENT_TYPE_LATEST, CollectorRegistry, ProcessCollector, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from starlette.responses import JSONResponse, Response

from gateway.estimates.batch_estimate import PLACES
from gateway.estimates.quantities import FOUND, Outward
from gateway.records import Why
from gateway.status import State, Status
from gateway.web.access.problems import problem_response
from gateway.web.live.board import Board, Shown
from gateway.web.routes.weights import LatestWeights, Scales, weigh_latest
from gateway.web.schemas import Alive, Ready, problem_responses


def alive_router() -> APIRouter:
    """/health/live, which tells nothing of the vehicle and needs no token."""
    router = APIRouter(tags=["health"])

    @router.get("/health/live", response_model=Alive)
    async def live() -> Response:
        """200 as long as the process answers."""
        return JSONResponse(Alive().model_dump())

    return router


def health_router(status: Callable[[], Status], registry: CollectorRegistry) -> APIRouter:
    """/health/ready, /metrics."""
    router = APIRouter(tags=["health"])

    @router.get("/health/ready", response_model=Ready, responses=problem_responses(503))
    async def ready(request: Request) -> Response:
        """200 while estimates are possible; else 503 with the reason."""
        now = status()
        if not now.is_ready:
            return problem_response(503, now.not_ready_reason or now.sentence(), request.url.path)
        return JSONResponse(Ready(state=now.state, warnings=list(now.warnings)).model_dump())

    @router.get(
        "/metrics",
        response_class=Response,
        responses={200: {"content": {"text/plain": {"schema": {"type": "string"}}}}},
    )
    async def metrics() -> Response:
        """Prometheus metrics, names springscale_*."""
        return Response(generate_latest(registry), media_type=CONTENT_TYPE_LATEST)

    return router


@dataclass(frozen=True, slots=True)
class Moment:
    """All that metrics are made of, at one moment."""

    now: Status
    shown: Shown
    weights: LatestWeights
    board: Board
    responses: Mapping[int, int]


Labelled = Iterable[tuple[Sequence[str], float | None]]


@dataclass(frozen=True, slots=True)
class MetricRow:
    """A metric: its name, its help, its present samples (None: there is no such part), the names of its labels."""

    name: str
    text: str
    samples: Callable[[Moment], Labelled | None]
    labels: tuple[str, ...] = ()


def one(name: str, text: str, path: str, of_unit: float = 1.0) -> MetricRow:
    """A metric without labels: the value at a path of the status, left out if unknown."""

    def samples(moment: Moment) -> Labelled | None:
        reading = _at(moment, path)
        return None if reading is None or math.isnan(reading) else [((), reading * of_unit)]

    return MetricRow(name, text, samples)


def by(name: str, text: str, label: str, read: Callable[[Moment], Mapping[str, float | None]]) -> MetricRow:
    """A metric with one label, a sample for each of its values."""
    return MetricRow(name, text, lambda moment: [((key,), reading) for key, reading in read(moment).items()], (label,))


def counts(name: str, text: str, label: str, path: str, **fields: str) -> MetricRow:
    """Some numbers of one part of the status, by the values of a label."""

    def samples(moment: Moment) -> Labelled | None:
        part = _at(moment, path)
        return None if part is None else [((key,), getattr(part, field)) for key, field in fields.items()]

    return MetricRow(name, text, samples, (label,))


def _at(moment: Moment, path: str) -> Any:
    found: Any = moment
    for name in path.split("."):
        found = None if found is None else getattr(found, name)
    return found


def _of_signals(field: str) -> Callable[[Moment], Mapping[str, float | None]]:
    return lambda m: {signal.signal: getattr(signal, field) for signal in m.now.signals}


def _of_places(field: str) -> Callable[[Moment], Mapping[str, float | None]]:
    return lambda m: {where: getattr(getattr(m.weights, where), field) for where in PLACES}


def _active(moment: Moment) -> dict[str, float | None]:
    alarms = moment.now.alarms
    return {name: float(name in alarms.active) for name in alarms.watched}


def _info(moment: Moment) -> Labelled:
    now = moment.now
    return [((now.version, now.vehicle_id or "", now.estimator or "", now.calibration_id or ""), 1.0)]


def _found(quantity: Outward) -> tuple[MetricRow, MetricRow]:
    """The latest estimate of a quantity, and its standard deviation."""
    name, std_name, factor = quantity.metric
    text = f"{quantity.words[0].upper()}{quantity.words[1:]}, by the latest estimate."
    return (
        one(name, text, f"shown.estimate.{quantity.name}.number", factor),
        one(std_name, _STD, f"shown.estimate.{quantity.name}.std", factor),
    )


_ROWS: Final = "Rows by outcome."
_STD: Final = "Its standard deviation."
TABLE: Final = (
    MetricRow(
        "springscale_info",
        "Always 1; the labels identify this service.",
        _info,
        ("version", "vehicle_id", "estimator", "calibration_id"),
    ),
    by(
        "springscale_state",
        "1 for the present state of the service, 0 for the others.",
        "state",
        lambda m: {state: float(state is m.now.state) for state in State},
    ),
    one("springscale_ready", "1 while estimates are possible.", "now.is_ready"),
    one("springscale_uptime_seconds", "Since the start of the service.", "now.uptime_s"),
    one("springscale_bus_frames_total", "CAN data frames received.", "now.bus.n_frames"),
    one("springscale_bus_error_frames_total", "CAN error frames received.", "now.bus.n_error_frames"),
    one("springscale_bus_remote_frames_total", "CAN remote frames received.", "now.bus.n_remote_frames"),
    one("springscale_bus_reconnects_total", "Times the interface was opened again.", "now.bus.n_reconnects"),
    counts(
        "springscale_bus_dropped_frames_total",
        "Frames lost before they were read.",
        "where",
        "now.bus",
        inbox="n_inbox_dropped",
        kernel="n_kernel_dropped",
    ),
    one("springscale_bus_last_frame_age_seconds", "Since the last frame.", "now.bus.last_frame_age_s"),
    MetricRow(
        "springscale_decoded_frames_total",
        "Frames of mapped signals by outcome.",
        lambda m: [((count.signal, count.reason), count.n) for count in m.now.decode],
        ("signal", "reason"),
    ),
    by("springscale_signal_rate_hertz", "Samples per second.", "signal", _of_signals("rate_hz")),
    by("springscale_signal_last_age_seconds", "Since the last sample.", "signal", _of_signals("last_age_s")),
    by(
        "springscale_signal_rejected_ratio",
        "Frames without a sample.",
        "signal",
        _of_signals("rejected_share"),
    ),
    counts(
        "springscale_batches_total",
        "Batches by outcome.",
        "outcome",
        "now.batches",
        estimate="n_estimates",
        rejected="n_rejected",
        provisional="n_provisional",
        remainder="n_remainders",
    ),
    by(
        "springscale_rejections_total",
        "Batches by reason of rejection.",
        "reason",
        lambda m: dict.fromkeys(map(str, Why), 0) | m.now.batches.rejected_by_reason,  # rates see the first one too
    ),
    MetricRow(
        "springscale_store_degraded",
        "1 while estimates are kept in memory only.",
        lambda m: [((), float(m.now.store.state != "ok"))],
    ),
    one("springscale_store_held_rows", "Rows that wait for the disk.", "now.store.n_held"),
    one("springscale_store_size_bytes", "Size of the database.", "now.store.size_bytes"),
    one("springscale_store_bad_records_total", "Records that failed their checksum.", "now.store.n_bad_records"),
    counts(
        "springscale_store_rows_total",
        _ROWS,
        "outcome",
        "now.store",
        written="n_written",
        dropped="n_dropped",
        duplicate="n_duplicates",
        pruned="n_pruned",
    ),
    by("springscale_alarm", "1 while the alarm is active, else 0.", "alarm", _active),
    one("springscale_alarms_raised_total", "Alarms raised since the start.", "now.alarms.n_raised"),
    MetricRow(
        "springscale_record_refused",
        "1 while frames cannot be recorded.",
        lambda m: None if m.now.record is None else [((), float(bool(m.now.record.last_fault)))],
    ),
    one("springscale_record_size_bytes", "Size of the ring log.", "now.record.size_bytes"),
    counts(
        "springscale_record_frames_total",
        "Frames by outcome.",
        "outcome",
        "now.record",
        written="n_frames_written",
        dropped="n_frames_dropped",
    ),
    one("springscale_uplink_connected", "1 while connected to the broker.", "now.uplink.is_connected"),
    one("springscale_uplink_waiting_rows", "Rows still to be delivered.", "now.uplink.n_waiting"),
    one("springscale_uplink_oldest_waiting_age_seconds", "Of the oldest of these.", "now.uplink.waiting_age_s"),
    one("springscale_uplink_connections_total", "Times the broker was reached.", "now.uplink.n_connections"),
    one("springscale_uplink_cuts_total", "Times an established link broke.", "now.uplink.n_cuts"),
    counts(
        "springscale_uplink_rows_total",
        _ROWS,
        "outcome",
        "now.uplink",
        delivered="n_delivered",
        refused="n_refused",
        pruned="n_pruned",
    ),
    counts(
        "springscale_uplink_statements_total",
        "Messages of statements by outcome.",
        "outcome",
        "now.uplink.statements",
        taken="n_taken",
        refused="n_refused",
    ),
    one("springscale_webhook_waiting_rows", "Rows still to be delivered.", "now.webhook.n_waiting"),
    one("springscale_webhook_oldest_waiting_age_seconds", "Of the oldest of these.", "now.webhook.waiting_age_s"),
    one("springscale_webhook_failed_attempts_total", "Attempts not taken.", "now.webhook.n_failed"),
    counts(
        "springscale_webhook_rows_total",
        _ROWS,
        "outcome",
        "now.webhook",
        delivered="n_delivered",
        dead="n_dead",
        pruned="n_pruned",
    ),
    by(
        "springscale_http_responses_total",
        "HTTP answers by status.",
        "code",
        lambda m: {str(code): n for code, n in m.responses.items()},
    ),
    one("springscale_stream_clients", "Open streams.", "board.fanout.n_subscribers"),
    *(row for quantity in FOUND for row in _found(quantity)),
    one("springscale_estimate_age_seconds", "Since the latest estimate was received.", "shown.age_s"),
    one("springscale_estimate_stale", "1 while the latest estimate is old.", "shown.is_stale"),
    by("springscale_weight_kilograms", "Weight on the road.", "where", _of_places("kg")),
    by("springscale_weight_std_kilograms", _STD, "where", _of_places("std_kg")),
    by("springscale_weight_limit_kilograms", "What it may be.", "where", _of_places("limit_kg")),
    by("springscale_overload", "1 while it is too much.", "where", _of_places("is_over_limit")),
)


@dataclass(frozen=True, slots=True, eq=False)
class StatusCollector:
    """Turns the present status into metrics at each request. The registry tells collectors apart by identity."""

    board: Board
    scales: Scales
    status: Callable[[], Status]
    responses: Mapping[int, int]

    def collect(self) -> Iterator[Metric]:
        weights = weigh_latest(self.board, self.scales)
        moment = Moment(self.status(), self.board.shown(), weights, self.board, self.responses)
        for row in TABLE:
            samples = row.samples(moment)
            if samples is None:
                continue
            kind = CounterMetricFamily if row.name.endswith("_total") else GaugeMetricFamily
            family = kind(row.name, row.text, labels=row.labels)
            for labels, reading in samples:
                if reading is not None:
                    family.add_metric(labels, float(reading))
            yield family


def metrics_registry(
    board: Board, scales: Scales, status: Callable[[], Status], responses: Counter[int]
) -> CollectorRegistry:
    """A registry of its own, so that two applications in one process do not interfere."""
    registry = CollectorRegistry(auto_describe=False)
    registry.register(StatusCollector(board, scales, status, responses))
    ProcessCollector(namespace="springscale", registry=registry)
    return registry
