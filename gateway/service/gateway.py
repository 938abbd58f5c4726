"""The service itself: starts its parts in order, supervises them, and stops them in reverse order."""

import contextlib
import logging
import queue
import signal
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from gateway.bus.listen import OpenReceiver, SourceState
from gateway.bus.signals import Decoder
from gateway.config import Settings
from gateway.errors import SpringscaleError
from gateway.log import Event, log_event
from gateway.part import Repeated, ServicePart
from gateway.service.alarm_reader import AlarmService, rules_of
from gateway.service.batch_log import BatchLog, LoadEventLog, StateLog
from gateway.service.journal_reader import JournalReader
from gateway.service.notify import Notifier
from gateway.service.parts import (
    board_of,
    learner_of,
    ring_log_of,
    source_of,
    store_of,
    tls_of,
    uplink_of,
    webhook_of,
)
from gateway.service.pipeline import Beside, Pipeline
from gateway.service.status_of_parts import StatusReport
from gateway.service.stopping import CLOSE_WITHIN_S, Deadline, stop_in_turn
from gateway.setup import Setup
from gateway.uplink.settings import uplink_settings, webhook_settings
from gateway.web.access.serving import WebServer, refuse_open_address, server_config
from gateway.web.access.tokens import TokenFile
from gateway.web.app import create_app
from gateway.web.routes.weights import KnownLoads

SUPERVISE_S = 0.25  # chosen: interval between checks for dead parts
LOOK_S = 1.0  # chosen: interval between checks of the whole status
ASLEEP_SUPERVISE_S = 2.0  # chosen: the same two while the bus is silent, to save the battery of a parked vehicle
ASLEEP_LOOK_S = 5.0  # chosen
ASK_S = 5.0  # chosen: interval between the service's own questions to its web server; systemd waits for 20 s
BUS_WITHIN_S = 2.0  # chosen: for the bus reader during a stop
PIPELINE_WITHIN_S = 10.0  # chosen: for the pipeline: a full inbox contains several windows
FLUSH_WITHIN_S = 8.0  # chosen: for writing to the disk

OnStarted = Callable[["Gateway"], None]


class GatewayFailedError(SpringscaleError):
    """A vital part of the running service died; the process ends so that systemd restarts it."""


