"""A webhook's receiver as fleets run them: HTTP on a loopback port, that checks signatures and misbehaves when told."""

import base64
import hashlib
import hmac
import json
import socket
import ssl
import threading
import time
from collections.abc import Callable, Iterable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from types import TracebackType
from typing import Any

SECRET = b"a secret of thirty-two bytes....."
SECRET_TEXT = "whsec_" + base64.b64encode(SECRET).decode()
TOLERANCE_S = 300

Answer = tuple[int, dict[str, str]]
Fault = Callable[[BaseHTTPRequestHandler], Answer | None]
"""Does harm, or says what is answered in place of 200; None: no answer at all."""


def status(code: int, **headers: str) -> Fault:
    return lambda request: (code, {name.replace("_", "-"): text for name, text in headers.items()})


def slow(seconds: float) -> Fault:
    def wait(request: BaseHTTPRequestHandler) -> Answer:
        time.sleep(seconds)
        return 200, {}

    return wait


def cut(request: BaseHTTPRequestHandler) -> None:
    """The connection ends with no answer, though the letter was read."""
    request.connection.shutdown(socket.SHUT_RDWR)


def trickle(request: BaseHTTPRequestHandler) -> None:
    """A byte of a header now and then, for ever."""
    try:
        request.wfile.write(b"HTTP/1.1 200 OK\r\nX-Slow: ")
        while True:
            request.wfile.write(b".")
            time.sleep(0.05)
    except OSError:
        pass


class Receiver:
    """A webhook receiver that keeps its requests in order. Each attempt uses up one of ``faults``.

    What is answered with 2xx counts as ``taken``; ``seen`` are all attempts whose signature is right.
    """

    def __init__(self, faults: Iterable[Fault] = (), port: int = 0, tls: ssl.SSLContext | None = None) -> None:
        self.faults = list(faults)
        self.seen: list[str] = []
        self.taken: list[tuple[str, dict[str, Any]]] = []
        self.wrong: list[str] = []
        self._lock = threading.Lock()
        receiver = self

        class Handler(BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def do_POST(self) -> None:
                receiver._receive(self)

            def log_message(self, *_: Any) -> None:
                pass

        class Server(ThreadingHTTPServer):
            daemon_threads = True
            allow_reuse_address = True

            def handle_error(self, request: Any, address: Any) -> None:
                """A client that hangs up is no news."""

        self._server = Server(("127.0.0.1", port), Handler)
        if tls is not None:
            self._server.socket = tls.wrap_socket(self._server.socket, server_side=True)
        self.port = self._server.server_address[1]
        self._thread = threading.Thread(target=lambda: self._server.serve_forever(0.02), daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stops listening, as if the process were killed."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def __enter__(self) -> "Receiver":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def ids(self) -> list[str]:
        """The ids of the accepted messages, each once, in order."""
        return list(dict.fromkeys(letter_id for letter_id, _ in self.taken))

    def _receive(self, request: BaseHTTPRequestHandler) -> None:
        length = int(request.headers["Content-Length"])
        body = request.rfile.read(length)
        if len(body) < length:  # the sender was killed while it wrote
            request.close_connection = True
            return
        letter_id = request.headers["webhook-id"]
        if (fault := why_wrong(request.headers, body)) is not None:
            self.wrong.append(fault)
        with self._lock:
            does = self.faults.pop(0) if self.faults else status(200)
            self.seen.append(letter_id)
        answer = does(request)
        if answer is None:
            request.close_connection = True
            return
        code, headers = answer
        if 200 <= code < 300:
            with self._lock:
                self.taken.append((letter_id, json.loads(body)))
        request.send_response(code)
        for name, text in {**headers, "Content-Length": "0"}.items():
            request.send_header(name, text)
        request.end_headers()


def why_wrong(headers: Any, body: bytes, secret: bytes = SECRET) -> str | None:
    """The fault of a signature, checked as the specification tells receivers to, with code of its own."""
    stamp = headers["webhook-timestamp"]
    if abs(int(stamp) - time.time()) > TOLERANCE_S:
        return f"{stamp} is too old or too new"
    content = b".".join((headers["webhook-id"].encode(), stamp.encode(), body))
    expected = base64.b64encode(hmac.new(secret, content, hashlib.sha256).digest()).decode()
    given = [mark.partition(",") for mark in headers["webhook-signature"].split(" ")]
    if not any(kind == "v1" and hmac.compare_digest(mark, expected) for kind, _, mark in given):
        return "no signature fits"
    return None
