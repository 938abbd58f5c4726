"""The state of the service, gathered from all its parts for the web and for systemd."""

import time
from collections.abc import Callable
from importlib.metadata import version
from typing import Final

from gateway.bus.live import Around, LiveSource, SourceState
from gateway.bus.ring import RingLog
from gateway.bus.similar import similar_to
from gateway.config import Settings
from gateway.records import Signal
from gateway.service.pipeline import Pipeline
from gateway.setup import Setup
from gateway.status import (
    AlarmsStatus,
    BatchCounts,
    BusStatus,
    DecodeCount,
    OwnReading,
    SignalHealth,
    Standing,
    State,
    Status,
    VerificationStatus,
)
from gateway.store import Store
from gateway.uplink import Uplink
from gateway.uplink.webhook import Webhook
from gateway.web import Board

SENSOR_LOST_S = 10.0  # a sensor silent for this long on a bus that is alive is at fault
NEEDED_SENSORS = (Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE)
READ_IN: Final = {
    Signal.AXLE_WEIGHT: ("kg", 1.0),
    Signal.AIR_SPRING_PRESSURE: ("kPa", 1e3),
    Signal.RIDE_HEIGHT: ("mm", 1e-3),
}
SPEED_LOST_S = 10.0  # without a valid speed for this long the service waits for one


