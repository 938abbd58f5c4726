"""How the application is served: address, TLS, limits; never openly without tokens."""

import ssl
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import uvicorn
from fastapi import FastAPI

from gateway.errors import ConfigurationError
from gateway.web.door.connection import GuardedConnection
from gateway.web.door.guard import is_loopback
from gateway.web.door.tls import TlsConfig, TlsDoor

STOP_WITHIN_S: Final = 1  # for answers under way


@dataclass(frozen=True, slots=True)
class Tls:
    """Certificate chain and key in PEM files; ``client_ca`` requires clients to show a certificate signed by it
    (mTLS).
    """

    certificate: Path
    key: Path
    client_ca: Path | None = None


def refuse_open_address(host: str, *, has_tokens: bool) -> None:
    """Raise ConfigurationError if machines other than this one could ask without a token."""
    if not has_tokens and not is_loopback(host):
        raise ConfigurationError(
            f"[web] host = {host!r} can be reached from elsewhere, and there is no token: "
            'make one with `springscale token create NAME --config springscale.toml`, or set host = "127.0.0.1"'
        )


def server_config(app: FastAPI, host: str, port: int, tls: Tls | None = None) -> uvicorn.Config:
    """uvicorn's settings for a gateway. Raises ConfigurationError for TLS files that cannot be used."""
    kind = uvicorn.Config if tls is None else TlsConfig
    return kind(
        app,
        host=host,
        port=port,
        loop="uvloop",
        http=GuardedConnection if tls is None else TlsDoor,
        ws="none",
        lifespan="on",
        access_log=False,  # paths and addresses are nobody's business; /metrics counts the answers
        log_config=None,
        server_header=False,
        proxy_headers=False,  # the address of a client is the one it has, not the one it claims
        timeout_keep_alive=30,
        timeout_graceful_shutdown=STOP_WITHIN_S,
        **({} if tls is None else _tls_settings(tls)),
    )


def renew_certificate(config: uvicorn.Config, tls: Tls) -> None:
    """Use the files' present certificate and key for new connections; open ones keep theirs.

    Raises ConfigurationError, and changes nothing, for unusable files. Trusted client authorities stay as they are: a
    context can add authorities, never remove one.
    """
    _tls_settings(tls)  # tried elsewhere first: a key that does not fit would leave the context half changed
    if isinstance(config, TlsConfig):
        config.context.load_cert_chain(tls.certificate, tls.key)


def _tls_settings(tls: Tls) -> dict[str, Any]:
    """Checked here, so that a wrong file gives a clear line at the start and not a traceback."""
    try:
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(tls.certificate, tls.key)
        if tls.client_ca is not None:
            context.load_verify_locations(tls.client_ca)
    except OSError as fault:  # ssl.SSLError is one
        names = ", ".join(str(path) for path in (tls.certificate, tls.key, tls.client_ca) if path is not None)
        raise ConfigurationError(f"[web] TLS files {names} cannot be used: {fault}") from None
    wanted = {"ssl_certfile": tls.certificate, "ssl_keyfile": tls.key}
    if tls.client_ca is None:
        return wanted
    return wanted | {"ssl_ca_certs": str(tls.client_ca), "ssl_cert_reqs": ssl.CERT_REQUIRED}
