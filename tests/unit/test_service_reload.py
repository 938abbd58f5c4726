"""A reload applies what can change live, names what waits for a restart, and survives every mistake."""

import asyncio
import logging
import os
import signal
import socket
import ssl
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import httpx
import numpy as np
import pytest
import trustme
import uvicorn
from support.calibrated import calibration_file
from support.commissioning import Bench, in_steps, learned
from support.half_car_road import as_if_fitted
from support.patience import PATIENCE_S
from support.signing import Signer
from support.web import Gateway, Server, serving

from gateway.calibration.commissioning.job import Result
from gateway.config import Settings, load_settings
from gateway.core.cross_spectrum.model.parameters import PARAMETERS
from gateway.errors import ConfigurationError
from gateway.log import LOGGER, set_log_level
from gateway.notify import Notifier
from gateway.service import lifecycle as life
from gateway.service.calibration_in_use import commissioned, with_commissioned
from gateway.service.gateway import Gateway as Service
from gateway.service.reload import Reloader, changed_keys, tls_of
from gateway.setup import setup_of
from gateway.web.access.serving import server_config

PLAIN = 'signals = "springscale:reference"\n'
TLS = PLAIN + '[web]\ntls_certificate = "web.pem"\ntls_key = "web.key"\n'


def settings_of(folder: Path, text: str) -> Settings:
    (folder / "springscale.toml").write_text(text)
    return load_settings(folder / "springscale.toml")


def issue(folder: Path) -> trustme.CA:
    """A new certificate of a new authority in the files that TLS names."""
    authority = trustme.CA()
    made = authority.issue_cert("127.0.0.1")
    made.private_key_pem.write_to_path(folder / "web.key")
    made.cert_chain_pems[0].write_to_path(folder / "web.pem")
    return authority


def trusts(authority: trustme.CA, server: Server) -> bool:
    """Whether a client that knows only this authority accepts the server now."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    authority.configure_trust(context)
    address = server.socket.getsockname()
    try:
        with (
            socket.create_connection(address, timeout=PATIENCE_S) as plain,
            context.wrap_socket(plain, server_hostname="127.0.0.1"),
        ):
            return True
    except ssl.SSLCertVerificationError:
        return False


@pytest.fixture
def secure(tmp_path: Path) -> Iterator[tuple[trustme.CA, Server, Reloader]]:
    """A server with a certificate, and the reloader of its settings."""
    authority = issue(tmp_path)
    settings = settings_of(tmp_path, TLS)
    with Gateway(tmp_path) as gateway:
        config = server_config(gateway.app, "127.0.0.1", 0, tls_of(settings))
        with serving(gateway.app, config) as server:
            yield authority, server, Reloader(settings, lambda: load_settings(tmp_path / "springscale.toml"), config)


def test_a_renewed_certificate_is_shown_from_the_next_connection_on(
    secure: tuple[trustme.CA, Server, Reloader], tmp_path: Path
) -> None:
    old, server, reload = secure
    assert trusts(old, server)
    new = issue(tmp_path)
    assert not trusts(new, server)
    assert reload()
    assert trusts(new, server)
    assert not trusts(old, server)


@pytest.mark.parametrize("broken", ["web.key", "web.pem", "springscale.toml"])
def test_a_file_that_cannot_be_used_changes_nothing(
    broken: str, secure: tuple[trustme.CA, Server, Reloader], tmp_path: Path
) -> None:
    old, server, reload = secure
    issue(tmp_path)
    (tmp_path / broken).write_text("[nonsense")
    assert not reload()
    assert trusts(old, server)


def test_a_key_that_does_not_fit_changes_nothing(secure: tuple[trustme.CA, Server, Reloader], tmp_path: Path) -> None:
    old, server, reload = secure
    certificate = (tmp_path / "web.pem").read_bytes()
    issue(tmp_path)
    (tmp_path / "web.pem").write_bytes(certificate)
    assert not reload()
    assert trusts(old, server)


def reloaded(folder: Path, before: str, after: str, caplog: pytest.LogCaptureFixture) -> list[str]:
    """What a reload says waits for a restart."""
    if "tls" in before + after:
        issue(folder)
    settings = settings_of(folder, before)
    with Gateway(folder) as gateway:
        config = server_config(gateway.app, "127.0.0.1", 0, tls_of(settings))
        set_log_level("info")
        assert Reloader(settings, lambda: settings_of(folder, after), config)()
    return caplog.records[-1].fields["waits_for_restart"]


def test_the_log_level_changes_at_once(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    assert reloaded(tmp_path, PLAIN, PLAIN + '[log]\nlevel = "warning"\n', caplog) == []
    assert LOGGER.level == logging.WARNING


@pytest.mark.parametrize(
    ("before", "after", "waiting"),
    [
        (PLAIN, PLAIN + '[bus]\nchannel = "can1"\n', ["bus.channel"]),
        (PLAIN, 'calibration = "other.json"\n' + PLAIN, ["calibration"]),
        (PLAIN, TLS, ["web.tls_certificate", "web.tls_key"]),
        (TLS, PLAIN, ["web.tls_certificate", "web.tls_key"]),
        (PLAIN, PLAIN, []),
    ],
)
def test_what_cannot_change_live_is_named(
    before: str, after: str, waiting: list[str], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    assert reloaded(tmp_path, before, after, caplog) == waiting


def test_changed_keys_name_table_and_key(tmp_path: Path) -> None:
    one = settings_of(tmp_path, PLAIN)
    other = settings_of(tmp_path, PLAIN + '[vehicle]\nid = "van-17"\n[bus]\noptions = { bitrate = 5 }\n')
    assert changed_keys(one, other) == ["bus.options.bitrate", "vehicle.id"]


@pytest.mark.parametrize("half", ['tls_certificate = "a"', 'tls_key = "a"', 'tls_client_ca = "a"'])
def test_half_of_a_tls_configuration_is_refused(half: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="web: tls_"):
        settings_of(tmp_path, PLAIN + f"[web]\n{half}\n")


def test_tls_files_are_found_beside_the_configuration(tmp_path: Path) -> None:
    tls = tls_of(settings_of(tmp_path, TLS))
    assert (tls.certificate, tls.key, tls.client_ca) == (tmp_path / "web.pem", tmp_path / "web.key", None)


def test_systemd_is_told_when_a_reload_begins(tmp_path: Path) -> None:
    address = str(tmp_path / "notify")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(address)
        notifier = Notifier({"NOTIFY_SOCKET": address})
        notifier.send_reloading()
        told = dict(line.split("=") for line in listener.recv(4096).decode().split("\n"))
        notifier.close()
    assert told["RELOADING"] == "1"
    assert int(told["MONOTONIC_USEC"]) > 0


def with_half_car() -> Result:
    """A fit as a commissioning makes it; what the half-car's parameters are is no matter here."""
    part = as_if_fitted(np.zeros(len(PARAMETERS)), np.ones(len(PARAMETERS)))
    file = calibration_file().model_copy(update={"cross_spectrum": part})
    return Result(learned=learned(15.0), calibration=file.to_json(), calibration_id=file.id)


