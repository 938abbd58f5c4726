"""TLS whose handshakes occupy places, too: a silent stranger holds one for some seconds, not a file handle for ever."""

import asyncio
import ssl
from typing import Any, cast

import uvicorn
from uvicorn.protocols.utils import get_remote_addr

from gateway.web.door.connection import REQUEST_S, GuardedConnection, has_place


class TlsConfig(uvicorn.Config):
    """uvicorn's settings except for the handshake: TlsDoor makes it, with ``context``."""

    context: ssl.SSLContext

    def load(self) -> None:
        """uvicorn then opens a plain socket; ``is_ssl`` stays as it is."""
        super().load()
        if self.ssl is not None:
            self.context, self.ssl = self.ssl, None


class TlsDoor(asyncio.Protocol):
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
        if has_place(self, self._connections):
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
