"""A broker of a few lines that refuses what the test chooses: packets over a limit, or by topic (MQTT 5)."""

import contextlib
import socket
import threading
from collections.abc import Callable
from types import TracebackType
from typing import BinaryIO, Literal

CONNECT, CONNACK, PUBLISH, PUBACK, DISCONNECT = 1, 2, 3, 4, 14
PACKET_TOO_LARGE, MAXIMUM_PACKET_SIZE = 0x95, 0x27

Refusal = Literal["puback", "disconnect", "close"]


class SmallBroker:
    """Acknowledges what is within ``most_bytes`` and keeps it in ``taken``, by topic.

    ``code_of`` gives the reason code of the acknowledgement by topic, None for no acknowledgement at all.
    """

    def __init__(
        self,
        most_bytes: int,
        refusal: Refusal,
        *,
        is_announced: bool = False,
        code_of: Callable[[str], int | None] = lambda topic: 0,
    ) -> None:
        self.code_of = code_of
        self._most_bytes = most_bytes
        self._refusal = refusal
        self._is_announced = is_announced
        self.taken: list[tuple[str, bytes]] = []
        self.n_refused = 0
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port = int(self._listening.getsockname()[1])
        self._thread = threading.Thread(target=self._accept, daemon=True)

    def __enter__(self) -> "SmallBroker":
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with contextlib.suppress(OSError):
            self._listening.shutdown(socket.SHUT_RDWR)
        self._listening.close()
        self._thread.join()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                near, _ = self._listening.accept()
                with near, near.makefile("rb") as stream, contextlib.suppress(OSError, EOFError):
                    self._serve(near, stream)

    def _serve(self, near: socket.socket, stream: BinaryIO) -> None:
        while True:
            kind, body = _packet(stream)
            if kind == CONNECT:
                near.sendall(self._connack())
            elif kind == PUBLISH:
                n_topic = int.from_bytes(body[:2], "big")
                topic, mid = body[2 : 2 + n_topic].decode(), body[2 + n_topic : 4 + n_topic]
                code = self.code_of(topic)
                if code is None:
                    continue
                if code:
                    near.sendall(bytes([PUBACK << 4, 3]) + mid + bytes([code]))
                    continue
                if len(body) <= self._most_bytes:
                    self.taken.append((topic, body))
                    near.sendall(bytes([PUBACK << 4, 2]) + mid)
                    continue
                self.n_refused += 1
                if self._refusal == "puback":
                    near.sendall(bytes([PUBACK << 4, 3]) + mid + bytes([PACKET_TOO_LARGE]))
                    continue
                if self._refusal == "disconnect":
                    near.sendall(bytes([DISCONNECT << 4, 1, PACKET_TOO_LARGE]))
                return
            elif kind == DISCONNECT:
                return

    def _connack(self) -> bytes:
        told = bytes([MAXIMUM_PACKET_SIZE]) + self._most_bytes.to_bytes(4, "big") if self._is_announced else b""
        return bytes([CONNACK << 4, 3 + len(told), 0, 0, len(told)]) + told

    @property
    def estimates(self) -> list[bytes]:
        """The JSON of what was taken, in order."""
        return [body[body.index(b"{") :] for topic, body in self.taken if topic.endswith("/estimates")]


def _packet(stream: BinaryIO) -> tuple[int, bytes]:
    """Kind and body of the next packet. Raises EOFError at the end."""
    first = stream.read(1)
    if not first:
        raise EOFError
    length = shift = 0
    while True:
        (digit,) = stream.read(1) or b"\0"
        length |= (digit & 127) << shift
        shift += 7
        if digit < 128:
            break
    return first[0] >> 4, stream.read(length) or b""
