"""The state that the service tells of several, and what a small box must not spend again and again."""

import threading
import time
from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from support.bus_drive import START_NS, white_noise
from support.calibrated import calibration_file, calibration_text
from support.paper_van import paper_van_config
from support.ports import free_port
from support.running_service import Running, configuration, serve

from gateway.bus.listen import SourceState
from gateway.bus.logs import write_candump
from gateway.config import load_settings
from gateway.records import Signal
from gateway.service.gateway import Gateway
from gateway.service.status_of_parts import SENSOR_LOST_S, StatusReport
from gateway.setup import setup_of
from gateway.status import State, Status
from gateway.units import NS_PER_S

SIGNALS = (Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE, Signal.SPEED)
ALL_HEARD: Mapping[Signal, float | None] = dict.fromkeys(SIGNALS, 0.0)
LONG_S = SENSOR_LOST_S + 5.0


def report(
    ages_s: Mapping[Signal, float | None],
    source: SourceState = SourceState.RECEIVING,
    *,
    is_parked: bool = False,
    estimate_age_s: float | None = 20.0,
    is_stale: bool = False,
    is_last_batch_counted: bool | None = True,
) -> State:
    """The state of a service that has run for a minute and heard each signal so long ago (None: never)."""
    now = time.monotonic()
    heard = {signal: now - age_s for signal, age_s in ages_s.items() if age_s is not None}
    scheduler = SimpleNamespace(is_parked=is_parked)
    heard_last = None if is_last_batch_counted is None else SimpleNamespace(counted=is_last_batch_counted)
    parts: dict[str, Any] = {
        "settings": None,
        "setup": SimpleNamespace(signal_map=SimpleNamespace(signals=dict.fromkeys(SIGNALS))),
        "source": SimpleNamespace(state=source),
        "pipeline": SimpleNamespace(watch=SimpleNamespace(last_heard=heard), flow=SimpleNamespace(scheduler=scheduler)),
        "store": None,
        "board": SimpleNamespace(age_s=lambda: estimate_age_s, is_stale=lambda: is_stale, heard=lambda: heard_last),
    }
    told = StatusReport(**cast(Any, parts))
    told.started_s = now - 60.0  # instead of waiting for a minute
    return told.state()


PARKED = {"is_stale": True, "is_parked": True}
STATES: list[tuple[State, dict[Signal, float | None], dict[str, Any]]] = [  # when signals were heard, and the rest
    (State.ESTIMATING, {}, {}),
    *(
        (State.SENSOR_FAULT, {one: age_s}, how)
        for one in SIGNALS[:2]
        for age_s in (LONG_S, None)
        for how in ({}, PARKED)
    ),
    (State.ESTIMATING, {Signal.PITCH_RATE: 0.5 * SENSOR_LOST_S}, {}),  # a pause is no fault
    (State.WAITING_FOR_SPEED, {Signal.SPEED: LONG_S}, {}),
    (State.WAITING_FOR_SPEED, {Signal.SPEED: None}, {}),
    (State.WAITING_FOR_SPEED, {}, {"is_parked": True}),
    # a silent bus is not the sensors' fault
    (State.READER_FAULT, dict.fromkeys(SIGNALS, LONG_S), {"source": SourceState.READER_FAULT}),
    (State.STARTING, dict.fromkeys(SIGNALS, LONG_S), {"source": SourceState.STARTING}),
    (State.WAITING_FOR_BUS, dict.fromkeys(SIGNALS, LONG_S), {"source": SourceState.BUS_SILENT}),
    (State.COLLECTING, {}, {"estimate_age_s": None, "is_last_batch_counted": None}),
    (State.NOT_WEIGHED, {}, {"estimate_age_s": None, "is_last_batch_counted": False}),
    (State.NOT_WEIGHED, {}, {"is_last_batch_counted": False}),
    (State.STALE, {}, {"is_stale": True}),
    (State.STALE, {}, {"is_stale": True, "is_last_batch_counted": False}),
]


@pytest.mark.parametrize(("state", "ages_s", "how"), STATES)
def test_the_state_follows_from_what_was_heard(
    state: State, ages_s: dict[Signal, float | None], how: dict[str, Any]
) -> None:
    assert report({**ALL_HEARD, **ages_s}, **how) is state


def test_the_whole_status_is_made_once_a_second(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It was made four times a second."""
    settings = load_settings(paper_van_config(tmp_path, free_port()))
    made: list[Status] = []
    make = StatusReport.__call__

    def noted(self: StatusReport) -> Status:
        made.append(make(self))
        return made[-1]

    def on_started(gateway: Gateway) -> None:
        made.clear()
        monkeypatch.setattr(StatusReport, "__call__", noted)
        threading.Timer(2.5, gateway.request_stop).start()

    Gateway(settings, setup_of(settings), on_started=on_started).run()
    assert 1 <= len(made) <= 3


def test_samples_that_come_after_their_window_are_counted(tmp_path: Path) -> None:
    """They are in no batch, so the status must say so: the first window ends at 20 s."""
    log = tmp_path / "drive.log"
    write_candump(white_noise(45.0, START_NS, seed=5), "can0", log)
    lines = log.read_text().splitlines(keepends=True)
    begin, end, after = (int(len(lines) * t_s / 45.0) for t_s in (19.7, 19.8, 20.3))
    log.write_text("".join([*lines[:begin], *lines[end:after], *lines[begin:end], *lines[after:]]))

    def drive(running: Running) -> None:
        assert running.http("/api/v1/status")["batches"]["n_late_rows"] == 0
        running.play(log)
        assert 0 < running.http("/api/v1/status")["batches"]["n_late_rows"] <= end - begin

    serve(configuration(tmp_path, calibration_text(calibration_file(payload_kg=12.0))), drive)


def test_a_clock_that_is_not_set_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def look(running: Running) -> None:
        assert running.http("/api/v1/status")["warnings"] == []
        monkeypatch.setattr("gateway.service.status_of_parts.time.time_ns", lambda: 60 * NS_PER_S)
        (warning,) = running.http("/api/v1/status")["warnings"]
        monkeypatch.undo()
        assert "clock is not set" in warning

    serve(configuration(tmp_path, calibration_text()), look)
