"""Loopback ports of a test's own, and the first answer of a server that is still starting there."""

import socket
import time

import httpx


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def first_answer(url: str, timeout_s: float = 20.0) -> httpx.Response:
    """What ``url`` says as soon as anybody listens there. Raises httpx.TransportError when the time is out."""
    end_s = time.monotonic() + timeout_s
    while True:
        try:
            return httpx.get(url)
        except httpx.TransportError:
            if time.monotonic() > end_s:
                raise
            time.sleep(0.05)
