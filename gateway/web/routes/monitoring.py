"""For monitoring: health, and the status as Prometheus metrics.

Metrics are one table. Base units, counters end in _total, unknown is absent.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from fastapi import APIRouter, Request
from prometheus_client import CONTENT_TYPE_LATEST, CollectorRegistry, ProcessCollector, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from starlette.responses import JSONResponse, Response

from gateway.estimates.batch_estimate import Weights
from gateway.estimates.quantities import FOUND, Outward
from gateway.records import Why, rounded
from gateway.status import State, Status
from gateway.web.access.problems import problem_response
from gateway.web.live.board import Board, Shown
from gateway.web.routes.present_load import Scales
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
    weights: Weights
    board: Board
    responses: Mapping[int, int]


Labels = str | tuple[str, ...]
Read = str | Mapping[str, str] | Callable[[Moment], Mapping[Labels, float | None]]


@dataclass(frozen=True, slots=True)
class MetricRow:
    """A metric: its name, its help, where its samples are read, and the names of its labels.

    Without labels it is read at a path of the moment, as "now.uptime_s"; with a label at a path for each value of the
    label; or by a function that gives the samples by the values of the labels. What is unknown is left out.
    """

    name: str
    text: str
    read: Read
    labels: tuple[str, ...] = ()
    of_unit: float = 1.0  # the number at the path is multiplied by it

    def samples(self, moment: Moment) -> dict[tuple[str, ...], float]:
        """The known samples by the values of their labels."""
        found: Mapping[Labels, float | None]
        if isinstance(self.read, str):
            found = {(): _at(moment, self.read)}
        elif isinstance(self.read, Mapping):
            found = {key: _at(moment, path) for key, path in self.read.items()}
        else:
            found = self.read(moment)
        by_labels = {(key,) if isinstance(key, str) else key: x for key, x in found.items()}
        return {key: self.of_unit * x for key, x in by_labels.items() if x is not None and not math.isnan(x)}


def _at(moment: Moment, path: str) -> Any:
    """The attribute at the path; None if a part of the service on the way is."""
    found: Any = moment
    for name in path.split("."):
        found = None if found is None else getattr(found, name)
    return found


def _each(part: str, **fields: str) -> Read:
    """Some numbers of one part of the status, by the values of a label."""
    return {value: f"{part}.{field}" for value, field in fields.items()}


def _by_signal(field: str) -> Read:
    return lambda m: {signal.signal: getattr(signal, field) for signal in m.now.signals}


def _by_place(field: str) -> Read:
    return lambda m: {where: _rounded(getattr(weight, field)) for where, weight in m.weights.items()}


def _rounded(kg: float | None) -> float | None:
    return None if kg is None else rounded(kg, 3)


def _info(moment: Moment) -> Mapping[Labels, float | None]:
    now = moment.now
    return {(now.version, now.vehicle_id or "", now.estimator or "", now.calibration_id or ""): 1.0}


def _store_degraded(moment: Moment) -> Mapping[Labels, float | None]:
    return {(): float(moment.now.store.state != "ok")}


def _record_refused(moment: Moment) -> Mapping[Labels, float | None]:
    record = moment.now.record
    return {} if record is None else {(): float(bool(record.last_fault))}


def _rejections(moment: Moment) -> Mapping[Labels, float | None]:
    """Every reason from the start on, so that a rate sees the first one too."""
    seen = moment.now.batches.rejected_by_reason
    return {str(why): seen.get(why, 0) for why in Why}


def _active(moment: Moment) -> Mapping[Labels, float | None]:
    alarms = moment.now.alarms
    return {name: float(name in alarms.active) for name in alarms.watched}


def _found(quantity: Outward) -> tuple[MetricRow, MetricRow]:
    """The latest estimate of a quantity, and its standard deviation."""
    name, std_name, factor = quantity.metric
    text = f"{quantity.words[0].upper()}{quantity.words[1:]}, by the latest estimate."
    return (
        MetricRow(name, text, f"shown.estimate.{quantity.name}.number", of_unit=factor),
        MetricRow(std_name, _STD, f"shown.estimate.{quantity.name}.std", of_unit=factor),
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
    MetricRow(
        "springscale_state",
        "1 for the present state of the service, 0 for the others.",
        lambda m: {str(state): float(state is m.now.state) for state in State},
        ("state",),
    ),
    MetricRow("springscale_ready", "1 while estimates are possible.", "now.is_ready"),
    MetricRow("springscale_uptime_seconds", "Since the start of the service.", "now.uptime_s"),
    MetricRow("springscale_bus_frames_total", "CAN data frames received.", "now.bus.n_frames"),
    MetricRow("springscale_bus_error_frames_total", "CAN error frames received.", "now.bus.n_error_frames"),
    MetricRow("springscale_bus_remote_frames_total", "CAN remote frames received.", "now.bus.n_remote_frames"),
    MetricRow("springscale_bus_reconnects_total", "Times the interface was opened again.", "now.bus.n_reconnects"),
    MetricRow(
        "springscale_bus_dropped_frames_total",
        "Frames lost before they were read.",
        _each("now.bus", inbox="n_inbox_dropped", kernel="n_kernel_dropped"),
        ("where",),
    ),
    MetricRow("springscale_bus_last_frame_age_seconds", "Since the last frame.", "now.bus.last_frame_age_s"),
    MetricRow(
        "springscale_decoded_frames_total",
        "Frames of mapped signals by outcome.",
        lambda m: {(count.signal, count.reason): count.n for count in m.now.decode},
        ("signal", "reason"),
    ),
    MetricRow("springscale_signal_rate_hertz", "Samples per second.", _by_signal("rate_hz"), ("signal",)),
    MetricRow("springscale_signal_last_age_seconds", "Since the last sample.", _by_signal("last_age_s"), ("signal",)),
    MetricRow(
        "springscale_signal_rejected_ratio", "Frames without a sample.", _by_signal("rejected_share"), ("signal",)
    ),
    MetricRow(
        "springscale_batches_total",
        "Batches by outcome.",
        _each(
            "now.batches",
            estimate="n_estimates",
            rejected="n_rejected",
            provisional="n_provisional",
            remainder="n_remainders",
        ),
        ("outcome",),
    ),
    MetricRow("springscale_rejections_total", "Batches by reason of rejection.", _rejections, ("reason",)),
    MetricRow(
        "springscale_store_degraded",
        "1 while estimates are kept in memory only.",
        _store_degraded,
    ),
    MetricRow("springscale_store_held_rows", "Rows that wait for the disk.", "now.store.n_held"),
    MetricRow("springscale_store_size_bytes", "Size of the database.", "now.store.size_bytes"),
    MetricRow("springscale_store_bad_records_total", "Records that failed their checksum.", "now.store.n_bad_records"),
    MetricRow(
        "springscale_store_rows_total",
        _ROWS,
        _each("now.store", written="n_written", dropped="n_dropped", duplicate="n_duplicates", pruned="n_pruned"),
        ("outcome",),
    ),
    MetricRow("springscale_alarm", "1 while the alarm is active, else 0.", _active, ("alarm",)),
    MetricRow("springscale_alarms_raised_total", "Alarms raised since the start.", "now.alarms.n_raised"),
    MetricRow(
        "springscale_record_refused",
        "1 while frames cannot be recorded.",
        _record_refused,
    ),
    MetricRow("springscale_record_size_bytes", "Size of the ring log.", "now.record.size_bytes"),
    MetricRow(
        "springscale_record_frames_total",
        "Frames by outcome.",
        _each("now.record", written="n_frames_written", dropped="n_frames_dropped"),
        ("outcome",),
    ),
    MetricRow("springscale_uplink_connected", "1 while connected to the broker.", "now.uplink.is_connected"),
    MetricRow("springscale_uplink_waiting_rows", "Rows still to be delivered.", "now.uplink.n_waiting"),
    MetricRow("springscale_uplink_oldest_waiting_age_seconds", "Of the oldest of these.", "now.uplink.waiting_age_s"),
    MetricRow("springscale_uplink_connections_total", "Times the broker was reached.", "now.uplink.n_connections"),
    MetricRow("springscale_uplink_cuts_total", "Times an established link broke.", "now.uplink.n_cuts"),
    MetricRow(
        "springscale_uplink_rows_total",
        _ROWS,
        _each("now.uplink", delivered="n_delivered", refused="n_refused", pruned="n_pruned"),
        ("outcome",),
    ),
    MetricRow(
        "springscale_uplink_statements_total",
        "Messages of statements by outcome.",
        _each("now.uplink.statements", taken="n_taken", refused="n_refused"),
        ("outcome",),
    ),
    MetricRow("springscale_webhook_waiting_rows", "Rows still to be delivered.", "now.webhook.n_waiting"),
    MetricRow("springscale_webhook_oldest_waiting_age_seconds", "Of the oldest of these.", "now.webhook.waiting_age_s"),
    MetricRow("springscale_webhook_failed_attempts_total", "Attempts not taken.", "now.webhook.n_failed"),
    MetricRow(
        "springscale_webhook_rows_total",
        _ROWS,
        _each("now.webhook", delivered="n_delivered", dead="n_dead", pruned="n_pruned"),
        ("outcome",),
    ),
    MetricRow(
        "springscale_http_responses_total",
        "HTTP answers by status.",
        lambda m: {str(code): n for code, n in m.responses.items()},
        ("code",),
    ),
    MetricRow("springscale_stream_clients", "Open streams.", "board.fanout.n_subscribers"),
    *(row for quantity in FOUND for row in _found(quantity)),
    MetricRow("springscale_estimate_age_seconds", "Since the latest estimate was received.", "shown.age_s"),
    MetricRow("springscale_estimate_stale", "1 while the latest estimate is old.", "shown.is_stale"),
    MetricRow("springscale_weight_kilograms", "Weight on the road.", _by_place("kg"), ("where",)),
    MetricRow("springscale_weight_std_kilograms", _STD, _by_place("std_kg"), ("where",)),
    MetricRow("springscale_weight_limit_kilograms", "What it may be.", _by_place("limit_kg"), ("where",)),
    MetricRow("springscale_overload", "1 while it is too much.", _by_place("is_over_limit"), ("where",)),
)


@dataclass(frozen=True, slots=True, eq=False)
class StatusCollector:
    """Turns the present status into metrics at each request. The registry tells collectors apart by identity."""

    board: Board
    scales: Scales
    status: Callable[[], Status]
    responses: Mapping[int, int]

    def collect(self) -> Iterator[Metric]:
        shown = self.board.shown()
        moment = Moment(self.status(), shown, self.scales.weigh(shown.estimate), self.board, self.responses)
        for row in TABLE:
            if samples := row.samples(moment):
                kind = CounterMetricFamily if row.name.endswith("_total") else GaugeMetricFamily
                family = kind(row.name, row.text, labels=row.labels)
                for labels, reading in samples.items():
                    family.add_metric(labels, reading)
                yield family


def metrics_registry(
    board: Board, scales: Scales, status: Callable[[], Status], responses: Counter[int]
) -> CollectorRegistry:
    """A registry of its own, so that two applications in one process do not interfere."""
    registry = CollectorRegistry(auto_describe=False)
    registry.register(StatusCollector(board, scales, status, responses))
    ProcessCollector(namespace="springscale", registry=registry)
    return registry
