"""The internals of uvicorn that the web server relies on: none is promised, so the version is pinned.

A new minor version of uvicorn: raise the bound in pyproject.toml, run this and tests/scenarios/test_web_flood.py.
"""

import asyncio
import inspect
import tomllib
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest
import uvicorn
from packaging.requirements import Requirement
from uvicorn.protocols.http.flow_control import FlowControl
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol, RequestResponseCycle
from uvicorn.protocols.utils import get_remote_addr
from uvicorn.server import ServerState

from gateway.web.access.serving import GuardedConnection, TlsConfig, WebServer

# Callbacks of the protocol that are overridden and call the one above them, with their arguments
OVERRIDDEN = {
    "connection_made": ["self", "transport"],
    "connection_lost": ["self", "exc"],
    "data_received": ["self", "data"],
    "pause_writing": ["self"],
    "resume_writing": ["self"],
    "on_message_begin": ["self"],
    "on_headers_complete": ["self"],
    "on_body": ["self", "body"],
    "on_message_complete": ["self"],
    "send_400_response": ["self", "msg"],
}
OF_A_CONNECTION = (
    "loop",
    "transport",
    "scope",
    "cycle",
    "flow",
    "url",
    "headers",
    "connections",
    "client",
    "logger",
    "server_state",
)
OF_A_CYCLE = ("response_started", "response_complete", "disconnected", "message_event")


def test_the_range_is_pinned_to_the_versions_that_were_looked_at() -> None:
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
    (wanted,) = [one for one in map(Requirement, project["dependencies"]) if one.name == "uvicorn"]
    assert any(one.operator == "<" for one in wanted.specifier)
    assert wanted.specifier.contains(version("uvicorn"))


@pytest.mark.parametrize(("name", "arguments"), OVERRIDDEN.items())
def test_the_callbacks_are_there_with_their_arguments(name: str, arguments: list[str]) -> None:
    assert list(inspect.signature(getattr(HttpToolsProtocol, name)).parameters) == arguments
    assert getattr(GuardedConnection, name) is not getattr(HttpToolsProtocol, name)


def test_a_connection_and_its_cycle_have_what_is_looked_at() -> None:
    async def look() -> None:
        config = uvicorn.Config(lambda: None, http=HttpToolsProtocol)  # type: ignore[arg-type,return-value]
        config.load()
        connection = HttpToolsProtocol(config=config, server_state=ServerState(), app_state={})
        made = inspect.getsource(HttpToolsProtocol)
        for name in OF_A_CONNECTION:
            assert hasattr(connection, name) or f"self.{name} =" in made, name
        assert "write_paused" in inspect.getsource(FlowControl)
        assert isinstance(ServerState().connections, set)

    asyncio.run(look())
    cycle = inspect.getsource(RequestResponseCycle)
    assert all(f"self.{name}" in cycle for name in OF_A_CYCLE)
    assert list(inspect.signature(get_remote_addr).parameters) == ["transport"]


def test_the_server_and_its_settings_have_what_is_looked_at() -> None:
    assert hasattr(uvicorn.Server, "capture_signals")
    assert WebServer.capture_signals is not uvicorn.Server.capture_signals
    assert "self.on_tick(" in inspect.getsource(uvicorn.Server.main_loop)
    dated = "default_headers=self.server_state.default_headers"
    assert dated in inspect.getsource(HttpToolsProtocol.on_headers_complete)
    assert {"is_ssl", "get_loop_factory"} <= set(dir(uvicorn.Config))
    assert "self.ssl" in inspect.getsource(uvicorn.Config.load)
    assert TlsConfig.load is not uvicorn.Config.load
    server = uvicorn.Server(uvicorn.Config(lambda: None))  # type: ignore[arg-type,return-value]
    assert (server.started, server.should_exit) == (False, False)


def test_a_server_that_sleeps_ends_as_soon_as_it_is_told() -> None:
    async def serve() -> None:
        config = uvicorn.Config(lambda: None)  # type: ignore[arg-type,return-value]  # no app: nobody asks
        server = WebServer(config)
        looping = asyncio.create_task(server.main_loop())
        await asyncio.sleep(0)
        assert not looping.done()
        server.end()
        await asyncio.wait_for(looping, 60.0)

    asyncio.run(serve())


def test_each_answer_has_the_date_of_its_request(monkeypatch: pytest.MonkeyPatch) -> None:
    """A server that nobody asks does not wake for it."""

    async def answer(scope: Any, receive: Any, send: Any) -> None:
        await send({"type": "http.response.start", "status": 204, "headers": []})
        await send({"type": "http.response.body"})

    async def date_at(server: WebServer, unix_s: float) -> bytes:
        monkeypatch.setattr("gateway.web.access.serving.time.time", lambda: unix_s)
        reader, writer = await asyncio.open_connection(*server.servers[0].sockets[0].getsockname())
        writer.write(b"GET / HTTP/1.1\r\nHost: van\r\nConnection: close\r\n\r\n")
        said = await asyncio.wait_for(reader.read(), 60.0)
        writer.close()
        [date] = [line for line in said.lower().split(b"\r\n") if line.startswith(b"date: ")]
        return date.removeprefix(b"date: ")

    async def serve() -> None:
        server = WebServer(uvicorn.Config(answer, port=0, http=GuardedConnection, lifespan="off", log_config=None))
        serving = asyncio.create_task(server.serve())
        while not server.started:
            await asyncio.sleep(0.01)
        assert await date_at(server, 784_111_777.9) == b"sun, 06 nov 1994 08:49:37 gmt"  # RFC 9110's example
        assert await date_at(server, 784_111_778.0) == b"sun, 06 nov 1994 08:49:38 gmt"
        server.end()
        await asyncio.wait_for(serving, 60.0)

    asyncio.run(serve())
