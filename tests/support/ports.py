"""Loopback ports of a test's own, and the first answer of a server that is still starting there."""

import contextlib
import random
import socket
import time

import httpx

from support.patience import PATIENCE_S


def free_port() -> int:
    """Below the range from which Linux gives ports by itself: nobody else gets it before its server starts."""
    while True:
        port = random.SystemRandom().randint(20_000, 32_000)
        with socket.socket() as probe, contextlib.suppress(OSError):
            probe.bind(("127.0.0.1", port))
            return port


def first_answer(url: str) -> httpx.Response:
    """The first answer of ``url`` once a server listens. Raises httpx.TransportError when patience ends."""
    end_s = time.monotonic() + PATIENCE_S
    while True:
        try:
            return httpx.get(url, timeout=PATIENCE_S)
        except httpx.TransportError:
            if time.monotonic() > end_s:
                raise
            time.sleep(0.05)