class StatusReport:
    """Callable that gives the present :class:`Status`; quick, and safe from any thread."""

    def __init__(
        self,
        settings: Settings,
        setup: Setup,
        source: LiveSource,
        pipeline: Pipeline,
        store: Store,
        board: Board,
        uplink: Uplink | None = None,
        webhook: Webhook | None = None,
        ring_log: RingLog | None = None,
        verification: Callable[[], VerificationStatus] = VerificationStatus,
        *,
        around: Around,
        alarms: Callable[[], AlarmsStatus] = AlarmsStatus,
        warnings: Callable[[], tuple[str, ...]] = tuple,
    ) -> None:
        self._settings = settings
        self._setup = setup
        self._source = source
        self._pipeline = pipeline
        self._store = store
        self._board = board
        self._uplink = uplink
        self._webhook = webhook
        self._around = around
        self._ring_log = ring_log
        self._verification = verification
        self._alarms = alarms
        self._warnings = warnings
        self._version = version("springscale")  # read once: it is a file, and a status must not want one
        self._started = time.monotonic()

    def __call__(self) -> Status:
        """The status as of now."""
        state = self.state()
        not_ready = self._why_not_ready(state)
        return Status(
            version=self._version,
            state=state,
            uptime_s=time.monotonic() - self._started,
            vehicle_id=self._setup.identity.vehicle_id,
            vin=self._setup.identity.vin,
            calibration_id=self._setup.calibrated.id if self._setup.calibrated else None,  # hashed once, not each time
            known_weights_id=known.id if (known := self._pipeline.flow.knowledge) else None,
            estimator=self._setup.estimator,
            bus=self._bus(),
            decode=self._decode(),
            signals=self._signals(),
            own_readings=self._own_readings(),
            standing=self._standing(),
            batches=BatchCounts(
                n_estimates=self._pipeline.n_estimates,
                n_rejected=self._pipeline.n_rejected,
                n_provisional=self._pipeline.n_provisional,
                n_remainders=self._pipeline.n_remainders,
                missing_s=round(self._pipeline.flow.missing_s, 1),
                rejected_by_reason=dict(self._pipeline.rejected_by_reason),
            ),
            store=self._store.health(),
            uplink=self._uplink.report() if self._uplink else None,
            webhook=self._webhook.report() if self._webhook else None,
            record=self._ring_log.status() if self._ring_log else None,
            verification=self._verification(),
            alarms=self._alarms(),
            is_ready=not_ready is None,
            not_ready_reason=not_ready,
            warnings=self._warnings(),
        )

    def _why_not_ready(self, state: State) -> str | None:
        """Why no estimate is possible; None if one is. A sleeping bus or a parked vehicle is no reason."""
        if state is State.READER_FAULT:
            return self._source.reason
        if self._setup.calibration is None:
            return "no calibration: batches carry spectra only; name a calibration file in the configuration"
        return None

    def state(self) -> State:
        """The first that applies, worst first."""
        speed_age_s = self._age_s(Signal.SPEED)
        claims: tuple[tuple[State, Callable[[], bool]], ...] = (
            (State.READER_FAULT, lambda: self._source.state is SourceState.READER_FAULT),
            (State.STARTING, lambda: self._source.state is SourceState.STARTING),
            (State.WAITING_FOR_BUS, lambda: self._source.state is not SourceState.RECEIVING),
            (State.SENSOR_FAULT, self._is_a_sensor_silent),
            (
                State.WAITING_FOR_SPEED,
                lambda: self._pipeline.flow.scheduler.is_parked or speed_age_s is None or speed_age_s > SPEED_LOST_S,
            ),
            (State.COLLECTING, lambda: self._board.age_s() is None),
            (State.STALE, self._board.is_stale),
        )
        return next((state for state, holds in claims if holds()), State.ESTIMATING)

    def _is_a_sensor_silent(self) -> bool:
        """Whether a sensor that every estimate needs is silent; one not received yet counts from the start."""
        running_s = time.monotonic() - self._started
        ages_s = [self._age_s(signal) for signal in NEEDED_SENSORS if signal in self._setup.signal_map.signals]
        return any((running_s if age_s is None else age_s) > SENSOR_LOST_S for age_s in ages_s)

    def _age_s(self, signal: Signal) -> float | None:
        heard = self._pipeline.watch.last_heard.get(signal)
        return None if heard is None else time.monotonic() - heard

    def _bus(self) -> BusStatus:
        counts = self._source.counts()
        ages = [age for signal in self._setup.signal_map.signals if (age := self._age_s(signal)) is not None]
        return BusStatus(
            interface=self._settings.bus.interface,
            channel=self._settings.bus.channel,
            state=str(self._source.state),
            n_frames=counts.frames,
            n_error_frames=counts.error_frames,
            n_reconnects=counts.reconnects,
            n_inbox_dropped=counts.dropped_inbox,
            n_kernel_dropped=counts.dropped_kernel,
            last_frame_age_s=min(ages, default=None),
            n_identifiers=len(self._around.heard) or None,
            last_fault=self._source.reason,
        )

    def _decode(self) -> tuple[DecodeCount, ...]:
        rows = []
        for signal, counts in self._pipeline.decoder.counts.items():
            rows.append(DecodeCount(signal=str(signal), reason="ok", n=counts.samples))
            rows.extend(
                DecodeCount(signal=str(signal), reason=str(reason), n=n) for reason, n in counts.rejected.items() if n
            )
        return tuple(rows)

    def _signals(self) -> tuple[SignalHealth, ...]:
        health = []
        for signal, counts in self._pipeline.decoder.counts.items():
            n_rejected = sum(counts.rejected.values())
            total = counts.samples + n_rejected
            health.append(
                SignalHealth(
                    signal=str(signal),
                    rate_hz=self._pipeline.watch.rate_hz.get(signal),
                    last_age_s=self._age_s(signal),
                    rejected_share=n_rejected / total if total else None,
                    similar=self._similar(signal),
                )
            )
        return tuple(health)

    def _own_readings(self) -> tuple[OwnReading, ...]:
        """In the units that people use."""
        readings = sorted(self._pipeline.watch.readings.items())
        return tuple(
            OwnReading(signal=str(signal), number=round(reading / of_unit, 3), unit=unit, age_s=age_s)
            for signal, reading in readings
            for unit, of_unit in (READ_IN[signal],)
            if (age_s := self._age_s(signal)) is not None
        )

    def _standing(self) -> Standing:
        shown = self._board.shown().estimate
        standing = self._pipeline.standing
        return Standing(
            stood_s=standing.stood_s(), is_load_weighed=shown is not None and standing.is_of_this_load(shown)
        )

    def _similar(self, signal: Signal) -> tuple[str, ...]:
        """Identifiers in the last survey that resemble a silent signal's message."""
        age_s = self._age_s(signal)
        heard = self._around.heard
        if not heard or (age_s is not None and age_s < SENSOR_LOST_S):
            return ()
        signal_map = self._setup.signal_map
        message = next(m for m in signal_map.messages if any(mapped.signal is signal for mapped in m.signals))
        return similar_to(message, signal_map, heard)
