"""What deploy/ ships fits the program that it configures."""

import os
import re
import shutil
import subprocess
from dataclasses import fields
from pathlib import Path

import pytest
from support.patience import PATIENCE_S

from gateway.config import load_settings
from gateway.core.weights.limits import Limits
from gateway.web.access.tokens import Scope, TokenFile

DEPLOY = Path(__file__).parents[2] / "deploy"
UNIT = (DEPLOY / "springscale.service").read_text()
COMMENTED_KEY = re.compile(r"^# (?=[a-z_]+ = )", re.MULTILINE)


def test_the_shipped_configuration_is_good_as_it_is() -> None:
    settings = load_settings(DEPLOY / "springscale.toml")
    assert settings.bus.interface == "socketcan"
    assert settings.store.directory == Path("/var/lib/springscale")


def test_every_commented_key_of_the_shipped_configuration_is_a_setting(tmp_path: Path) -> None:
    text, n_keys = COMMENTED_KEY.subn("", (DEPLOY / "springscale.toml").read_text())
    assert n_keys > 10
    (tmp_path / "springscale.toml").write_text(text)
    settings = load_settings(tmp_path / "springscale.toml")
    assert settings.web.tls_key == tmp_path / "web.key"


def test_defaults_that_the_shipped_configuration_tells_are_the_defaults(tmp_path: Path) -> None:
    examples = [
        "calibration",
        "calibrated_as",
        "vin",
        "tls_certificate",
        "tls_key",
        "interface",  # of another bus
        "channel",
        "source_address",
        "url",
        "secret_file",
        *(one.name for one in fields(Limits)),
    ]
    kept = [
        line
        for line in (DEPLOY / "springscale.toml").read_text().splitlines()
        if not line.startswith(tuple(f"# {key} =" for key in examples))
    ]
    (tmp_path / "springscale.toml").write_text("\n".join(kept))
    as_shipped = load_settings(tmp_path / "springscale.toml")
    (tmp_path / "springscale.toml").write_text(COMMENTED_KEY.sub("", "\n".join(kept)))
    assert load_settings(tmp_path / "springscale.toml") == as_shipped


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="systemd is not installed here")
def test_the_sandbox_scores_below_one_and_a_half_and_what_remains_is_explained() -> None:
    report = subprocess.run(
        ["systemd-analyze", "security", "--no-pager", "--offline=true", str(DEPLOY / "springscale.service")],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=True,
    ).stdout
    score = re.search(r"exposure level for springscale.service: ([\d.]+)", report)
    assert score is not None
    assert float(score[1]) <= 1.5
    explained = UNIT.partition("still counts, and why it stays:")[2]
    remaining = re.findall(r"^✗ (?:RootDirectory|\w+)", report, re.MULTILINE)
    assert remaining
    assert [name for name in remaining if name.removeprefix("✗ ") not in explained] == []


def test_a_configuration_fault_is_not_tried_again() -> None:
    assert "\nRestartPreventExitStatus=2\n" in UNIT


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a file away")
def test_a_token_made_by_root_can_be_read_by_the_service(tmp_path: Path) -> None:
    os.chown(tmp_path, 12345, 12346)
    TokenFile(tmp_path / "tokens.json").create("fleet", Scope.READ)
    made = (tmp_path / "tokens.json").stat()
    assert (made.st_uid, made.st_gid, made.st_mode & 0o777) == (12345, 12346, 0o600)
