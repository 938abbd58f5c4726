"""Serving the application with uvicorn: address, TLS with limited handshakes, and shutdown.

Without tokens it only listens on a loopback address.
"""

import asyncio
import contextlib
import ssl
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, cast

import uvicorn
from fastapi import FastAPI
from uvicorn.protocols.utils import get_remote_addr

from gateway.errors import ConfigurationError
from gateway.web.access.connection import REQUEST_S, GuardedConnection, has_slot
from gateway.web.access.guard import is_loopback


class TlsConfig(uvicorn.Config):
    """uvicorn's settings except for the handshake: TlsHandshake makes it, with ``context``."""

    context: ssl.SSLContext

    def load(self) -> None:
        """uvicorn then opens a plain socket; ``is_ssl`` stays as it is."""
        super().load()
        if self.ssl is not None:
            self.context, self.ssl = self.ssl, None


class TlsHandshake(asyncio.Protocol):
    """A connection from its first moment to the end of its handshake; GuardedConnection takes it from there."""

    is_idle = True

    def __init__(self, config: TlsConfig, server_state: Any, app_state: dict[str, Any], **_: Any) -> None:
        self._loop = asyncio.get_running_loop()
        self._context = config.context
        self._connection = GuardedConnection(config=config, server_state=server_state, app_state=app_state)
        self._connections = server_state.connections
        self._handshake: asyncio.Task[None] | None = None
        self.since_s = self._loop.time()
        self.client: tuple[str, int] | None = None
        self.transport: asyncio.Transport

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = cast(asyncio.Transport, transport)
        self.client = get_remote_addr(self.transport)
        self._connections.add(self)
        if has_slot(self, self._connections):
            self._handshake = self._loop.create_task(self._shake_hands())
        else:
            self.transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        self._connections.discard(self)

    def shutdown(self) -> None:
        """The server stops."""
        self.transport.abort()

    async def _shake_hands(self) -> None:
        try:
            encrypted = await self._loop.start_tls(
                self.transport, self._connection, self._context, server_side=True, ssl_handshake_timeout=REQUEST_S
            )
        except OSError:  # no TLS, too slow, or gone; ssl.SSLError and TimeoutError are such
            self.transport.abort()
            return
        finally:
            self._connections.discard(self)
        if encrypted is not None and not encrypted.is_closing():
            self._connection.connection_made(encrypted)


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
        http=GuardedConnection if tls is None else TlsHandshake,
        ws="none",
        lifespan="on",
        access_log=False,  # for privacy; /metrics counts the answers
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


TICK_S: Final = 1.0  # how often the Date of the answers is written anew


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
        """Until :meth:`end`. uvicorn's own looks ten times a second whether it is to end, parked vehicle or not."""
        while not await self.on_tick(0):  # 0: with what uvicorn does once a second
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._ending.wait(), TICK_S)
