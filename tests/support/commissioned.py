"""A service that may be commissioned, as a test's other thread meets it: through new starts, over HTTP."""

import asyncio
import json
import threading
import urllib.error
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

from gateway.bus.sink import replay
from gateway.config import Settings, load_settings
from gateway.service.gateway import Gateway
from gateway.service.lifecycle import live
from support.patience import wait_until

PATH = "/api/v1/calibration/commissioning"


class Running:
    """The service; ``gateway`` is the one at work now, another after each new start."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.gateway: Gateway | None = None
        self.n_starts = 0

    @property
    def now(self) -> Gateway:
        """The gateway at work."""
        assert self.gateway is not None
        return self.gateway

    def play(self, log: Path) -> None:
        """Send a log; return when all of it was worked through."""
        gateway = self.now
        before = gateway.source.counts().frames
        sent = replay(log, "virtual", self.settings.bus.channel, speed="max").frames
        assert wait_until(lambda: gateway.source.counts().frames >= before + sent and gateway.has_caught_up)
        gateway.keeper.flush()

    def ask(self, path: str = PATH, body: dict[str, Any] | None = None, method: str | None = None) -> dict[str, Any]:
        """The answer; a refusal's problem."""
        content = None if body is None else json.dumps(body).encode()
        headers = {"Content-Type": "application/json"}
        request = urllib.request.Request(self.now.url + path, content, headers, method=method)
        try:
            with urllib.request.urlopen(request, timeout=30.0) as answer:
                told: dict[str, Any] = json.load(answer)
        except urllib.error.HTTPError as refusal:
            told = json.load(refusal)
        return told

    def step(self, step: str, body: dict[str, Any]) -> dict[str, Any]:
        """One step of the commissioning."""
        return self.ask(f"{PATH}/{step}" if step else PATH, body)

    def wait_until(self, is_so: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """Until the commissioning is so; between two starts nobody answers."""
        seen: list[dict[str, Any]] = []

        def came_true() -> bool:
            try:
                seen[:] = [self.ask()]
            except (OSError, AssertionError, IndexError):
                return False
            return is_so(seen[0])

        assert wait_until(came_true), seen
        return seen[0]


def serve(config: Path, meet: Callable[[Running], None]) -> None:
    """Run the service while ``meet`` does its part in another thread; what fails there fails here."""
    settings = load_settings(config)
    running = Running(settings)
    failures: list[BaseException] = []

    def on_started(gateway: Gateway) -> None:
        running.gateway = gateway
        running.n_starts += 1
        loop = asyncio.get_running_loop()
        stop[0] = lambda: loop.call_soon_threadsafe(gateway.request_stop)
        if running.n_starts == 1:
            threading.Thread(target=part, daemon=True).start()

    stop: list[Callable[[], object]] = [lambda: None]

    def part() -> None:
        try:
            meet(running)
        except BaseException as failure:  # noqa: BLE001 - raised again in the test's own thread
            failures.append(failure)
        stop[0]()

    while live(settings, lambda: load_settings(config), on_started=on_started):
        pass
    if failures:
        raise failures[0]
