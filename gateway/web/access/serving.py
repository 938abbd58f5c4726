"""Serving the application with uvicorn: address, connections with limits, TLS with limited handshakes, and shutdown.

Each client gets a fair share of time, memory and connections. Without tokens it only listens on a loopback address.
"""

import asyncio
import contextlib
import logging
import ssl
import time
from collections.abc import Iterator, Set
from dataclasses import dataclass
from email.utils import formatdate
from functools import lru_cache
from http import HTTPStatus
from pathlib import Path
from typing import Any, Final, cast

import uvicorn
from fastapi import FastAPI
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol
from uvicorn.protocols.utils import get_remote_addr

from gateway.errors import ConfigurationError
from gateway.web.access.guard import is_loopback
from gateway.web.access.middleware import ANSWERS_PER_CLIENT, NO_STORE, SECURITY_HEADERS, STREAMS_PER_CLIENT
from gateway.web.access.problems import problem_response

REQUEST_S: Final = 10.0  # chosen: from a connection's or a request's first byte to its last
HEAD_BYTES: Final = 32_768  # chosen: request line and headers
BODY_BYTES: Final = 32_768  # chosen: no route needs a tenth of it
UPLOADS: Final = frozenset({b"/api/v1/calibration/commissioning/lines"})  # but this one: whole files come
UPLOAD_BYTES: Final = 1_572_864  # chosen: of JSON, in which a file's line ends and quotes take two bytes
LINGER_S: Final = 1.0  # chosen: for a refused client to read why; closed at once, unread bytes would reset the answer
UNREAD_S: Final = 20.0  # chosen: a client that has read nothing for so long is disconnected
UNREAD_BYTES: Final = 16_384  # chosen: that wait for one client before the answer itself has to
CONNECTIONS: Final = 256  # chosen: some are left where four addresses have all that one may have
CONNECTIONS_PER_ADDRESS: Final = ANSWERS_PER_CLIENT + STREAMS_PER_CLIENT

_log = logging.getLogger(__name__)
_log.setLevel(logging.ERROR)  # uvicorn warns of each request it cannot read: strangers could fill the log with them


