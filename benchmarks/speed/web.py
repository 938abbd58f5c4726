"""The web side: the rate of requests for the latest estimate over HTTP on one core.

Server, client and a bus of 2500 frames/s are three processes on the loopback interface. The server is the service: it
receives and decodes the bus (CAN datagrams over a loopback socket, as in live.py; kernel-filtered, so that 210 frames/s
of ours arrive), holds an estimate with spectra of the usual length and publishes a new one every 100 ms into eight open
streams. Goal: 5000 requests/s with p99 under 20 ms, and no frame lost.
"""

import asyncio
import json
import socket
import subprocess
import tempfile
import threading
import time
import urllib.request
from functools import partial
from pathlib import Path
from typing import Any, cast

import numpy as np
import uvicorn
import uvloop

from benchmarks.speed import live
from benchmarks.speed.meter import command_of, free_port
from gateway.bus.listen import LiveSource
from gateway.bus.receiver import open_channel
from gateway.bus.signals import Decoder, load_signal_map
from gateway.core.batch_settings import BatchSettings
from gateway.estimates.as_json import estimate_to_json
from gateway.estimates.batch_estimate import Estimate, Quantity
from gateway.records import Spectra
from gateway.service.pipeline import Pipeline
from gateway.status import BusStatus, State, Status
from gateway.store import Store
from gateway.units import NS_PER_S
from gateway.web.access.serving import server_config
from gateway.web.app import create_app
from gateway.web.live.board import Board
from gateway.weighing.flow import Flow, Identity

LATEST = b"GET /api/v1/estimates/latest HTTP/1.1\r\nHost: localhost\r\n\r\n"
STREAM = b"GET /api/v1/stream HTTP/1.1\r\nHost: localhost\r\n\r\n"
STATUS = "http://127.0.0.1:{port}/api/v1/status"
N_STREAMS = 8  # chosen
N_CONNECTIONS = 16  # chosen
BUS_FRAMES_PER_S = 210  # what a kernel filter lets through of 2500


def estimate(n: int) -> Estimate:
    """A batch with spectra of a hundred lines, as the pipeline makes them."""
    random = np.random.default_rng(n)
    spectra = Spectra(np.linspace(0.5, 10.0, 98), *(random.uniform(0.0, 1.0, 98) for _ in range(4)))
    start_ns = n * 300 * NS_PER_S
    return Estimate(
        t_start_ns=start_ns,
        t_end_ns=start_ns + 300 * NS_PER_S,
        estimator="ratio_index",
        payload=Quantity(271.3),
        front_share=Quantity(50.4),
        spectra=spectra,
    )


def serve(directory: str, port: int) -> None:
    """The server's process: bus, pipeline, store, board and application, and a thread that publishes."""
    store, board = Store.open(Path(directory)), Board()
    signal_map = load_signal_map("springscale:reference")
    wire = live.listening_socket()
    source = LiveSource(
        "socketcan", "bench", signal_map, open_receiver=partial(open_channel, "socketcan", "bench", (), 8, {})
    )
    flow = Flow(BatchSettings(), signal_map.traits, None, "cross_spectrum", Identity())
    pipeline = Pipeline(source.inbox, Decoder(signal_map), flow, store, board)
    source.start()
    pipeline.start()

    def status() -> Status:
        counts = source.counts()
        dropped = BusStatus(
            channel=str(wire.getsockname()[1]),
            n_frames=counts.frames,
            n_inbox_dropped=counts.dropped_inbox,
            n_kernel_dropped=counts.dropped_kernel,
        )
        return Status(version="bench", state=State.ESTIMATING, uptime_s=0.0, bus=dropped)

    def publish() -> None:
        for n in range(1_000_000):
            made = estimate(n)
            board.publish(made)
            store.write_estimate(estimate_to_json(made))
            time.sleep(0.1)

    threading.Thread(target=publish, daemon=True).start()
    app = create_app(board, store.reader(), status)
    uvicorn.Server(server_config(app, "127.0.0.1", port)).run()


def bus_of(port: int) -> dict[str, Any]:
    """The server's status of its bus."""
    with urllib.request.urlopen(STATUS.format(port=port)) as answer:
        bus: dict[str, Any] = json.load(answer)["bus"]
    return bus


class Asker(asyncio.Protocol):
    """One connection that repeats its request as soon as it is answered, and notes the time of each answer."""

    def __init__(self, took_s: list[float], end_s: float, done: asyncio.Future[None]) -> None:
        self._took_s, self._end_s, self._done = took_s, end_s, done
        self._missing = 0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.Transport, transport)  # uvloop's own, of another family
        self._ask()

    def data_received(self, data: bytes) -> None:
        if self._missing == 0:
            head, _, body = data.partition(b"\r\n\r\n")
            assert head.startswith(b"HTTP/1.1 200"), head
            length = head[head.index(b"content-length: ") + 16 :]
            self._missing = int(length.split(b"\r\n", 1)[0]) - len(body)
        else:
            self._missing -= len(data)
        if self._missing == 0:
            self._took_s.append(time.perf_counter() - self._asked_s)
            self._ask()

    def _ask(self) -> None:
        self._asked_s = time.perf_counter()
        if self._asked_s < self._end_s:
            self._transport.write(LATEST)
        else:
            self._transport.close()
            self._done.set_result(None)


async def listen(reader: asyncio.StreamReader) -> None:
    """Read all of a stream; unread data would block the server eventually."""
    while await reader.read(1 << 16):
        pass


async def ask(port: int, n_connections: int, seconds: float) -> list[float]:
    """All answers' times in seconds."""
    loop = asyncio.get_running_loop()
    streams = [await asyncio.open_connection("127.0.0.1", port) for _ in range(N_STREAMS)]
    listeners = []
    for reader, writer in streams:
        writer.write(STREAM)
        listeners.append(asyncio.create_task(listen(reader)))
    took_s: list[float] = []
    end_s = time.perf_counter() + seconds
    done = [loop.create_future() for _ in range(n_connections)]
    for each in done:
        await loop.create_connection(partial(Asker, took_s, end_s, each), "127.0.0.1", port)
    await asyncio.wait_for(asyncio.gather(*done), seconds + 30.0)
    for listener in listeners:
        listener.cancel()
    return took_s


def wait_until_up(port: int) -> None:
    for _ in range(400):
        try:
            socket.create_connection(("127.0.0.1", port), timeout=1.0).close()
        except OSError:
            time.sleep(0.05)
        else:
            return
    raise SystemExit("the server did not come up")


def measure(seconds: float) -> dict[str, float]:
    """Requests for this long."""
    port = free_port()
    with tempfile.TemporaryDirectory() as directory:
        server = subprocess.Popen(command_of(serve, directory, port))
        try:
            wait_until_up(port)
            bus = command_of(live.send, int(bus_of(port)["channel"]), BUS_FRAMES_PER_S, seconds)
            sender = subprocess.Popen(bus, stdout=subprocess.PIPE, text=True)
            took_s = uvloop.run(ask(port, N_CONNECTIONS, seconds))
            n_sent = int(sender.communicate()[0])
            time.sleep(0.5)
            heard = bus_of(port)
        finally:
            server.terminate()
            server.wait(10.0)
    p50_ms, p99_ms = (float(1e3 * x) for x in np.percentile(took_s, [50.0, 99.0]))
    return {
        "requests_per_s": len(took_s) / seconds,
        "p50_ms": p50_ms,
        "p99_ms": p99_ms,
        "frames_sent": n_sent,
        "frames_received": heard["n_frames"],
        "frames_dropped": heard["n_inbox_dropped"] + heard["n_kernel_dropped"],
    }
