"""Loopback ports of a test's own, and the first answer of a server that is still starting there."""

import socket
import time

import httpx

from support.patience import PATIENCE_S


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def first_answer(url: str) -> httpx.Response:
    """What ``url`` says as soon as anybody listens there. Raises httpx.TransportError when patience ends."""
    end_s = time.monotonic() + PATIENCE_S
    while True:
        try:
            return httpx.get(url)
        except httpx.TransportError:
            if time.monotonic() > end_s:
                raise
            time.sleep(0.05)