class Gateway:
    """The service of one vehicle. :meth:`run` returns after a stop request, and raises if a vital part dies."""

    def __init__(
        self,
        settings: Settings,
        setup: Setup,
        *,
        on_started: OnStarted = lambda gateway: None,
        known_loads: KnownLoads | None = None,
        open_receiver: OpenReceiver | None = None,
        setup_fault: str | None = None,
        by_file: Path | None = None,
    ) -> None:
        """``by_file`` is the calibration that the settings name, if another one is in use.

        ``setup_fault`` says why the calibration that was learnt is not in use.

        ``open_receiver`` replaces the bus interface (soak run).
        """
        self._settings = settings
        self._setup_fault = setup_fault
        self._on_started = on_started
        self._tokens = token_file = TokenFile(settings.store.directory / "tokens.json")
        tls = tls_of(settings)
        refuse_open_address(settings.web.host, has_tokens=token_file.are_required(), has_tls=tls is not None)
        broker = uplink_settings(settings.uplink, settings.vehicle)
        receiver, with_places = webhook_settings(settings.webhook, settings.vehicle), settings.position.forward
        self.store = store_of(settings.store, broker, receiver)
        if setup_fault is not None:
            log_event(Event.SETUP_REFUSED, level=logging.ERROR, fault=setup_fault)
            self.store.write_event("setup_fault", {"fault": setup_fault})
        self.board = board_of(settings.web.stale_after_s, self.store, setup)
        self.source = source_of(settings.bus, setup, open_receiver)
        flow = setup.flow(replace(settings.batch.for_core(is_live=True), position_decimals=settings.position.decimals))
        self.learner = learner_of(settings, by_file or settings.calibration, setup, flow, self.store)
        self.ring_log = ring_log_of(settings, setup)
        subject = setup.subject
        self.alarms = AlarmService(rules_of(settings.alarms), subject, self.store)
        events = LoadEventLog(setup, self.store)
        self.readers = [JournalReader(one.NAME, self.store, one) for one in (BatchLog(), events, self.alarms)]
        self.pipeline = Pipeline(
            self.source.inbox,
            Decoder(setup.signal_map),
            flow,
            self.store,
            self.board,
            self.ring_log.put if self.ring_log else lambda frames: None,
        )
        self.uplink = uplink_of(broker, setup, self.store, self.learner, with_places=with_places)
        self.webhook = webhook_of(receiver, self.store, with_places=with_places)
        reader = self.store.reader()
        self.status = StatusReport(
            settings,
            setup,
            self.source,
            self.pipeline,
            self.store,
            self.board,
            self.uplink,
            self.webhook,
            self.ring_log,
            alarms=self.alarms.summary,
            faults=self._faults,
        )
        app = create_app(
            self.board,
            reader,
            self.status,
            calibrated=setup.calibrated,
            tokens=token_file,
            known_loads=known_loads,
            alarms=self.alarms.standing,
            learner=self.learner,
            are_places_read=settings.position.forward,
        )
        self._server = WebServer(server_config(app, settings.web.host, settings.web.port, tls))
        self._notifier = Notifier()
        self._checks = Beside()
        self._stop_requests: queue.SimpleQueue[None] = queue.SimpleQueue()  # whose put a signal may interrupt
        self._failure: str | None = None
        self._progress = -1  # of the pipeline, when systemd was last told of it
        look, pause_s = partial(self.look, StateLog(self.board)), partial(self._pause_s, LOOK_S, ASLEEP_LOOK_S)
        watchdog = Repeated("watchdog", self._feed_watchdog, lambda: ASK_S)
        self._checking = [Repeated("check of the status", look, pause_s), watchdog]
        beside = (self.learner, *self.readers, self.ring_log, self.uplink, self.webhook)
        self._beside = [part for part in beside if part is not None]
        self.parts: list[ServicePart] = [self.store, *self._beside, self.pipeline, self.source]
        self.parts += [self._server, *self._checking]
        self.needs_restart = False  # with the calibration that was learnt meanwhile; see lifecycle.py

    def _faults(self) -> tuple[str, ...]:
        """Faults of parts that the status does not tell of, as sentences for people."""
        faults = [self._tokens.fault, self._setup_fault, self._checks.fault, *(part.fault for part in self.parts)]
        return tuple(fault for fault in faults if fault)

    @property
    def url(self) -> str:
        host = self._settings.web.host
        return f"{self._server.scheme}://{f'[{host}]' if ':' in host else host}:{self._server.port}"

    @property
    def has_caught_up(self) -> bool:
        """Whether every received frame has been processed, and every reader has read the journal."""
        if self.pipeline.n_frames != self.source.counts().frames - self.source.inbox.dropped:
            return False
        return all(reader.has_caught_up for reader in self.readers)

    def request_stop(self) -> None:
        """Request a stop, from any thread or signal handler."""
        self._stop_requests.put(None)

    def run(self) -> None:
        """Serve until SIGTERM or SIGINT. Raises GatewayFailedError with a clear line when a part dies."""
        with _signals_taken(self.request_stop):
            try:
                self._start_parts()
                self._supervise()
            except Exception as failure:  # noqa: BLE001 - accepted records still have to reach the disk
                self._failure = f"the supervisor died: {failure!r}"
            try:
                self._stop_parts()
            except Exception as failure:  # noqa: BLE001 - the process has to end all the same
                self._failure = self._failure or f"the stop failed: {failure!r}"
            self._server.stop()
            self._notifier.close()
        if self._failure is not None:
            raise GatewayFailedError(self._failure)

    def _start_parts(self) -> None:
        bus = self._settings.bus
        log_event(Event.STARTED, version=self.status().version, interface=bus.interface, channel=bus.channel)
        for part in self.parts:
            part.start()
        self.store.write_event("started", {"interface": bus.interface})

    def _supervise(self) -> None:
        """Report the start to systemd, and wait for a stop request, a new calibration, or the death of a vital part."""
        is_ready = False
        while self._failure is None:
            self._failure = self._dead_part()
            if self._server.is_started and not is_ready:
                is_ready = True
                self._notifier.send(READY="1")
                log_event(Event.READY, url=self.url)
                self._on_started(self)
            if self.learner.learnt.is_due and self.pipeline.is_between_drives(self._settings.batch.silence_s):
                self.needs_restart = True
                return
            with contextlib.suppress(queue.Empty):
                self._stop_requests.get(timeout=self._pause_s(SUPERVISE_S, ASLEEP_SUPERVISE_S))
                return

    def _pause_s(self, awake_s: float, asleep_s: float) -> float:
        """Seconds until the next turn of a check."""
        return asleep_s if self.source.state is SourceState.BUS_SILENT else awake_s

    def _feed_watchdog(self) -> None:
        """Tell systemd that the service works: its web server answers, and its pipeline has gone on since."""
        if not self._notifier.is_heard and self._server.fault is None:
            return
        if self._server.is_answering() and self.pipeline.progress != self._progress:
            self._progress = self.pipeline.progress
            self._notifier.send(WATCHDOG="1")

    def look(self, log_state: StateLog) -> None:
        """One check of the service's state."""
        now = self.status()
        self._checks.call("log of states", log_state, now)
        causes = [cause.text for cause in self.pipeline.decoder.causes()]
        self._checks.call("alarms", self.alarms.watch, now, causes)
        self._notifier.send_status(now.sentence())

    def _dead_part(self) -> str | None:
        """Which vital part died, and why; None while all work."""
        for part in self.parts:
            if part.IS_VITAL and (death := part.death()) is not None:
                return f"the {part.NAME} {death}"
        return None

    def _stop_parts(self) -> None:
        """Stop the bus, then the pipeline, then flush the store, so that every accepted estimate is on disk before the
        other parts stop; the store is the last. What fails on the way keeps no other from its turn.

        All share one deadline. Parts that hang are abandoned.
        """
        deadline = Deadline()
        late: list[str] = []
        self._notifier.send(STOPPING="1", STATUS="Stopping.")
        with contextlib.ExitStack() as steps:  # the last is done first
            steps.callback(lambda: self._close_store(deadline, late))
            steps.callback(self.board.close)
            steps.callback(lambda: late.extend(stop_in_turn(self._beside, deadline)))
            steps.callback(lambda: self.store.flush(deadline.left_s(FLUSH_WITHIN_S)))
            steps.callback(lambda: self.pipeline.stop(deadline.left_s(PIPELINE_WITHIN_S)))
            steps.callback(lambda: self.source.stop(deadline.left_s(BUS_WITHIN_S)))
            for check in self._checking:
                check.stop(within_s=0.0)

    def _close_store(self, deadline: Deadline, late: Sequence[str]) -> None:
        self.store.write_event("stopped", {"failure": self._failure})
        n_lost = self.store.close(max(CLOSE_WITHIN_S, deadline.left_s())) + self.store.health().n_dropped
        if n_lost and self._failure is None:
            self._failure = f"{n_lost} records could not be stored: {self.store.health().reason or 'there was no time'}"
        level = logging.ERROR if n_lost or late or self._failure else logging.INFO
        log_event(Event.STOPPED, level=level, failure=self._failure, rows_lost=n_lost)


@contextlib.contextmanager
def _signals_taken(request_stop: Callable[[], None]) -> Iterator[None]:
    """SIGTERM and SIGINT request a stop meanwhile."""
    before = [(number, signal.signal(number, lambda *_: request_stop())) for number in (signal.SIGTERM, signal.SIGINT)]
    try:
        yield
    finally:
        for number, handler in before:
            signal.signal(number, handler)
