"""From a vehicle's Springscale into its KUKSA databroker: GET /api/v1/vss, published as VSS signals.

    feeder.py --url http://127.0.0.1:8000 --databroker 127.0.0.1:55555

A program of its own beside the service, with `pip install kuksa-client`. What the service does not know, and what it
calls stale, is published as not available. Signals that the databroker does not know are named once and left out. A
token of the service comes from SPRINGSCALE_TOKEN, one of the databroker from DATABROKER_TOKEN.
"""

import argparse
import json
import os
import signal
import sys
import threading
import urllib.request
from datetime import datetime
from pathlib import Path
from typing import Any

import grpc
from kuksa_client.grpc import Datapoint, VSSClient, VSSClientError

REFUSED = (400, grpc.StatusCode.INVALID_ARGUMENT.value[0])  # of kuksa.val.v1, of v2


def asked(url: str) -> Any:
    """What the service answers. Raises OSError or ValueError."""
    token = os.environ.get("SPRINGSCALE_TOKEN")
    request = urllib.request.Request(url, headers={"Authorization": f"Bearer {token}"} if token else {})
    with urllib.request.urlopen(request, timeout=5.0) as answer:
        return json.load(answer)


def points_now(url: str) -> dict[str, Datapoint]:
    """Each signal as it is to be published; None is not available. Raises as ``asked``."""
    is_stale = asked(f"{url}/api/v1/estimates/latest")["is_stale"]
    found = {}
    for point in asked(f"{url}/api/v1/vss"):
        at = datetime.fromisoformat(point["timestamp"]) if point["timestamp"] else None  # none of the kerb weight
        found[point["path"]] = Datapoint(None if at and is_stale else point["value"], at)
    return found


def known_to(databroker: VSSClient, paths: list[str]) -> set[str]:
    """Those of ``paths`` that it has; the others are told. Raises VSSClientError where it does not answer."""
    known = set(paths)
    for path in paths:
        try:
            databroker.get_value_types([path])
        except VSSClientError as fault:
            if fault.error.get("code") not in (404, grpc.StatusCode.NOT_FOUND.value[0]):
                raise
            known.discard(path)
    if missing := sorted(set(paths) - known):
        tell(f"the databroker does not know {', '.join(missing)}: load docs/vss/springscale.vspec")
    return known


def feed(url: str, databroker: VSSClient, every_s: float, stopping: threading.Event) -> None:
    """Publish what changed. Raises VSSClientError where the databroker fails; a service that is away is waited for."""
    known: set[str] | None = None
    before: dict[str, Datapoint] = {}
    while not stopping.is_set():
        try:
            points = points_now(url)
        except (OSError, ValueError) as fault:
            tell(f"{url} does not answer: {fault}")
            points = {path: Datapoint(None) for path in before}
        known = known_to(databroker, list(points)) if known is None and points else known
        news = {path: point for path, point in points.items() if path in (known or ()) and before.get(path) != point}
        for path, point in news.items():
            publish(databroker, path, point)
        before = points
        stopping.wait(every_s)


def publish(databroker: VSSClient, path: str, point: Datapoint) -> None:
    """One signal. A value that the databroker refuses (outside its type or specification) is reported,
    and becomes not available there: no old value stands in its place. Raises VSSClientError where it fails.
    """
    try:
        databroker.set_current_values({path: point})
    except VSSClientError as fault:
        if fault.error.get("code") not in REFUSED or point.value is None:
            raise
        tell(f"the databroker refuses {path} = {point.value}: {fault.error.get('message')}")
        databroker.set_current_values({path: Datapoint(None, point.timestamp)})


def tell(text: str) -> None:
    print(f"kuksa feeder: {text}", file=sys.stderr, flush=True)


def main() -> None:
    """Run until SIGTERM; a databroker that fails is connected to anew."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--url", default="http://127.0.0.1:8000", help="the service")
    options.add_argument("--databroker", default="127.0.0.1:55555", help="host:port")
    options.add_argument("--ca", type=Path, help="PEM file of the databroker's authority; makes it TLS")
    options.add_argument("--every-s", type=float, default=5.0)
    told, stopping = options.parse_args(), threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: stopping.set())
    (host, _, port), token = told.databroker.partition(":"), os.environ.get("DATABROKER_TOKEN")
    while not stopping.is_set():
        try:
            with VSSClient(host, int(port), token=token, root_certificates=told.ca) as databroker:
                feed(told.url, databroker, told.every_s, stopping)
        except (VSSClientError, grpc.RpcError) as fault:
            tell(f"{told.databroker}: {fault}")
            stopping.wait(told.every_s)


if __name__ == "__main__":
    main()
