"""The processor time of the programs beside the service: deploy/kuksa/feeder.py and deploy/traccar/feeder.py.

    python -m benchmarks.speed.feeders --output docs/feeders_cost.json

Each polls the real web application, which has a new weight for every request, far more often than in a vehicle; KUKSA's
databroker and Traccar are stand-ins that accept everything (KUKSA's with the stubs of its own client).
"""

import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import grpc
import uvicorn
from kuksa.val.v1 import types_pb2, val_pb2, val_pb2_grpc
from kuksa.val.v2 import val_pb2 as v2
from kuksa.val.v2 import val_pb2_grpc as v2_grpc

from benchmarks.speed.meter import ROOT, cpu_of_s, machine, peak_mb, print_and_write
from gateway.estimate import Estimate, Quantity
from gateway.estimate_json import estimate_to_json
from gateway.status import State, Status
from gateway.store import Store
from gateway.units import NS_PER_S
from gateway.web.access.serving import server_config
from gateway.web.app import create_app
from gateway.web.live.board import Board

EVERY_S: Final = 0.1  # a question, here
DEFAULT_EVERY_S: Final = {"kuksa": 5.0, "traccar": 10.0}  # --every-s of the two
SETTLE_S: Final = 5.0  # the start of Python is not counted
MEASURED_S: Final = 30.0  # chosen
WINDOW_NS: Final = 300 * NS_PER_S  # BatchSettings.window_s
PAYLOAD: Final = "Vehicle.Load.Payload"
FEEDERS: Final = ("kuksa", "traccar")


@dataclass
class Taken:
    """The number of weights that a stand-in received."""

    n: int = 0


class Metadata(val_pb2_grpc.VALServicer):  # type: ignore[misc]  # the stubs carry no types
    """Every path exists; those of the core specification are integers."""

    def Get(self, request: Any, context: Any) -> Any:
        answer = val_pb2.GetResponse()
        for asked in request.entries:
            kind = "DATA_TYPE_UINT16" if asked.path.endswith("Weight") else "DATA_TYPE_FLOAT"
            metadata = types_pb2.Metadata(data_type=types_pb2.DataType.Value(kind))
            answer.entries.append(types_pb2.DataEntry(path=asked.path, metadata=metadata))
        return answer

    def GetServerInfo(self, request: Any, context: Any) -> Any:
        return val_pb2.GetServerInfoResponse(name="stand-in", version="0.0.0")


class Databroker(v2_grpc.VALServicer):  # type: ignore[misc]  # the stubs carry no types
    """Every value is taken."""

    def __init__(self, taken: Taken) -> None:
        self._taken = taken

    def PublishValue(self, request: Any, context: Any) -> Any:
        self._taken.n += request.signal_id.path == PAYLOAD
        return v2.PublishValueResponse()


@contextmanager
def databroker() -> Iterator[tuple[list[str], Taken]]:
    """A stand-in for KUKSA's databroker, the options that name it, and its count."""
    taken, server = Taken(), grpc.server(ThreadPoolExecutor(2))
    val_pb2_grpc.add_VALServicer_to_server(Metadata(), server)
    v2_grpc.add_VALServicer_to_server(Databroker(taken), server)
    port = server.add_insecure_port("127.0.0.1:0")
    server.start()
    try:
        yield ["--databroker", f"127.0.0.1:{port}"], taken
    finally:
        server.stop(None).wait()


@contextmanager
def traccar() -> Iterator[tuple[list[str], Taken]]:
    """The same for Traccar."""
    taken = Taken()

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            taken.n += 1
            self.send_response(200)
            self.send_header("Content-Length", "0")
            self.end_headers()

        def log_message(self, *_: Any) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        with TemporaryDirectory() as state:
            yield ["--traccar", f"http://127.0.0.1:{server.server_port}", "--device", "van-17", "--state", state], taken
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


@contextmanager
def weighing() -> Iterator[str]:
    """The web application with a new weight every EVERY_S, and its address."""
    with TemporaryDirectory() as folder:
        store, board = Store.open(Path(folder) / "state"), Board()
        status = Status(version="0", state=State.COLLECTING, uptime_s=0.0, vehicle_id="van-17")
        server = uvicorn.Server(server_config(create_app(board, store.reader(), lambda: status), "127.0.0.1", 0))
        listener = server.config.bind_socket()
        stopping = threading.Event()
        threads = [
            threading.Thread(target=server.run, args=([listener],)),
            threading.Thread(target=_weigh, args=(board, store, stopping)),
        ]
        for thread in threads:
            thread.start()
        try:
            yield f"http://127.0.0.1:{listener.getsockname()[1]}"
        finally:
            stopping.set()
            server.should_exit = True
            for thread in threads:
                thread.join()
            board.close()
            store.close()


def _weigh(board: Board, store: Store, stopping: threading.Event) -> None:
    begun_ns = time.time_ns()
    n = 0
    while not stopping.wait(EVERY_S):
        n += 1
        end_ns = begun_ns + n * WINDOW_NS
        found = Estimate(
            end_ns - WINDOW_NS,
            end_ns,
            "cross_spectrum",
            payload=Quantity.normal(300.0 + n % 50, 6.0),
            front_share=Quantity.normal(50.0 + n % 7 / 10.0, 0.2),
        )
        board.publish(found)
        store.write_estimate(estimate_to_json(found))


def cost_of(name: str) -> dict[str, float]:
    """CPU seconds per request with its new weight, and peak memory in MB."""
    with weighing() as url, {"kuksa": databroker, "traccar": traccar}[name]() as (options, taken):
        command = [
            sys.executable,
            str(ROOT / "deploy" / name / "feeder.py"),
            "--url",
            url,
            "--every-s",
            str(EVERY_S),
            *options,
        ]
        feeder = subprocess.Popen(command)
        try:
            time.sleep(SETTLE_S)
            begun_n, begun_cpu_s = taken.n, cpu_of_s(feeder.pid)
            time.sleep(MEASURED_S)
            n, cpu_s = taken.n - begun_n, cpu_of_s(feeder.pid) - begun_cpu_s
            found = {"cpu_ms_each": 1e3 * cpu_s / n, "n": n, "rss_mb": peak_mb(feeder.pid)}
        finally:
            feeder.terminate()
            feeder.wait(30.0)
    every_s = DEFAULT_EVERY_S[name]
    return {**found, "every_s": every_s, "cpu_pct": 0.1 * found["cpu_ms_each"] / every_s}


def measure() -> dict[str, Any]:
    """Each of them."""
    return {"machine": machine(), **{name: cost_of(name) for name in FEEDERS}}


if __name__ == "__main__":
    print_and_write(__doc__, measure)
