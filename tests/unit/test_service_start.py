"""The start of the service: what its TLS settings say, and how it begins anew with another calibration."""

import socket
import sys
from pathlib import Path

import pytest
from fastapi import FastAPI
from support.patience import wait_until

from gateway.config import Settings, load_settings
from gateway.errors import ConfigurationError
from gateway.service import lifecycle as life
from gateway.service.parts import tls_of
from gateway.web.access.serving import WebServer, server_config

PLAIN = 'signals = "springscale:reference"\n'
TLS = PLAIN + '[web]\ntls_certificate = "web.pem"\ntls_key = "web.key"\n'


def settings_of(folder: Path, text: str) -> Settings:
    (folder / "springscale.toml").write_text(text)
    return load_settings(folder / "springscale.toml")


def test_a_port_that_is_taken_is_told_with_what_to_do() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        server = WebServer(server_config(FastAPI(), "127.0.0.1", port, None))
        server.start()
        assert wait_until(lambda: server.death() is not None)
        told = server.death()
        server.stop()
    assert told is not None
    assert told.startswith(f"could not run on 127.0.0.1:{port}: ")
    assert told.endswith("stop what listens there, or set another [web] host or port")


@pytest.mark.parametrize("half", ['tls_certificate = "a"', 'tls_key = "a"'])
def test_half_of_a_tls_configuration_is_refused(half: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="web: tls_"):
        settings_of(tmp_path, PLAIN + f"[web]\n{half}\n")


def test_tls_files_are_found_beside_the_configuration(tmp_path: Path) -> None:
    tls = tls_of(settings_of(tmp_path, TLS))
    assert (tls.certificate, tls.key) == (tmp_path / "web.pem", tmp_path / "web.key")


def test_a_restart_under_systemd_uses_the_exit_code_of_the_unit(monkeypatch: pytest.MonkeyPatch) -> None:
    """A service that began anew inside its process had to clear private caches of FastAPI."""
    unit = (Path(__file__).parents[2] / "deploy/springscale.service").read_text()
    assert f"RestartForceExitStatus={life.RESTART_CODE}\n" in unit
    assert f"SuccessExitStatus={life.RESTART_CODE}\n" in unit
    monkeypatch.setenv("NOTIFY_SOCKET", "/run/nobody")
    with pytest.raises(SystemExit) as leaving:
        life.restart()
    assert leaving.value.code == life.RESTART_CODE
    monkeypatch.delenv("NOTIFY_SOCKET")
    called: list[list[str]] = []
    monkeypatch.setattr(life.os, "execv", lambda path, arguments: called.append(arguments))
    life.restart()
    assert called == [[sys.executable, *sys.orig_argv[1:]]]