def test_a_reload_believes_the_calibration_made_on_the_vehicle_as_the_start_does(tmp_path: Path) -> None:
    """It asked for a signature that nobody could give, and warned of it until the restart."""
    bench = Bench(tmp_path)
    in_steps(bench)
    for n in range(2):
        bench.drive(n)
    bench.worker.finish(with_half_car())
    settings = Settings(
        signals="springscale:reference",
        store={"directory": bench.directory},
        trust={"public_keys": [Signer("fitter").public_line]},
        commissioning={"is_unsigned_believed": True},
    )
    chosen, setup, fault = commissioned(settings)
    assert setup.calibration is not None
    assert fault is None
    reload = Reloader(chosen, lambda: with_commissioned(settings), uvicorn.Config("no:app"), setup)
    assert reload()
    assert reload.fault is None


def test_a_reload_asks_for_the_signature_of_every_other_calibration(tmp_path: Path) -> None:
    path = tmp_path / "vehicle.json"
    path.write_text(calibration_file().to_json())
    named = {"signals": "springscale:reference", "calibration": path, "estimator": "ratio_index"}
    before = Settings(**named, store={"directory": tmp_path})
    after = Settings(
        **named,
        store={"directory": tmp_path},
        trust={"public_keys": [Signer("fitter").public_line]},
        commissioning={"is_unsigned_believed": True},
    )
    reload = Reloader(before, lambda: with_commissioned(after), uvicorn.Config("no:app"), setup_of(before))
    assert not reload()
    assert "vehicle.json" in str(reload.fault)


def test_a_reload_that_takes_long_keeps_nobody_waiting(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Databases and calibrations were read in the event loop, which answered nobody meanwhile."""
    settings = settings_of(
        tmp_path, PLAIN + f'[bus]\ninterface = "virtual"\nchannel = "{tmp_path.name}"\n[web]\nport = 0\n'
    ).model_copy(deep=True)
    reading, has_read = threading.Event(), threading.Event()
    answered: list[int] = []

    def load() -> Settings:
        reading.set()
        assert has_read.wait(PATIENCE_S)
        return settings

    def on_started(service: Service) -> None:
        loop = asyncio.get_running_loop()

        def ask() -> None:
            os.kill(os.getpid(), signal.SIGHUP)
            assert reading.wait(PATIENCE_S)
            answered.append(httpx.get(f"{service.url}/health/live", trust_env=False).status_code)
            has_read.set()
            loop.call_soon_threadsafe(service.request_stop)

        threading.Thread(target=ask, daemon=True).start()

    monkeypatch.chdir(tmp_path)
    service = Service(settings, setup_of(settings), load=load, on_started=on_started)
    service.run()
    assert answered == [200]


def test_who_is_to_start_anew_under_systemd_leaves_with_the_code_that_the_unit_knows(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
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
