"""The ring log of a real service: what it recorded is weighed as it was live, byte for byte."""

import json
import sys
from pathlib import Path

import pytest
from support.bus_drive import START_NS, white_noise
from support.calibrated import calibration_file
from support.commands import ended
from support.patience import wait_until
from support.ports import first_answer
from support.running_service import Running, configuration, counted, estimated, serve, stored

from gateway.bus.logs import write_candump

RECORD = """
[record]
enabled = true
free_mb = 0.0
"""


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "drive.log"
    write_candump(white_noise(65.0, START_NS + 123_000, seed=3), "can0", path)
    return path


def config_of(tmp_path: Path, more: str = RECORD) -> Path:
    return configuration(tmp_path, calibration_file(payload_kg=12.0, front_share_pct=51.0).to_json(), more)


def test_what_was_recorded_is_weighed_as_it_was_live(tmp_path: Path, log: Path) -> None:
    config = config_of(tmp_path)

    def play(service: Running) -> None:
        service.play(log)
        written = service.gateway.ring_log
        assert wait_until(lambda: not written.status().n_frames_held)
        status = first_answer(f"{service.gateway.url}/api/v1/status").json()
        assert status["record"]["n_frames_written"] == service.gateway.pipeline.n_frames
        assert not [warning for warning in status["warnings"] if "recorded" in warning]
        metrics = first_answer(f"{service.gateway.url}/metrics").text
        assert f"springscale_record_n_frames_written {service.gateway.pipeline.n_frames}.0" in metrics

    serve(config, play)
    kept = tmp_path / "state" / "record" / "00000001.log"
    live = stored(config)
    assert len(counted(live)) == 3
    assert estimated(config, kept)[:3] == live[:3]
    assert estimated(config, kept) == estimated(config, log)


def test_recording_is_off_by_default(tmp_path: Path, log: Path) -> None:
    def meet(service: Running) -> None:
        service.play(log)
        assert first_answer(f"{service.gateway.url}/api/v1/status").json()["record"] is None

    serve(config_of(tmp_path, ""), meet)
    assert not (tmp_path / "state" / "record").exists()


def test_a_disk_that_takes_no_frames_costs_no_estimate(tmp_path: Path, log: Path) -> None:
    (tmp_path / "state").mkdir()
    (tmp_path / "state" / "record").write_text("no folder can be made here, not even by root")

    def meet(service: Running) -> None:
        service.play(log)
        ring = service.gateway.ring_log
        assert wait_until(lambda: ring.status().last_fault is not None)
        told = first_answer(f"{service.gateway.url}/api/v1/status").json()
        assert any("frames are not being recorded" in one for one in told["warnings"])
        assert told["is_ready"] is True

    config = config_of(tmp_path)
    serve(config, meet)
    assert stored(config)[:3] == estimated(config, log)[:3]
    assert len(counted(stored(config))) == 3


def test_a_full_disk_is_reported_and_recording_resumes(tmp_path: Path) -> None:
    run = ended(sys.executable, "-c", FULL, tmp_path, check=False, cwd=Path(__file__).parents[1])
    assert run.returncode == 0, run.stderr
    told = json.loads(run.stdout)
    assert "File too large" in told["fault"]
    assert told["n_written"] == 2 * told["n_put"]
    assert told["n_dropped"] == told["n_put"]
    assert 2 * told["n_put"] <= told["n_read"] < 3 * told["n_put"]


FULL = f"""
import json, pathlib, resource, signal, sys
from gateway.bus.logs import open_whole_log
from gateway.bus.ring_log import RingLog
from support.bus_drive import white_noise
from support.patience import wait_until

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
drive = white_noise(20.0, {START_NS}, seed=1)
folder = pathlib.Path(sys.argv[1])
log = RingLog(folder, "can0", 10**9, 0, write_s=0.01)
log.start()
log.put(drive)
assert wait_until(lambda: log.status().n_frames_written)
_, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
resource.setrlimit(resource.RLIMIT_FSIZE, (log.status().size_bytes + 1000, hard))  # what comes next is cut short
log.put(drive)
assert wait_until(lambda: log.status().last_fault is not None)
fault = log.status().last_fault
resource.setrlimit(resource.RLIMIT_FSIZE, (hard, hard))
log.put(drive)
assert wait_until(lambda: log.status().last_fault is None)
log.stop(60.0)
told = log.status()
n_read = sum(sum(map(len, open_whole_log(path)[0])) for path in folder.glob("*.log"))
counts = {{"n_written": told.n_frames_written, "n_dropped": told.n_frames_dropped, "n_read": n_read}}
print(json.dumps({{"fault": fault, "n_put": len(drive), **counts}}))
"""
