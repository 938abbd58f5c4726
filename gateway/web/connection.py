"""A connection that gives nobody more than a fair share of time, memory and places."""

import asyncio
from typing import Final

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

REQUEST_S: Final = 10.0  # from a connection's or a request's first byte to its last
HEAD_BYTES: Final = 32_768  # request line and headers
BODY_BYTES: Final = 65_536  # no route needs one
CONNECTIONS: Final = 512  # below the usual 1024 file descriptors of a process
CONNECTIONS_PER_ADDRESS: Final = 128


class GuardedConnection(HttpToolsProtocol):
    """uvicorn's HTTP/1.1 protocol with the limits it leaves out.

    A request that is not complete in time ends its connection (slow loris), a head or body that is too
    long as well, and a connection too many is closed before it costs anything. Answers under way,
    streams among them, may take as long as they like.
    """

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]  # as in uvicorn
        super().connection_made(transport)
        self._n_head_bytes = self._n_body_bytes = 0
        self._is_in_head = True
        self._deadline: asyncio.TimerHandle | None = self.loop.call_later(REQUEST_S, transport.abort)
        if len(self.connections) > CONNECTIONS or self._n_from_same_address() > CONNECTIONS_PER_ADDRESS:
            transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        self._disarm()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        if self._is_in_head:
            self._n_head_bytes += len(data)
        if self._n_head_bytes > HEAD_BYTES:
            self.send_400_response("the head of a request may not be longer than 32 KiB")
            return
        super().data_received(data)

    def on_message_begin(self) -> None:
        super().on_message_begin()
        self._is_in_head = True
        self._n_body_bytes = 0
        self._disarm()
        self._deadline = self.loop.call_later(REQUEST_S, self.transport.abort)

    def on_headers_complete(self) -> None:
        self._is_in_head = False
        self._n_head_bytes = 0
        super().on_headers_complete()

    def on_body(self, body: bytes) -> None:
        self._n_body_bytes += len(body)
        if self._n_body_bytes > BODY_BYTES:
            self.transport.abort()
            return
        super().on_body(body)

    def on_message_complete(self) -> None:
        self._disarm()
        self._is_in_head = True
        super().on_message_complete()

    def _n_from_same_address(self) -> int:
        mine = self.client and self.client[0]
        others = (other.client for other in self.connections if isinstance(other, GuardedConnection))
        return sum(client is not None and client[0] == mine for client in others)

    def _disarm(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None
