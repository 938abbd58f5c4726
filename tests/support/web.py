"""A store, a board and the application over them, without a server or with one on a free port."""

import asyncio
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any

import httpx
import uvicorn
from fastapi import FastAPI
from starlette.types import ASGIApp, Receive, Scope, Send

from gateway.estimates.as_json import estimate_to_json
from gateway.estimates.batch_estimate import Estimate
from gateway.status import State, Status
from gateway.store import Store
from gateway.web.access.serving import server_config
from gateway.web.access.tokens import TokenFile
from gateway.web.app import create_app
from gateway.web.live.board import Board
from gateway.web.routes.service_calls import LearnerBackend
from gateway.web.routes.weights import KnownLoads
from gateway.weighing.calibrated import CalibratedVehicle
from support.absent import of_no_vehicle
from support.patience import PATIENCE_S


class Gateway:
    """The web room with a real store behind it; ``clock_s`` and ``status`` are the test's to set."""

    def __init__(
        self,
        directory: Path,
        tokens: TokenFile | None = None,
        calibrated: CalibratedVehicle | None = None,
        known_loads: KnownLoads | None = None,
        learner: LearnerBackend | None = None,
    ) -> None:
        self.clock_s = 1000.0
        self.status = Status(version="1.2.3", state=State.COLLECTING, uptime_s=5.0, vehicle_id="van-17")
        self.store = Store.open(directory)
        self.board = Board(stale_after_s=900.0, clock=lambda: self.clock_s)
        self._known: dict[str, Any] = {
            "tokens": tokens,
            "calibrated": calibrated,
            "known_loads": known_loads,
            **of_no_vehicle(directory, self.store),
        }
        if learner is not None:
            self._known["learner"] = learner
        self.app = self._make_app()

    def publish(self, *estimates: Estimate) -> list[str]:
        """Publishes a batch as the pipeline does: on the board, then in the journal."""
        cursors = []
        for estimate in estimates:
            self.board.publish(estimate)
            cursors.append(self.store.write_estimate(estimate_to_json(estimate)))
        return cursors

    def restart_board(self) -> None:
        """Makes a new board and application over the same store, as a restart of the service does."""
        self.board = Board(stale_after_s=900.0, clock=lambda: self.clock_s)
        self.app = self._make_app()

    def _make_app(self) -> FastAPI:
        reader = self.store.reader()
        return create_app(self.board, reader, lambda: self.status, **self._known)

    def __enter__(self) -> "Gateway":
        return self

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        self.board.close()
        self.store.close()


def below(prefix: str, app: ASGIApp) -> ASGIApp:
    """The application behind a proxy that serves it below a path, which it cuts off."""

    async def proxy(scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http":
            assert scope["path"].startswith(f"{prefix}/"), f"{scope['path']} leaves {prefix}/"
            scope = {key: scope[key] for key in scope.keys() - {"raw_path"}} | {"path": scope["path"][len(prefix) :]}
        await app(scope, receive, send)

    return proxy


class Client:
    """Asks the application itself, without a server in between; an error in it is an answer, not an exception."""

    def __init__(self, app: ASGIApp, address: str = "127.0.0.1") -> None:
        self.app = app
        self._client = (address, 12345)

    def get(self, url: str, **options: Any) -> httpx.Response:
        return self.request("GET", url, **options)

    def request(self, method: str, url: str, **options: Any) -> httpx.Response:
        return asyncio.run(self._ask(method, url, **options))

    async def _ask(self, method: str, url: str, **options: Any) -> httpx.Response:
        transport = httpx.ASGITransport(self.app, raise_app_exceptions=False, client=self._client)
        async with httpx.AsyncClient(transport=transport, base_url="http://localhost:8000") as client:
            return await client.request(method, url, **options)


class Server:
    """The application under uvicorn, on a loopback port of its own."""

    def __init__(self, config: uvicorn.Config, port: int = 0) -> None:
        self.socket = socket.create_server(("127.0.0.1", port))
        self.url = f"http://127.0.0.1:{self.socket.getsockname()[1]}"
        config.timeout_graceful_shutdown = round(PATIENCE_S)
        self.uvicorn = uvicorn.Server(config)
        self.is_up = threading.Event()
        self.loop: asyncio.AbstractEventLoop | None = None
        self.thread = threading.Thread(target=self._run)

    def _run(self) -> None:
        with asyncio.Runner(loop_factory=self.uvicorn.config.get_loop_factory()) as runner:  # as the service does
            runner.run(self._serve())

    async def _serve(self) -> None:
        self.loop = asyncio.get_running_loop()
        serving = asyncio.create_task(self.uvicorn.serve(sockets=[self.socket]))
        while not self.uvicorn.started and not serving.done():
            await asyncio.sleep(0.005)
        self.is_up.set()
        while not serving.done():
            await asyncio.wait([serving], timeout=0.1)
            if self.uvicorn.should_exit:  # uvicorn forgets whoever is let in as it closes the door, and waits for him
                for connection in tuple(self.uvicorn.server_state.connections):
                    connection.shutdown()
        await serving


@contextmanager
def serving(app: ASGIApp, config: uvicorn.Config | None = None, port: int = 0) -> Iterator[Server]:
    """A running server; stopped at the end if the test has not done so."""
    server = Server(config or server_config(app, "127.0.0.1", port), port)
    server.thread.start()
    assert server.is_up.wait(PATIENCE_S)
    try:
        yield server
    finally:
        server.uvicorn.should_exit = True
        server.thread.join(PATIENCE_S)
        assert not server.thread.is_alive()
