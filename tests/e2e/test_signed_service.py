"""The service where signatures are required: begins, keeps the last good calibration, refuses foreign settings."""

import json
import signal
import subprocess
import tomllib
from contextlib import AbstractContextManager
from pathlib import Path

import pytest
from support.calibrated import calibration_file
from support.configured import service_config
from support.patience import PATIENCE_S, wait_until
from support.ports import first_answer, free_port
from support.process import running_service
from support.signing import Signer

GARAGE, STRANGER = Signer("garage"), Signer("stranger")


@pytest.fixture
def config(tmp_path: Path) -> Path:
    """Settings and calibration, both signed by the garage, whose key lies elsewhere."""
    (tmp_path / "trusted.pub").write_text(GARAGE.public_line)
    path = service_config(tmp_path, calibration_file().to_json(), estimator="ratio_index", web__port=free_port())
    GARAGE.sign(path, tmp_path / "vehicle.json")
    return path


def trusting_service(config: Path) -> AbstractContextManager["subprocess.Popen[str]"]:
    return running_service(config, "--trusted-keys", str(config.parent / "trusted.pub"))


def status_of(config: Path) -> dict[str, object]:
    port = tomllib.loads(config.read_text())["web"]["port"]
    return first_answer(f"http://127.0.0.1:{port}/api/v1/status").json()


def test_a_calibration_that_nobody_trusted_signed_is_told_and_the_last_good_one_weighs_on(config: Path) -> None:
    """At a reload and at the next start; signed again, all is well."""
    calibration, good = config.parent / "vehicle.json", calibration_file()
    with trusting_service(config) as process:
        assert status_of(config)["calibration_id"] == good.id
        assert status_of(config)["warnings"] == []
        calibration.write_text(calibration_file(payload_kg=12.0).to_json())
        STRANGER.sign(calibration)
        process.send_signal(signal.SIGHUP)
        assert wait_until(lambda: STRANGER.public.fingerprint in str(status_of(config)["warnings"]))
        assert status_of(config)["calibration_id"] == good.id
        process.send_signal(signal.SIGTERM)
        _, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0, errors
    with trusting_service(config) as process:
        status = status_of(config)
        assert status["calibration_id"] == good.id
        assert "last good copy" in str(status["warnings"])
        GARAGE.sign(calibration)
        process.send_signal(signal.SIGHUP)
        assert wait_until(lambda: status_of(config)["warnings"] == [])


@pytest.mark.parametrize("spoilt", ["springscale.toml", "vehicle.json"])
def test_without_a_good_signature_nothing_begins(spoilt: str, config: Path) -> None:
    """Exit code 2, which systemd does not try again, and a line that says how to mend it."""
    (config.parent / f"{spoilt}.sig").unlink()
    with trusting_service(config) as process:
        _, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 2
    assert "Traceback" not in errors
    assert f"{spoilt}: not signed" in errors
    assert f"ssh-keygen -Y sign -n springscale -f KEY {spoilt}" in errors


def test_settings_changed_by_a_stranger_are_refused_at_a_reload_and_all_stays(config: Path) -> None:
    with trusting_service(config) as process:
        status_of(config)
        config.write_text(config.read_text() + '[log]\nlevel = "error"\n')
        STRANGER.sign(config)
        process.send_signal(signal.SIGHUP)
        assert process.stderr is not None
        told = next(json.loads(line) for line in process.stderr if "reload" in line)
        assert told["event"] == "reload refused"
        assert STRANGER.public.fingerprint in told["fault"]
        assert status_of(config)["calibration_id"] == calibration_file().id