class GuardedConnection(HttpToolsProtocol):
    """uvicorn's HTTP/1.1 protocol with the limits it leaves out.

    A request that is not complete in time ends its connection (slow loris). A head or body that is too long, and
    anything that is not HTTP, is answered with a problem and ends the connection; surplus connections are closed before
    they cost anything. Answers in progress, streams among them, may take as long as they like, as long as the client
    reads them. If all places are taken, the oldest connection without a token and without a request or answer in
    progress is closed.

    Under TLS it is created before the handshake, and gets its connection after it (tls.TlsHandshake).
    """

    def __init__(self, *parts: Any, **named_parts: Any) -> None:
        super().__init__(*parts, **named_parts)
        self.logger = _log
        self.since_s = self.loop.time()
        self._deadline: asyncio.TimerHandle | None = None
        self._unread: asyncio.TimerHandle | None = None
        self._early = b""  # came with the end of the handshake

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]  # as in uvicorn
        super().connection_made(transport)
        transport.set_write_buffer_limits(UNREAD_BYTES)
        self._n_head_bytes = self._n_body_bytes = 0
        self._is_in_head = self._is_refused = False
        self._deadline = self.loop.call_later(REQUEST_S, transport.abort)
        if not has_slot(self, self.connections):
            transport.abort()
        elif self._early:
            self.data_received(self._early)

    def connection_lost(self, exc: Exception | None) -> None:
        self._disarm()
        self._await_reading(None)
        if self.transport is not None:
            super().connection_lost(exc)

    def pause_writing(self) -> None:
        super().pause_writing()
        self._await_reading(self.transport.get_write_buffer_size())

    def resume_writing(self) -> None:
        super().resume_writing()
        self._await_reading(None)

    @property
    def is_idle(self) -> bool:
        """True if no request is in progress, or the answer is not read, and no token was shown."""
        if self.scope is not None and "token_name" in self.scope.get("state", {}):
            return False
        return self.cycle is None or self.cycle.response_complete or self.flow.write_paused

    def data_received(self, data: bytes) -> None:
        if self.transport is None:
            self._early += data
            return
        if self._is_refused:
            return
        super().data_received(data)
        if self._is_in_head:
            self._n_head_bytes += len(data)
            self._refuse_long_head()

    def on_message_begin(self) -> None:
        super().on_message_begin()
        self._is_in_head = True
        self._n_head_bytes = self._n_body_bytes = 0
        self._disarm()
        self._deadline = self.loop.call_later(REQUEST_S, self.transport.abort)

    def on_headers_complete(self) -> None:
        self._is_in_head = False
        self._n_head_bytes = len(self.url) + sum(len(name) + len(text) for name, text in self.headers)
        self._refuse_long_head()
        if not self._is_refused:
            self.server_state.default_headers = _date_headers(int(time.time()))
            super().on_headers_complete()

    def on_body(self, body: bytes) -> None:
        self._n_body_bytes += len(body)
        most = UPLOAD_BYTES if self.url.partition(b"?")[0] in UPLOADS else BODY_BYTES
        if self._n_body_bytes > most and self.cycle.response_complete:
            self._hear_no_more()  # it was answered before its end
        elif self._n_body_bytes > most:
            self._refuse(413, f"the body of a request may not be longer than {most // 1024} KiB")
        if not self._is_refused:
            super().on_body(body)

    def on_message_complete(self) -> None:
        if not self._is_refused:
            self._disarm()
            super().on_message_complete()

    def send_400_response(self, msg: str) -> None:
        """uvicorn's answer to a request it cannot parse."""
        self._refuse(400, "this is not a valid HTTP request")

    def _refuse_long_head(self) -> None:
        if self._n_head_bytes > HEAD_BYTES:
            self._refuse(431, f"the head of a request may not be longer than {HEAD_BYTES // 1024} KiB")

    def _refuse(self, status: int, detail: str) -> None:
        """Answer once, unless the application has begun to, and close."""
        if self._is_refused:
            return
        self._hear_no_more()
        if self.cycle is not None and not self.cycle.response_complete:
            if self.cycle.response_started:
                self.transport.abort()  # no second answer into the first
                return
            self.cycle.disconnected = True  # the application's own answer comes too late
            self.cycle.message_event.set()
        self.transport.write(_on_the_wire(status, detail))
        if self.transport.can_write_eof():  # TLS cannot
            self.transport.write_eof()

    def _hear_no_more(self) -> None:
        self._is_refused = True
        self._disarm()
        self._deadline = self.loop.call_later(LINGER_S, self.transport.close)

    def _await_reading(self, n_unread: int | None) -> None:
        """Check again later: a client that has read nothing of ``n_unread`` bytes by then is cut off."""
        if self._unread is not None:
            self._unread.cancel()
        self._unread = None if n_unread is None else self.loop.call_later(UNREAD_S, self._cut_off_unless_read, n_unread)

    def _cut_off_unless_read(self, n_unread: int) -> None:
        left = self.transport.get_write_buffer_size()
        if left >= n_unread:
            self.transport.abort()
        else:
            self._await_reading(left)

    def _disarm(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None


def has_slot(newcomer: "GuardedConnection | TlsHandshake", connections: Set[Any]) -> bool:
    """Whether a connection that has just joined ``connections`` may stay; another may be closed for it.

    A connection whose handshake is under way occupies a place too.
    """
    mine = newcomer.client and newcomer.client[0]
    if sum(other.client is not None and other.client[0] == mine for other in connections) > CONNECTIONS_PER_ADDRESS:
        return False
    if len(connections) <= CONNECTIONS:
        return True
    idle = [other for other in connections if other is not newcomer and other.is_idle]
    if idle:
        min(idle, key=lambda other: other.since_s).transport.abort()
    return bool(idle)


@lru_cache(maxsize=1)
def _date_headers(unix_s: int) -> list[tuple[bytes, bytes]]:
    return [(b"date", formatdate(unix_s, usegmt=True).encode())]


def _on_the_wire(status: int, detail: str) -> bytes:
    """A whole answer without the application: problem details with the headers that all answers have."""
    problem = problem_response(status, detail)
    head = [*problem.raw_headers, *SECURITY_HEADERS, NO_STORE, (b"connection", b"close")]
    lines = [b"HTTP/1.1 %d %s" % (status, HTTPStatus(status).phrase.encode()), *(b": ".join(pair) for pair in head)]
    return b"\r\n".join(lines) + b"\r\n\r\n" + bytes(problem.body)


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


STOP_WITHIN_S: Final = 1  # chosen: for answers under way


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
        end and to set the Date of the answers; here each request sets it.
        """
        await self._ending.wait()
