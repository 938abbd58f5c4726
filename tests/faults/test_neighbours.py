"""One part's failure is its own: weighing goes on, the status names it, and the part begins anew."""

import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from support.bus_drive import START_NS, white_noise
from support.calibrated import calibration_file, calibration_text
from support.configured import service_config
from support.patience import PATIENCE_S, wait_until
from support.running_service import Running, configuration, estimated, serve, stored

from gateway.bus.logs import write_candump
from gateway.bus.ring_log import RingLog
from gateway.config import load_settings
from gateway.part import BackOff, ServicePart, ThreadPart
from gateway.service import gateway as service
from gateway.service.alarm_reader import AlarmService
from gateway.service.batch_log import BatchLog, LoadEventLog, StateLog
from gateway.service.gateway import Gateway
from gateway.service.learner.learner import Learner
from gateway.service.signal_watch import SignalWatch, StandingWatch
from gateway.service.status_of_parts import StatusReport
from gateway.setup import setup_of
from gateway.units import NS_PER_S
from gateway.web.live.board import Board

CALLS: dict[str, tuple[type, str, str]] = {  # what is made to fail, and how the status names it
    "the recorder": (RingLog, "put", "the recorder failed"),
    "the learner": (Learner, "take", "the learner failed"),
    "the watch of signals": (SignalWatch, "saw", "the watch of signals failed"),
    "the watch of stops": (StandingWatch, "saw", "the watch of stops failed"),
    "the board": (Board, "publish", "the board failed"),
    "the alarms by batches": (AlarmService, "__call__", "alarms failed"),
    "the alarms by status": (AlarmService, "watch", "the alarms failed"),
    "the load events": (LoadEventLog, "__call__", "load events failed"),
    "the log of batches": (BatchLog, "__call__", "log of batches failed"),
    "the log of states": (StateLog, "__call__", "the log of states failed"),
}


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A drive; that of the next hour lies beside it."""
    path = tmp_path_factory.mktemp("drive") / "drive.log"
    write_candump(white_noise(70.0, START_NS, seed=5), "can0", path)
    write_candump(white_noise(70.0, START_NS + 3600 * NS_PER_S, seed=6), "can0", path.with_name("next.log"))
    return path


@pytest.fixture
def config(tmp_path: Path) -> Path:
    weighs = calibration_file(payload_kg=12.0, front_share_pct=51.0)
    calibration = calibration_text(weighs, unsprung_front_kg=80.0, unsprung_rear_kg=80.0)
    return configuration(tmp_path, calibration, "[record]\nenabled = true\nfree_mb = 0")


def fail(*_: object, **__: object) -> None:
    raise OverflowError("too much")


@pytest.mark.parametrize("what", CALLS)
def test_a_call_that_fails_costs_no_window_and_no_process(
    what: str, config: Path, log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The process ended, with the windows in its inbox."""
    owner, name, told = CALLS[what]
    works = getattr(owner, name)

    def drive(running: Running) -> None:
        def warnings() -> tuple[str, ...]:
            return running.gateway.status().warnings

        running.play(log)
        assert wait_until(lambda: any(told in said and "too much" in said for said in warnings()))
        if name not in ("put", "take"):  # which the service looked up at its start
            monkeypatch.setattr(owner, name, works)
            running.play(log.with_name("next.log"))
            assert wait_until(lambda: not any("too much" in said for said in warnings()))

    monkeypatch.setattr(owner, name, fail)
    serve(config, drive)
    assert stored(config)[:3] == estimated(config, log)[:3]


def test_a_follower_of_the_journal_that_raises_costs_no_record(config: Path, log: Path) -> None:
    def drive(running: Running) -> None:
        follower = running.gateway.store.follow(("estimate",), running.gateway.store.head(), fail)
        running.play(log)
        assert len(follower.read(10)) == 3

    serve(config, drive)
    assert stored(config)[:3] == estimated(config, log)[:3]


