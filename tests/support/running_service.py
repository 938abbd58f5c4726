"""A running service as a test's other thread meets it, and what it left behind."""

import json
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
from click.testing import Result

from gateway.bus.sink import replay
from gateway.config import Settings, load_settings
from gateway.service.gateway import Gateway
from gateway.service.lifecycle import live
from gateway.store import Store
from gateway.store.journal import SERVICE
from support.commands import called, printed
from support.configured import service_config
from support.patience import PATIENCE_S, wait_until


def configuration(folder: Path, calibration: str, more: str = "") -> Path:
    """Settings of a service on a bus of the test's own, weighing with ``calibration``; ``more`` is appended."""
    batch = {"batch__window_s": 20.0, "batch__provisional_every_s": 0.0}
    return service_config(folder, calibration, more, estimator="ratio_index", vehicle__id="van-17", **batch)


class Running:
    """A running service as the test's other thread meets it; ``gateway`` is another after each new start."""

    gateway: Gateway

    def __init__(self, settings: Settings) -> None:
        self._channel = settings.bus.channel
        self.n_starts = 0

    def play(self, log: Path, speed: float | str = "max") -> None:
        """Send a log; return when all of it was worked through."""
        gateway = self.gateway
        before = gateway.source.counts().frames
        sent = replay(log, "virtual", self._channel, speed=speed).frames
        is_through = wait_until(lambda: gateway.source.counts().frames >= before + sent and gateway.has_caught_up)
        assert is_through, f"{log} was not worked through"
        gateway.learner.flush()

    def ask(self, *arguments: str) -> Result:
        """springscale ... against this service."""
        return called(*arguments, "--url", self.gateway.url)

    def told(self, *arguments: str) -> dict[str, Any]:
        """The command's answer with --json."""
        found = self.ask(*arguments, "--json")
        assert found.exit_code == 0, (found.output, found.exception)
        return json.loads(found.stdout)

    def http(self, path: str, body: dict[str, Any] | None = None, method: str | None = None) -> dict[str, Any]:
        """The answer; a refusal's problem."""
        method = method or ("GET" if body is None else "POST")
        return httpx.request(method, self.gateway.url + path, json=body, timeout=PATIENCE_S).json()


def serve(config: Path, meet: Callable[[Running], None]) -> None:
    """Run the service while ``meet`` does its part in another thread; what fails there fails here."""
    settings = load_settings(config)
    running = Running(settings)
    failures: list[BaseException] = []

    def on_started(gateway: Gateway) -> None:
        running.gateway = gateway
        running.n_starts += 1
        if running.n_starts == 1:
            threading.Thread(target=part, daemon=True).start()

    def part() -> None:
        try:
            meet(running)
        except BaseException as failure:  # noqa: BLE001 - raised again in the test's own thread
            failures.append(failure)
        running.gateway.request_stop()

    while live(settings, on_started=on_started):
        pass
    if failures:
        raise failures[0]


def stored(config: Path) -> list[str]:
    store = Store.open(load_settings(config).store.directory)
    try:
        return list(store.reader().estimates().items)
    finally:
        store.close()


def events(config: Path) -> list[str]:
    """The events of the service, newest first."""
    store = Store.open(load_settings(config).store.directory)
    try:
        return [event.partition("\n")[0] for event in store.reader().page((SERVICE,), newest_first=True).items]
    finally:
        store.close()


def counted(texts: list[str]) -> list[str]:
    return [text for text in texts if not json.loads(text)["rejected"]]


def estimated(config: Path, *logs: Path, options: tuple[str, ...] = ()) -> list[str]:
    """The estimates of each log by itself: of several at once, every line would also name its log."""
    lines: list[str] = []
    for log in logs:
        lines += printed("estimate", log, "--config", config, "--json", *options).splitlines()
    return lines
