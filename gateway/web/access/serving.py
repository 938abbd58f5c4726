"""Serving the application with uvicorn: address, TLS, limits and shutdown.

uvicorn limits the connections, the head of a request and the pause between two requests; a service that strangers can
reach stands behind a reverse proxy, which limits each of them (deploy/Caddyfile).
"""

import asyncio
import contextlib
import socket
import ssl
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import uvicorn
from starlette.types import ASGIApp

from gateway.config.permission import Holder, Kind, encryption_to, is_loopback, may_leave
from gateway.errors import ConfigurationError
from gateway.part import ThreadPart

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

    def end(self) -> None:
        """Begin to shut down; from the event loop's thread."""
        self.should_exit = True
        self.ending.set()

    async def main_loop(self) -> None:
        """Until ``ending``. uvicorn's own wakes ten times a second, parked vehicle or not, to see whether it is to
        end.
        """
        await self.ending.wait()


class Questions(ThreadPoolExecutor):
    """Threads for requests that may wait for a lock or a disk. A stop does not wait for them."""

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Abandon the requests that hang, because the event loop would wait for its executor forever."""
        super().shutdown(wait=False, cancel_futures=True)


class WebServer(ThreadPart):
    """Serves the application in a thread of its own. It is vital until it has started once."""

    NAME = "web server"

    def __init__(self, config: uvicorn.Config) -> None:
        super().__init__("web server")
        self.IS_VITAL = True
        self._config = config
        self._server: _Server | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._own: tuple[str, int] = ("", 0)  # where this machine can ask, whatever the address of the settings
        self.port = 0

    @property
    def is_started(self) -> bool:
        server = self._server
        return server is not None and server.started

    @property
    def scheme(self) -> str:
        return "https" if self._config.is_ssl else "http"

    def _work(self) -> None:
        listening = self._listening()
        with asyncio.Runner(loop_factory=self._config.get_loop_factory()) as runner:
            runner.run(self._serve(listening))
        if not self._stopping.is_set():
            raise RuntimeError("it ended")

    async def _serve(self, listening: list[socket.socket]) -> None:
        server, loop = _Server(self._config), asyncio.get_running_loop()
        self._server, self._loop = server, loop
        loop.set_default_executor(Questions(thread_name_prefix="question"))
        if self._stopping.is_set():  # whoever stops it has seen no loop yet
            server.end()
        try:
            await server.serve(listening)
        finally:
            self._server = None  # another may begin

    def stop(self, within_s: float = 2.0 * STOP_WITHIN_S) -> None:
        self._stopping.set()
        server, loop = self._server, self._loop
        if server is not None and loop is not None:
            with contextlib.suppress(RuntimeError):  # the loop is closed
                loop.call_soon_threadsafe(server.end)
        super().stop(within_s)

    def death(self) -> str | None:
        told = super().death()
        is_refused = told is not None and isinstance(self.failure, OSError)
        if not is_refused:
            return told
        advice = "stop what listens there, or set another [web] host or port"
        return f"could not run on {self._config.host}:{self._config.port}: {self.failure}; {advice}"

    def is_answering(self) -> bool:
        """Whether a request to this very server is answered in time."""
        try:
            with contextlib.ExitStack() as ends:
                asking = ends.enter_context(socket.create_connection(self._own, ANSWER_WITHIN_S))
                if self._config.is_ssl:
                    context = ssl.create_default_context()
                    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
                    asking = ends.enter_context(context.wrap_socket(asking))
                asking.sendall(b"GET /health/live HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n\r\n")
                is_answered = bool(asking.recv(1))
        except OSError:  # a timeout is one
            return False
        if is_answered:
            self._succeeded()
        return is_answered

    def _listening(self) -> list[socket.socket]:
        """At the address of the settings and, if that is not this machine's own, also at one that is. A client that
        takes nothing for a while is closed by the kernel. Raises OSError.
        """
        is_ipv6 = ":" in self._config.host
        listening = [
            socket.create_server(
                (self._config.host, self._config.port),
                family=socket.AF_INET6 if is_ipv6 else socket.AF_INET,
                dualstack_ipv6=is_ipv6 and socket.has_dualstack_ipv6(),
            )
        ]
        host, port, *_ = listening[0].getsockname()
        self.port, self._own, self.IS_VITAL = port, (host, port), False
        if not is_loopback(host):
            listening.append(socket.create_server(("127.0.0.1", 0)))
            self._own = listening[1].getsockname()
        for one in listening:
            one.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, UNREAD_MS)  # connections inherit it
        return listening