def test_a_status_that_cannot_be_made_ends_nothing(config: Path, log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def check(running: Running) -> ServicePart:
        return next(part for part in running.gateway.parts if part.NAME == "check of the status")

    def drive(running: Running) -> None:
        with monkeypatch.context() as breaking:
            breaking.setattr(StatusReport, "state", fail)
            running.play(log)
            assert wait_until(lambda: check(running).fault is not None)
        assert wait_until(lambda: check(running).fault is None)

    serve(config, drive)
    assert stored(config)[:3] == estimated(config, log)[:3]


def test_a_step_of_the_stop_that_fails_keeps_no_other_from_its_turn(
    config: Path, log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The process hung, and the store was not closed."""
    monkeypatch.setattr(Board, "close", fail)
    with pytest.raises(service.GatewayFailedError, match="the stop failed: OverflowError"):
        serve(config, lambda running: running.play(log))
    assert stored(config)[:3] == estimated(config, log)[:3]


class Clumsy(ThreadPart):
    """Fails the first times that it works, then waits for its end."""

    NAME = "clumsy"

    def __init__(self, *failures: BaseException, is_vital: bool = False) -> None:
        super().__init__("clumsy", BackOff(0.001, 0.002))
        self.IS_VITAL = is_vital
        self._failures = list(failures)
        self.n_works = 0
        self.may_succeed = threading.Event()

    def _work(self) -> None:
        self.n_works += 1
        if self._failures:
            raise self._failures.pop(0)
        self.may_succeed.wait()
        self._succeeded()
        self._stopping.wait()


def test_a_part_that_fails_is_at_fault_until_it_has_succeeded() -> None:
    part = Clumsy(ValueError("one"), KeyError("two"))
    part.start()
    assert wait_until(lambda: part.n_works == 3)
    assert (part.fault, part.death()) == ("clumsy failed: KeyError('two'); weighing goes on", None)
    part.may_succeed.set()
    assert wait_until(lambda: part.fault is None)
    part.stop()
    assert not part.is_alive()


def test_a_vital_part_that_fails_is_dead() -> None:
    part = Clumsy(ValueError("one"), is_vital=True)
    part.start()
    assert wait_until(lambda: part.death() is not None)
    assert (part.death(), part.n_works) == ("died: ValueError('one')", 1)


def test_vital_are_the_bus_the_pipeline_and_the_database(config: Path) -> None:
    settings = load_settings(config)
    vital: list[str] = []

    def on_started(running: Gateway) -> None:
        vital.extend(part.NAME for part in running.parts if part.IS_VITAL)
        running.request_stop()

    Gateway(settings, setup_of(settings), on_started=on_started).run()
    assert vital == ["database writer", "pipeline", "bus reader"]


def test_a_reader_of_the_journal_starts_where_it_stopped(
    config: Path, log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Windows that are stored while the load events do not run are taken at the next start, each once."""
    taken: list[str] = []
    hear = LoadEventLog.__call__

    def noted(self: LoadEventLog, found: Any) -> None:
        taken.append(found.id)
        hear(self, found)

    monkeypatch.setattr(LoadEventLog, "__call__", noted)
    serve(config, lambda running: None)  # its place is kept
    reader = "gateway.service.journal_reader.JournalReader"
    with monkeypatch.context() as breaking:
        breaking.setattr(f"{reader}._work", lambda reader: reader._stopping.wait())
        breaking.setattr(f"{reader}.has_caught_up", True)
        serve(config, lambda running: running.play(log))
    assert taken == []
    serve(config, lambda running: None)
    n_windows = len(taken)
    assert n_windows >= 3
    serve(config, lambda running: None)
    assert len(taken) == len(set(taken)) == n_windows


def heard_by(notifications: socket.socket) -> Callable[[], list[str]]:
    """The messages that systemd received since the last call."""

    def heard() -> list[str]:
        lines: list[str] = []
        with suppress(BlockingIOError):
            while True:
                lines += notifications.recv(4096, socket.MSG_DONTWAIT).decode().splitlines()
        return lines

    return heard


@pytest.mark.parametrize("host", ["127.0.0.1", "0.0.0.0"])
def test_the_watchdog_is_fed_only_while_the_web_answers(
    host: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was fed by the pipeline alone, however long no request was answered."""
    settings = load_settings(service_config(tmp_path))
    settings = settings.model_copy(update={"web": settings.web.model_copy(update={"host": host})})
    monkeypatch.setattr(service, "refuse_open_address", lambda *_, **__: None)
    monkeypatch.setattr(service, "ASK_S", 0.05)
    path = str(tmp_path / "notify")
    seen: list[list[str]] = []
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as notifications:
        notifications.bind(path)
        monkeypatch.setenv("NOTIFY_SOCKET", path)
        heard = heard_by(notifications)

        def on_started(running: Gateway) -> None:
            def watch() -> None:
                if wait_until(lambda: "WATCHDOG=1" in heard()):
                    server = running._server._server
                    running._server._loop.call_soon_threadsafe(server.servers[-1].close)  # it takes nobody any more
                    wait_until(lambda: not server.servers[-1].is_serving())
                    n_turns = running.pipeline.progress
                    wait_until(lambda: running.pipeline.progress > n_turns + 1)  # what was asked before is answered
                    heard()
                    wait_until(lambda: running.pipeline.progress > n_turns + 3)
                    seen.append(heard())
                running.request_stop()

            threading.Thread(target=watch, daemon=True).start()

        Gateway(settings, setup_of(settings), on_started=on_started).run()
    ((*said,),) = seen
    assert "WATCHDOG=1" not in said


def test_a_web_server_that_dies_begins_anew(config: Path, log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(service, "ASK_S", 0.05)

    def drive(running: Running) -> None:
        server = running.gateway._server
        server._loop.call_soon_threadsafe(server._server.ending.set)
        assert wait_until(lambda: server.fault is not None)
        assert wait_until(lambda: server.is_started)
        running.play(log)
        assert running.http("/health/live") == {"is_alive": True}
        assert wait_until(lambda: server.fault is None)

    serve(config, drive)
    assert stored(config)[:3] == estimated(config, log)[:3]


def test_a_stop_while_the_web_server_pauses_ends_the_process(config: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It waited for the end of the pause, and then for ever."""
    pause = threading.Event()

    def long_pause(self: BackOff) -> float:
        pause.set()
        return 10.0 * PATIENCE_S

    monkeypatch.setattr(BackOff, "next_s", long_pause)

    def drive(running: Running) -> None:
        server = running.gateway._server
        server._loop.call_soon_threadsafe(server._server.ending.set)
        assert pause.wait(PATIENCE_S)

    begun_s = time.monotonic()
    serve(config, drive)
    assert time.monotonic() - begun_s < PATIENCE_S
