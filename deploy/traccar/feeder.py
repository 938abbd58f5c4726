"""From a vehicle's Springscale into Traccar: each weight as attributes of the vehicle that Traccar already tracks.

    feeder.py --url http://127.0.0.1:8000 --traccar http://traccar.example:5055 --device 356307042441013 --state DIR

A program of its own beside the service; Python's standard library is enough. It follows the service's history, so that
what was weighed while Traccar or the link was away is sent later, in order, once: the place in the history is kept in
DIR, and moves on after Traccar has answered 200. A token of the service comes from SPRINGSCALE_TOKEN.

Traccar's OsmAnd protocol (OsmAndProtocolDecoder.java of https://github.com/traccar/traccar): an HTTP request whose
parameters are ``id``, ``timestamp`` in seconds, and any others, which become attributes of the position: a number where
it is one. Without ``lat`` and ``lon`` Traccar takes the last place it knows. 400 is a device it does not know.
"""

import argparse
import json
import os
import signal
import sys
import threading
import urllib.error
import urllib.request
from datetime import datetime
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

PAGE = 100  # records of one question
RETRY_S = (1.0, 2.0, 5.0, 10.0, 30.0, 60.0)
WEIGHTS = {"gross": "grossWeight", "front_axle": "axleWeight1", "rear_axle": "axleWeight2"}


def parameters(record: dict[str, Any], device: str) -> dict[str, str] | None:
    """What Traccar is sent of one estimate; None where nothing was weighed. What is unknown is left out, never 0."""
    if record["rejected"] or record["payload_kg"] is None:
        return None
    weights = record.get("weights") or {}
    told: dict[str, float | str | None] = {
        "payload": record["payload_kg"],
        "payloadStd": record["payload_std_kg"],
        "frontShare": record["front_share_pct"],
    }
    told |= {name: (weights.get(key) or {}).get("kg") for key, name in WEIGHTS.items()}
    over = [WEIGHTS[key] for key in WEIGHTS if (weights.get(key) or {}).get("is_over_limit")]
    told |= {"alarm": "general", "overload": " ".join(over)} if over else {}
    at_s = int(datetime.fromisoformat(record["t_end"]).timestamp())
    known = {name: f"{x:.1f}" if isinstance(x, float | int) else x for name, x in told.items() if x is not None}
    return {"id": device, "timestamp": str(at_s), **known}


class History:
    """The service's records from the kept place on."""

    def __init__(self, url: str, state: Path, *, from_the_start: bool) -> None:
        self._url = url
        self._file = state / "cursor.json"
        self._cursor: str | None = None
        self._is_known = from_the_start
        if self._file.is_file():
            self._restore()

    def next(self) -> list[tuple[dict[str, Any], str]]:
        """Records with the place behind each; none where nothing is new. Raises OSError or ValueError."""
        if not self._is_known:
            self.move_to(self._asked("order=newest_first&limit=1")["last_cursor"])
            self._is_known = True
        page = self._asked(f"limit={PAGE}" + (f"&cursor={self._cursor}" if self._cursor else ""))
        items = page["items"]
        behind = page["next_cursor"] or page["last_cursor"]
        return [(item, behind if i == len(items) - 1 else "") for i, item in enumerate(items)]

    def move_to(self, cursor: str | None) -> None:
        """Keep a place, whole or not at all, also through a power cut."""
        if cursor is None:
            return
        self._cursor = cursor
        part = self._file.with_suffix(".part")
        with part.open("w") as file:
            json.dump({"cursor": cursor}, file)
            file.flush()
            os.fsync(file.fileno())
        part.replace(self._file)

    def _restore(self) -> None:
        """The kept place; one that cannot be read counts as none."""
        try:
            self._cursor = str(json.loads(self._file.read_text())["cursor"])
        except (OSError, ValueError, KeyError, TypeError) as fault:
            tell(f"{self._file} cannot be read ({fault}): going on as at the first start")
        else:
            self._is_known = True

    def _asked(self, query: str) -> Any:
        token = os.environ.get("SPRINGSCALE_TOKEN")
        headers = {"Authorization": f"Bearer {token}"} if token else {}
        request = urllib.request.Request(f"{self._url}/api/v1/estimates?spectra=false&{query}", headers=headers)
        with urllib.request.urlopen(request, timeout=10.0) as answer:
            return json.load(answer)


def send(traccar: str, told: dict[str, str]) -> None:
    """One request. Raises OSError (urllib's HTTPError is one) unless Traccar answers 200."""
    request = urllib.request.Request(f"{traccar}/?{urlencode(told)}", method="POST")
    with urllib.request.urlopen(request, timeout=10.0) as answer:
        answer.read()


def feed(history: History, traccar: str, device: str, every_s: float, stopping: threading.Event) -> None:
    """Send what comes until told to stop; what failed is sent again, and nothing overtakes it."""
    n_failed, said = 0, ""
    done: set[str] = set()  # of the page that is not through yet
    while not stopping.is_set():
        try:
            records = history.next()
            for record, behind in records:
                told = parameters(record, device) if record["id"] not in done else None
                if told is not None:
                    send(traccar, told)
                done.add(record["id"])
                if behind:
                    history.move_to(behind)
                    done.clear()
        except (OSError, ValueError, KeyError) as fault:
            text = f"{type(fault).__name__}: {fault}"
            if isinstance(fault, urllib.error.HTTPError) and fault.code == 400:
                text = f"{traccar} does not know the device {device}: add it there with this identifier"
            if text != said:
                tell(text)
            said = text
            stopping.wait(RETRY_S[min(n_failed, len(RETRY_S) - 1)])
            n_failed += 1
            continue
        if said:
            tell("works again")
        n_failed, said = 0, ""
        if len(records) < PAGE:
            stopping.wait(every_s)


def tell(text: str) -> None:
    print(f"traccar feeder: {text}", file=sys.stderr, flush=True)


def main() -> None:
    """Run until SIGTERM."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--url", default="http://127.0.0.1:8000", help="the service")
    options.add_argument("--traccar", required=True, help="http://HOST:5055, Traccar's OsmAnd port")
    options.add_argument("--device", required=True, help="the vehicle's identifier in Traccar")
    options.add_argument("--state", type=Path, required=True, help="folder that keeps the place in the history")
    options.add_argument(
        "--from-the-start", action="store_true", help="send the whole history first, not only what comes"
    )
    options.add_argument("--every-s", type=float, default=10.0)
    told, stopping = options.parse_args(), threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: stopping.set())
    told.state.mkdir(parents=True, exist_ok=True)
    history = History(told.url, told.state, from_the_start=told.from_the_start)
    feed(history, told.traccar.rstrip("/"), told.device, told.every_s, stopping)


if __name__ == "__main__":
    main()
