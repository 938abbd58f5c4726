"""Serving the application with uvicorn: address, TLS, limits and shutdown.

uvicorn limits the connections, the head of a request and the pause between two requests; a service that strangers can
reach stands behind a reverse proxy, which limits each of them (deploy/Caddyfile).
"""

import asyncio
import contextlib
import ssl
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import uvicorn
from fastapi import FastAPI

from gateway.errors import ConfigurationError
from gateway.permission import Holder, Kind, encryption_to, may_leave

CONNECTIONS: Final = 100  # chosen: of all clients together, streams among them; beyond them the answer is 503
HEAD_BYTES: Final = 32_768  # chosen: request line and headers
STOP_WITHIN_S: Final = 1  # chosen: for answers under way


@dataclass(frozen=True, slots=True)
class Tls:
    """Certificate chain and key in PEM files; ``client_ca`` requires clients to show a certificate signed by it
    (mTLS).
    """

    certificate: Path
    key: Path
    client_ca: Path | None = None


def refuse_open_address(host: str, *, has_tokens: bool, has_tls: bool) -> None:
    """Raise ConfigurationError if machines other than this one could ask without a token, or read along."""
    wanted = [] if has_tokens else ["a token (make one: `springscale token create NAME --config springscale.toml`)"]
    wanted += [] if has_tls else ["TLS (tls_certificate and tls_key)"]
    holder = Holder.READ if has_tokens else Holder.MACHINE
    if not may_leave(Kind.RECORD, encryption_to(host, has_tls=has_tls), holder):
        raise ConfigurationError(
            f"[web] host = {host!r} can be reached from elsewhere, and needs {' and '.join(wanted)}; or set "
            'host = "127.0.0.1" and put a reverse proxy in front (deploy/Caddyfile)'
        )


def server_config(app: FastAPI, host: str, port: int, tls: Tls | None = None) -> uvicorn.Config:
    """uvicorn's settings for a gateway. Raises ConfigurationError for TLS files that cannot be used."""
    return uvicorn.Config(
        app,
        host=host,
        port=port,
        loop="uvloop",
        http="h11",  # which bounds the head of a request; httptools does not
        ws="none",
        lifespan="on",
        access_log=False,  # for privacy; /metrics counts the answers
        log_config=None,
        log_level="error",  # uvicorn warns of each request it cannot read: strangers could fill the log with them
        server_header=False,
        date_header=False,  # the answers' own layer writes it: uvicorn would wake once a second for it
        proxy_headers=False,  # the address of a client is the one it has, not the one it claims
        limit_concurrency=CONNECTIONS,
        h11_max_incomplete_event_size=HEAD_BYTES,
        timeout_keep_alive=30,
        timeout_graceful_shutdown=STOP_WITHIN_S,
        **({} if tls is None else _tls_settings(tls)),
    )


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


class WebServer(uvicorn.Server):
    """uvicorn without its own signal handling, which would raise the signal again after stopping."""

    def __init__(self, config: uvicorn.Config) -> None:
        super().__init__(config)
        self._ending = asyncio.Event()

    def end(self) -> None:
        """Begin to shut down; from the event loop's thread."""
        self.should_exit = True
        self._ending.set()

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Signals are the gateway's."""
        yield

    async def main_loop(self) -> None:
        """Until :meth:`end`. uvicorn's own wakes ten times a second, parked vehicle or not, to see whether it is to
        end.
        """
        await self._ending.wait()
