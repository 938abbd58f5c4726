"""Serving the application with uvicorn: address, TLS, limits and shutdown.

uvicorn limits the connections, the head of a request and the pause between two requests; a service that strangers can
reach stands behind a reverse proxy, which limits each of them (deploy/Caddyfile).
"""

import asyncio
import contextlib
import logging
import socket
import ssl
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import uvicorn
from starlette.types import ASGIApp

from gateway.config.permission import Holder, Kind, encryption_to, is_loopback, may_leave
from gateway.errors import ConfigurationError
from gateway.log import Event, log_event
from gateway.part import FIRST_PAUSE_S, LAST_PAUSE_S, BackOff

CONNECTIONS: Final = 100  # chosen: of all clients together, streams among them; beyond them the answer is 503
HEAD_BYTES: Final = 32_768  # chosen: request line and headers
STOP_WITHIN_S: Final = 1  # chosen: for answers under way
UNREAD_MS: Final = 30_000  # chosen: a client that takes nothing for so long is closed
ANSWER_WITHIN_S: Final = 5.0  # chosen: for the service's own question


@dataclass(frozen=True, slots=True)
class Tls:
    """Certificate chain and key in PEM files."""

    certificate: Path
    key: Path


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


def server_config(app: ASGIApp, host: str, port: int, tls: Tls | None = None) -> uvicorn.Config:
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
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(tls.certificate, tls.key)
    except OSError as fault:  # ssl.SSLError is one
        raise ConfigurationError(f"[web] TLS files {tls.certificate}, {tls.key} cannot be used: {fault}") from None
    return {"ssl_certfile": tls.certificate, "ssl_keyfile": tls.key}


class _Server(uvicorn.Server):
    """uvicorn without its own signal handling, which would raise the signal again after stopping."""

    def __init__(self, config: uvicorn.Config) -> None:
        super().__init__(config)
        self.ending = asyncio.Event()

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Signals are the gateway's."""
        yield

    async def main_loop(self) -> None:
        """Until ``ending``. uvicorn's own wakes ten times a second, parked vehicle or not, to see whether it is to
        end.
        """
        await self.ending.wait()


class WebServer:
    """Serves the application until :meth:`end`; a server that dies begins anew after a pause. ``fault`` says why."""

    def __init__(self, config: uvicorn.Config) -> None:
        self._config = config
        self._server = _Server(config)
        self._ending = asyncio.Event()
        self._own: tuple[str, int] = ("", 0)  # where this machine can ask, whatever the address of the settings
        self.port = 0
        self.fault: str | None = None

    @property
    def is_started(self) -> bool:
        return bool(self._server.started)

    def loop_factory(self) -> Callable[[], asyncio.AbstractEventLoop] | None:
        """How uvicorn makes its event loop."""
        return self._config.get_loop_factory()

    @property
    def scheme(self) -> str:
        return "https" if self._config.is_ssl else "http"

    async def serve(self) -> None:
        """Returns after :meth:`end`, and at once if not even the first server can start."""
        back_off = BackOff(FIRST_PAUSE_S, LAST_PAUSE_S)
        while True:
            died = "it ended"
            try:
                await self._server.serve(self._listening())
            except SystemExit:  # uvicorn's way to say that the address cannot be used
                died = "its address cannot be used"
            except Exception as failure:  # noqa: BLE001 - weighing does not depend on it
                died = repr(failure)
            if self._ending.is_set() or not self.port:
                return
            if self.fault is None:
                log_event(Event.PART_FAILED, level=logging.ERROR, part="web server", failure=died)
            self.fault = f"the web server failed: {died}; weighing goes on"
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._ending.wait(), back_off.next_s())
                return
            self._server = _Server(self._config)

    def end(self) -> None:
        """Begin to shut down; from the event loop's thread."""
        self._server.should_exit = True
        self._server.ending.set()
        self._ending.set()

    async def is_answering(self) -> bool:
        """Whether a request to this very server is answered in time."""
        context = None
        if self._config.is_ssl:
            context = ssl.create_default_context()
            context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
        try:
            async with asyncio.timeout(ANSWER_WITHIN_S):
                reader, writer = await asyncio.open_connection(*self._own, ssl=context)
                with contextlib.closing(writer):
                    writer.write(b"GET /health/live HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n\r\n")
                    is_answered = bool(await reader.read(1))
        except OSError:  # a timeout is one
            is_answered = False
        if is_answered:
            self.fault = None
        return is_answered

    def _listening(self) -> list[socket.socket]:
        """At the address of the settings and, if that is not this machine's own, also at one that is. A client that
        takes nothing for a while is closed by the kernel. Raises SystemExit.
        """
        listening = [self._config.bind_socket()]
        host, port, *_ = listening[0].getsockname()
        self.port, self._own = port, (host, port)
        if not is_loopback(host):
            listening.append(socket.create_server(("127.0.0.1", 0)))
            self._own = listening[1].getsockname()
        for one in listening:
            one.set_inheritable(False)
            one.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, UNREAD_MS)  # connections inherit it
        return listening
