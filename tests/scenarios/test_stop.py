"""SIGTERM ends the service with code 0 whatever its threads are doing."""

import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import httpx
import pytest
from support.log import names
from support.paper_van import paper_van_config
from support.patience import PATIENCE_S
from support.ports import first_answer, free_port

from gateway.config import load_settings
from gateway.log import Event
from gateway.part import ServicePart
from gateway.service import gateway
from gateway.service.stopping import CLOSE_WITHIN_S, STOP_WITHIN_S, Deadline, stop_in_turn
from gateway.setup import setup_of
from gateway.web.access import serving

ROOT = Path(__file__).parents[2]


@pytest.fixture
def config(tmp_path: Path) -> Path:
    return paper_van_config(tmp_path, free_port())


def told_until_stopped(module: str, config: Path, before: Callable[[str], object] = lambda url: None) -> str:
    """Run the service of a module of support, stop it by SIGTERM after ``before``: it ends with 0 -> its output."""
    port = re.search(r"port = (\d+)", config.read_text())
    url = f"http://127.0.0.1:{port[1]}"
    with subprocess.Popen(
        [sys.executable, "-m", f"support.{module}", "run", "--config", str(config)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        cwd=ROOT / "tests",
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    ) as process:
        try:
            first_answer(f"{url}/health/live")
            before(url)
            process.send_signal(signal.SIGTERM)
            told, _ = process.communicate(timeout=PATIENCE_S)
        finally:
            process.kill()
    assert process.returncode == 0, told
    assert '"event": "stopped"' in told
    return told


def test_a_pipeline_that_does_not_end_is_left_behind_without_an_abort(config: Path) -> None:
    """Before, Python unwound it inside scipy's C++ at its own end: SIGABRT, and a core instead of an exit code."""
    assert "pipeline did not finish in time" in told_until_stopped("stuck_service", config)


def test_all_parts_together_may_take_no_longer_than_systemd_waits() -> None:
    unit = (ROOT / "deploy/springscale.service").read_text()
    systemd_waits_s = re.search(r"^TimeoutStopSec=(\d+)$", unit, re.MULTILINE)
    assert float(systemd_waits_s[1]) > STOP_WITHIN_S + serving.STOP_WITHIN_S
    first_s = gateway.BUS_WITHIN_S + gateway.PIPELINE_WITHIN_S + gateway.FLUSH_WITHIN_S
    assert first_s + CLOSE_WITHIN_S < STOP_WITHIN_S


def test_parts_stop_in_reverse_order_and_a_hanging_one_does_not_block(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They stopped as they had started, and a lock held by a stalled disk held them all."""
    monkeypatch.setattr("gateway.service.stopping.PART_WITHIN_S", 0.05)
    stopped: list[str] = []
    for_ever = threading.Event()

    class Named(ServicePart):
        def __init__(self, name: str) -> None:
            self.NAME = name

        def stop(self, within_s: float = 0.0) -> None:
            stopped.append(self.NAME)

    class Stuck(ServicePart):
        NAME = "stuck"

        def stop(self, within_s: float = 0.0) -> None:
            for_ever.wait()

    assert stop_in_turn([Named("first"), Stuck(), Named("last")], Deadline()) == ["stuck"]
    assert stopped == ["last", "first"]
    assert names(caplog) == [Event.PART_LATE]
    for_ever.set()


def test_a_held_lock_of_the_learner_does_not_keep_the_stop_from_the_pipeline(config: Path) -> None:
    """The window under way and all that was heard reach the disk first."""
    settings = load_settings(config)
    gateways: list[gateway.Gateway] = []

    def on_started(running: gateway.Gateway) -> None:
        gateways.append(running)
        running.learner._book.lock.acquire()  # by this thread, and never given back
        running.request_stop()

    begun_s = time.monotonic()
    gateway.Gateway(settings, setup_of(settings), on_started=on_started).run()
    assert time.monotonic() - begun_s < PATIENCE_S
    assert not gateways[0].pipeline.is_alive()
    assert not gateways[0].store.is_alive()


def test_a_question_of_a_client_that_hangs_does_not_keep_the_process_from_ending(config: Path) -> None:
    """Every thread of the loop's pool was waited for, however long: systemd had to kill it."""

    def ask(url: str) -> None:
        with pytest.raises(httpx.ReadTimeout):
            httpx.get(f"{url}/api/v1/learning", timeout=1.0, trust_env=False)

    told_until_stopped("held_service", config, ask)
