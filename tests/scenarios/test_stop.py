"""SIGTERM ends the service with code 0 whatever its threads are doing."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from support.paper_van import paper_van_config
from support.patience import PATIENCE_S
from support.ports import first_answer, free_port

from gateway.bus.broadcast import broadcaster
from gateway.bus.live import source
from gateway.bus.ring import ring_log
from gateway.service import keeper, pipeline
from gateway.service.proving import trend_keeper
from gateway.store import writer
from gateway.uplink import forwarder
from gateway.web.door import serving

ROOT = Path(__file__).parents[2]


@pytest.fixture
def config(tmp_path: Path) -> Path:
    return paper_van_config(tmp_path, free_port())


def test_a_pipeline_that_does_not_end_is_left_behind_without_an_abort(config: Path) -> None:
    """Before, Python unwound it inside scipy's C++ at its own end: SIGABRT, and a core instead of an exit code."""
    port = re.search(r"port = (\d+)", config.read_text())
    assert port is not None
    with subprocess.Popen(
        [sys.executable, "-m", "support.stuck_service", "run", "--config", str(config)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        cwd=ROOT / "tests",
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    ) as process:
        try:
            first_answer(f"http://127.0.0.1:{port[1]}/health/live")
            process.send_signal(signal.SIGTERM)
            told, _ = process.communicate(timeout=PATIENCE_S)
        finally:
            process.kill()
    assert process.returncode == 0, told
    assert "pipeline did not finish in time" in told
    assert '"event": "stopped"' in told


def test_all_parts_together_may_take_no_longer_than_systemd_waits() -> None:
    unit = (ROOT / "deploy/springscale.service").read_text()
    systemd_waits_s = re.search(r"^TimeoutStopSec=(\d+)$", unit, re.MULTILINE)
    assert systemd_waits_s is not None
    parts = (source, pipeline, keeper, trend_keeper, ring_log, broadcaster, forwarder, forwarder, writer, serving)
    parts_take_s = sum(part.STOP_WITHIN_S for part in parts)  # uplink and webhook are both forwarders
    assert parts_take_s < float(systemd_waits_s[1])
