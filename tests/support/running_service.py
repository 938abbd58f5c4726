"""A running service as a test's other thread meets it, and what it left behind."""

import asyncio
import json
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from click.testing import Result

from gateway.bus.sink import replay
from gateway.config import load_settings
from gateway.history import SERVICE
from gateway.service.gateway import Gateway
from gateway.setup import setup_of
from gateway.store import Store
from support.commands import called, printed
from support.configured import service_config
from support.patience import wait_until


def configuration(folder: Path, calibration: str, more: str = "") -> Path:
    """Settings of a service on a bus of the test's own, weighing with ``calibration``; ``more`` is appended."""
    batch = {"batch__window_s": 20.0, "batch__provisional_every_s": 0.0}
    return service_config(folder, calibration, more, estimator="ratio_index", vehicle__id="van-17", **batch)


class Running:
    """A running service as the test's other thread meets it."""

    def __init__(self, gateway: Gateway, channel: str) -> None:
        self.gateway = gateway
        self._channel = channel

    def play(self, log: Path, speed: float | str = "max") -> None:
        """Send a log; return when all of it was worked through."""
        before = self.gateway.source.counts().frames
        sent = replay(log, "virtual", self._channel, speed=speed).frames
        gateway = self.gateway
        is_through = wait_until(lambda: gateway.source.counts().frames >= before + sent and gateway.has_caught_up)
        assert is_through, f"{log} was not worked through"

    def ask(self, *arguments: str) -> Result:
        """springscale ... against this service."""
        return called(*arguments, "--url", self.gateway.url)

    def told(self, *arguments: str) -> dict[str, Any]:
        """What it answers with --json."""
        found = self.ask(*arguments, "--json")
        assert found.exit_code == 0, (found.output, found.exception)
        return json.loads(found.stdout)


def serve(config: Path, meet: Callable[[Running], None]) -> None:
    """Run the service while ``meet`` does its part in another thread; what fails there fails here."""
    settings = load_settings(config)
    failures: list[BaseException] = []

    def on_started(gateway: Gateway) -> None:
        loop = asyncio.get_running_loop()

        def part() -> None:
            try:
                meet(Running(gateway, settings.bus.channel))
            except BaseException as failure:  # noqa: BLE001 - raised again in the test's own thread
                failures.append(failure)
            loop.call_soon_threadsafe(gateway.request_stop)

        threading.Thread(target=part, daemon=True).start()

    Gateway(settings, setup_of(settings), on_started=on_started).run()
    if failures:
        raise failures[0]


def stored(config: Path) -> list[str]:
    store = Store.open(load_settings(config).store.directory)
    try:
        return list(store.reader().estimates().items)
    finally:
        store.close()


def events(config: Path) -> list[str]:
    """What happened to the service, newest first."""
    store = Store.open(load_settings(config).store.directory)
    try:
        return [event.partition("\n")[0] for event in store.reader().page((SERVICE,), newest_first=True).items]
    finally:
        store.close()


def counted(texts: list[str]) -> list[str]:
    return [text for text in texts if not json.loads(text)["rejected"]]


def estimated(config: Path, *logs: Path, options: tuple[str, ...] = ()) -> list[str]:
    """Each log by itself: of several at once, every line would also say of which it is."""
    lines: list[str] = []
    for log in logs:
        lines += printed("estimate", log, "--config", config, "--json", *options).splitlines()
    return lines
