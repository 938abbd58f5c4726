"""The status as Prometheus metrics: base units, counters end in _total, unknown is absent."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Final

from prometheus_client import CollectorRegistry, ProcessCollector
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric

from gateway.estimate import PLACES
from gateway.status import RecordStatus, State, Status, UplinkStatus, VerificationStatus
from gateway.web.live.board import Board
from gateway.web.routes.alarms.figures import alarm_metrics, webhook_metrics
from gateway.web.routes.weights import LatestWeights, Scales, weigh_latest


class StatusCollector:
    """Turns the status of the moment into metrics whenever they are asked for."""

    def __init__(self, board: Board, scales: Scales, status: Callable[[], Status], responses: Counter[int]) -> None:
        self._board = board
        self._scales = scales
        self._status = status
        self._responses = responses

    def describe(self) -> Iterable[Metric]:
        """Nothing beforehand: the registry need not collect to register."""
        return ()

    def collect(self) -> Iterator[Metric]:
        now = self._status()
        yield from _service(now)
        yield from _bus(now)
        yield from _signals(now)
        yield from _batches(now)
        yield from _store(now)
        yield from _verification(now.verification)
        yield from alarm_metrics(now.alarms)
        if now.record is not None:
            yield from _record(now.record)
        if now.uplink is not None:
            yield from _uplink(now.uplink)
        if now.webhook is not None:
            yield from webhook_metrics(now.webhook)
        yield from _web(self._board, self._responses)
        yield from _estimate(self._board)
        yield from _weights(weigh_latest(self._board, self._scales))


def metrics_registry(
    board: Board, scales: Scales, status: Callable[[], Status], responses: Counter[int]
) -> CollectorRegistry:
    """A registry of our own: no process-wide state, two apps do not meet."""
    registry = CollectorRegistry(auto_describe=False)
    registry.register(StatusCollector(board, scales, status, responses))
    ProcessCollector(namespace="springscale", registry=registry)
    return registry


def _service(now: Status) -> Iterator[Metric]:
    info = GaugeMetricFamily(
        "springscale_info",
        "Always 1; the labels tell which service this is.",
        labels=["version", "vehicle_id", "estimator", "calibration_id"],
    )
    info.add_metric([now.version, now.vehicle_id or "", now.estimator or "", now.calibration_id or ""], 1)
    yield info
    state = GaugeMetricFamily(
        "springscale_state", "1 for what the service is doing, 0 for the others.", labels=["state"]
    )
    for each in State:
        state.add_metric([each], float(each is now.state))
    yield state
    yield _gauge("springscale_ready", "1 while estimates can come.", float(now.is_ready))
    yield _gauge("springscale_uptime_seconds", "Since the start of the service.", now.uptime_s)


def _bus(now: Status) -> Iterator[Metric]:
    yield _counter("springscale_bus_frames_total", "CAN data frames received.", now.bus.n_frames)
    yield _counter("springscale_bus_error_frames_total", "CAN error frames received.", now.bus.n_error_frames)
    yield _counter("springscale_bus_reconnects_total", "Times the interface was opened again.", now.bus.n_reconnects)
    dropped = CounterMetricFamily(
        "springscale_bus_dropped_frames_total", "Frames lost on the way in.", labels=["where"]
    )
    dropped.add_metric(["inbox"], now.bus.n_inbox_dropped)
    if now.bus.n_kernel_dropped is not None:
        dropped.add_metric(["kernel"], now.bus.n_kernel_dropped)
    yield dropped
    if now.bus.last_frame_age_s is not None:
        yield _gauge("springscale_bus_last_frame_age_seconds", "Since the last frame.", now.bus.last_frame_age_s)


_SIGNAL_GAUGES: Final = (
    ("rate_hz", "springscale_signal_rate_hertz", "Samples per second."),
    ("last_age_s", "springscale_signal_last_age_seconds", "Since the last sample."),
    ("rejected_share", "springscale_signal_rejected_ratio", "Share of frames that gave no sample."),
)


def _signals(now: Status) -> Iterator[Metric]:
    decoded = CounterMetricFamily(
        "springscale_decoded_frames_total",
        "Frames of mapped signals by what became of them.",
        labels=["signal", "reason"],
    )
    for count in now.decode:
        decoded.add_metric([count.signal, count.reason], count.n)
    yield decoded
    for name, metric, text in _SIGNAL_GAUGES:
        gauge = GaugeMetricFamily(metric, text, labels=["signal"])
        for signal in now.signals:
            if (reading := getattr(signal, name)) is not None:
                gauge.add_metric([signal.signal], reading)
        yield gauge


def _batches(now: Status) -> Iterator[Metric]:
    batches = CounterMetricFamily("springscale_batches_total", "Batches by outcome.", labels=["outcome"])
    batches.add_metric(["estimate"], now.batches.n_estimates)
    batches.add_metric(["rejected"], now.batches.n_rejected)
    batches.add_metric(["provisional"], now.batches.n_provisional)
    yield batches
    yield _labelled(
        "springscale_rejections_total", "Batches by reason of rejection.", "reason", now.batches.rejected_by_reason
    )


def _store(now: Status) -> Iterator[Metric]:
    store = now.store
    yield _gauge("springscale_store_degraded", "1 while estimates are kept in memory only.", float(store.state != "ok"))
    yield _gauge("springscale_store_held_rows", "Rows that wait for the disk.", store.n_held)
    yield _gauge("springscale_store_size_bytes", "Size of the database.", store.size_bytes)
    yield _labelled(
        "springscale_store_rows_total",
        "Rows by what became of them.",
        "outcome",
        {
            "written": store.n_written,
            "dropped": store.n_dropped,
            "duplicate": store.n_duplicates,
            "pruned": store.n_pruned,
        },
    )


def _verification(verification: VerificationStatus) -> Iterator[Metric]:
    yield _gauge("springscale_verification_due", "1 while one with known loads is due.", float(verification.is_due))
    if verification.last_at is not None:
        passed = float(verification.last_verdict == "passed")
        yield _gauge("springscale_verification_passed", "1 where the last of this calibration passed.", passed)


def _record(record: RecordStatus) -> Iterator[Metric]:
    yield _gauge("springscale_record_refused", "1 while frames cannot be recorded.", float(bool(record.last_fault)))
    yield _gauge("springscale_record_size_bytes", "Size of the ring log.", record.size_bytes)
    yield _counter("springscale_record_written_bytes_total", "Bytes written to it.", record.n_bytes_written)
    yield _labelled(
        "springscale_record_frames_total",
        "Frames by what became of them.",
        "outcome",
        {"written": record.n_frames_written, "dropped": record.n_frames_dropped},
    )


def _uplink(uplink: UplinkStatus) -> Iterator[Metric]:
    yield _gauge("springscale_uplink_connected", "1 while connected to the broker.", float(uplink.is_connected))
    yield _gauge("springscale_uplink_waiting_rows", "Rows still to be delivered.", uplink.n_waiting)
    if uplink.waiting_age_s is not None:
        yield _gauge(
            "springscale_uplink_oldest_waiting_age_seconds", "Of the oldest of these rows.", uplink.waiting_age_s
        )
    yield _counter("springscale_uplink_connections_total", "Times the broker was reached.", uplink.n_connections)
    yield _counter("springscale_uplink_cuts_total", "Times an established link broke.", uplink.n_cuts)
    yield _labelled(
        "springscale_uplink_rows_total",
        "Rows by what became of them.",
        "outcome",
        {"delivered": uplink.n_delivered, "refused": uplink.n_refused, "pruned": uplink.n_pruned},
    )


def _web(board: Board, responses: Counter[int]) -> Iterator[Metric]:
    fanout = board.fanout
    yield _labelled(
        "springscale_http_responses_total", "HTTP answers by status.", "code", {str(c): n for c, n in responses.items()}
    )
    yield _gauge("springscale_stream_clients", "Open streams.", fanout.n_subscribers)
    yield _counter(
        "springscale_stream_slow_clients_total",
        "Streams ended because the client read too slowly.",
        fanout.n_slow_clients,
    )
    yield _counter("springscale_stream_dropped_events_total", "Events those clients lost.", fanout.n_events_dropped)


def _estimate(board: Board) -> Iterator[Metric]:
    shown = board.shown()
    payload, share, age_s = shown.payload, shown.front_share, math.nan if shown.age_s is None else shown.age_s
    cg_left, left_share = shown.cg_left, shown.left_share
    gauges = (
        ("springscale_payload_kilograms", "Payload of the latest estimate.", payload.number),
        ("springscale_payload_std_kilograms", "Its standard deviation.", payload.std),
        ("springscale_front_share_ratio", "Share of the sprung mass on the front axle.", share.number * 0.01),
        ("springscale_front_share_std_ratio", "Its standard deviation.", share.std * 0.01),
        ("springscale_cg_left_meters", "Sprung mass's centre of gravity, left of the centre line.", cg_left.number),
        ("springscale_cg_left_std_meters", "Its standard deviation.", cg_left.std),
        ("springscale_left_share_ratio", "Share of the sprung mass on the left wheels.", left_share.number * 0.01),
        ("springscale_left_share_std_ratio", "Its standard deviation.", left_share.std * 0.01),
        ("springscale_estimate_age_seconds", "Since the latest estimate was received.", age_s),
    )
    yield from (_gauge(metric, text, reading) for metric, text, reading in gauges if math.isfinite(reading))
    yield _gauge("springscale_estimate_stale", "1 while the latest estimate is old.", float(shown.is_stale))


def _weights(weights: LatestWeights) -> Iterator[Metric]:
    """One label value for each place a vehicle is weighed at."""
    families = (
        ("kg", GaugeMetricFamily("springscale_weight_kilograms", "Weight on the road.", labels=["where"])),
        ("std_kg", GaugeMetricFamily("springscale_weight_std_kilograms", "Its standard deviation.", labels=["where"])),
        ("limit_kg", GaugeMetricFamily("springscale_weight_limit_kilograms", "What it may be.", labels=["where"])),
        ("is_over_limit", GaugeMetricFamily("springscale_overload", "1 while it is too much.", labels=["where"])),
    )
    for name, family in families:
        for where in PLACES:
            reading = getattr(getattr(weights, where), name)
            if reading is not None:
                family.add_metric([where], float(reading))
        yield family


def _gauge(name: str, text: str, reading: float) -> Metric:
    return GaugeMetricFamily(name, text, value=reading)


def _counter(name: str, text: str, n: int) -> Metric:
    return CounterMetricFamily(name, text, value=n)


def _labelled(name: str, text: str, label: str, counts: Mapping[str, int]) -> Metric:
    counter = CounterMetricFamily(name, text, labels=[label])
    for key, n in counts.items():
        counter.add_metric([key], n)
    return counter
