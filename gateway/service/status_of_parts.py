"""The status of the service, collected from its parts for the web and for systemd."""

import time
from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass, field
from functools import partial
from importlib.metadata import version
from typing import Final

from gateway.bus.listen import LiveSource, SourceState
from gateway.bus.ring_log import RingLog
from gateway.config import Settings
from gateway.records import FIRST_DATED_NS, Signal
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
    judged,
)
from gateway.store import Store
from gateway.uplink.uplink import Uplink
from gateway.uplink.webhook import Webhook
from gateway.web.live.board import Board

SENSOR_LOST_S = 10.0  # chosen: a sensor silent for this long on a bus that is alive is at fault
NEEDED_SENSORS = (Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE)
READ_IN: Final = {  # customary units
    Signal.AXLE_WEIGHT: ("kg", 1.0),
    Signal.AIR_SPRING_PRESSURE: ("kPa", 1e3),
    Signal.RIDE_HEIGHT: ("mm", 1e-3),
}
CLOCK_NOT_SET: Final = "the computer's clock is not set: until it is, estimates have dates of 1970"
SPEED_LOST_S = 10.0  # chosen: without a valid speed for this long the service waits for one


@dataclass
class StatusReport:
    """A callable that returns the present :class:`Status`; fast, and safe from any thread."""

    settings: Settings
    setup: Setup
    source: LiveSource
    pipeline: Pipeline
    store: Store
    board: Board
    uplink: Uplink | None = None
    webhook: Webhook | None = None
    ring_log: RingLog | None = None
    _: KW_ONLY
    alarms: Callable[[], AlarmsStatus] = AlarmsStatus
    faults: Callable[[], tuple[str, ...]] = tuple
    version: str = field(init=False, default_factory=partial(version, "springscale"))  # read from a file, once
    started_s: float = field(init=False, default_factory=time.monotonic)

    def __call__(self) -> Status:
        now = Status(
            version=self.version,
            state=self.state(),
            uptime_s=time.monotonic() - self.started_s,
            vehicle_id=self.setup.identity.vehicle_id,
            vin=self.setup.identity.vin,
            calibration_id=self.setup.calibration_id,
            estimator=self.setup.estimator,
            bus=self._bus(),
            decode=self._decode(),
            signals=self._signals(),
            own_readings=self._own_readings(),
            standing=self._standing(),
            batches=BatchCounts(
                **self.pipeline.counts,
                n_late_rows=self.pipeline.flow.scheduler.n_late_rows,
                missing_s=round(self.pipeline.flow.missing_s, 1),
                rejected_by_reason=dict(self.pipeline.rejected_by_reason),
            ),
            store=self.store.health(),
            uplink=self.uplink.report() if self.uplink else None,
            webhook=self.webhook.report() if self.webhook else None,
            record=self.ring_log.status() if self.ring_log else None,
            alarms=self.alarms(),
        )
        is_clock_set = time.time_ns() >= FIRST_DATED_NS
        return judged(now, (*self.faults(), *(() if is_clock_set else (CLOCK_NOT_SET,))))

    def state(self) -> State:
        """The worst state that applies."""
        speed_age_s = self._age_s(Signal.SPEED)
        claims: tuple[tuple[State, Callable[[], bool]], ...] = (
            (State.READER_FAULT, lambda: self.source.state is SourceState.READER_FAULT),
            (State.STARTING, lambda: self.source.state is SourceState.STARTING),
            (State.WAITING_FOR_BUS, lambda: self.source.state is not SourceState.RECEIVING),
            (State.SENSOR_FAULT, self._is_a_sensor_silent),
            (
                State.WAITING_FOR_SPEED,
                lambda: self.pipeline.flow.scheduler.is_parked or speed_age_s is None or speed_age_s > SPEED_LOST_S,
            ),
            (State.STALE, self.board.is_stale),
            (State.NOT_WEIGHED, lambda: (heard := self.board.heard()) is not None and not heard.counted),
            (State.COLLECTING, lambda: self.board.age_s() is None),
        )
        return next((state for state, holds in claims if holds()), State.ESTIMATING)

    def _is_a_sensor_silent(self) -> bool:
        """Whether a sensor that every estimate needs is silent; one not received yet counts from the start."""
        running_s = time.monotonic() - self.started_s
        ages_s = [self._age_s(signal) for signal in NEEDED_SENSORS if signal in self.setup.signal_map.signals]
        return any((running_s if age_s is None else age_s) > SENSOR_LOST_S for age_s in ages_s)

    def _age_s(self, signal: Signal) -> float | None:
        heard = self.pipeline.watch.last_heard.get(signal)
        return None if heard is None else time.monotonic() - heard

    def _bus(self) -> BusStatus:
        counts = self.source.counts()
        ages = [age for signal in self.setup.signal_map.signals if (age := self._age_s(signal)) is not None]
        return BusStatus(
            interface=self.settings.bus.interface,
            channel=self.settings.bus.channel,
            state=str(self.source.state),
            n_frames=counts.frames,
            n_error_frames=counts.error_frames,
            n_remote_frames=counts.remote_frames,
            n_reconnects=counts.reconnects,
            n_inbox_dropped=counts.dropped_inbox,
            n_kernel_dropped=counts.dropped_kernel,
            n_clock_sets=counts.clock_sets,
            last_frame_age_s=min(ages, default=None),
            last_fault=self.source.reason,
        )

    def _decode(self) -> tuple[DecodeCount, ...]:
        rows = []
        for signal, counts in self.pipeline.decoder.counts.items():
            rows.append(DecodeCount(signal=str(signal), reason="ok", n=counts.samples))
            rows.extend(
                DecodeCount(signal=str(signal), reason=str(reason), n=n) for reason, n in counts.rejected.items() if n
            )
        return tuple(rows)

    def _signals(self) -> tuple[SignalHealth, ...]:
        health = []
        for signal, counts in self.pipeline.decoder.counts.items():
            n_rejected = sum(counts.rejected.values())
            total = counts.samples + n_rejected
            health.append(
                SignalHealth(
                    signal=str(signal),
                    rate_hz=self.pipeline.watch.rate_hz.get(signal),
                    last_age_s=self._age_s(signal),
                    rejected_share=n_rejected / total if total else None,
                )
            )
        return tuple(health)

    def _own_readings(self) -> tuple[OwnReading, ...]:
        """Readings of the vehicle's own load sensors, in customary units."""
        readings = sorted(self.pipeline.watch.readings.items())
        return tuple(
            OwnReading(signal=str(signal), number=round(reading / of_unit, 3), unit=unit, age_s=age_s)
            for signal, reading in readings
            for unit, of_unit in (READ_IN[signal],)
            if (age_s := self._age_s(signal)) is not None
        )

    def _standing(self) -> Standing:
        shown = self.board.shown().estimate
        standing = self.pipeline.standing
        return Standing(
            stood_s=standing.stood_s(), is_load_weighed=shown is not None and standing.is_of_this_load(shown)
        )
