"""springscale demo --fleet: simulated vans on the page of a fleet."""

import time
from collections import deque
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import click

from gateway.bus.signals import Decoder
from gateway.core.alarms.alarm import alarm_to_json
from gateway.core.alarms.rules import AlarmRules
from gateway.core.alarms.watch import AlarmWatch
from gateway.core.batch_settings import BatchSettings
from gateway.estimates.as_json import estimate_to_json
from gateway.fleet import Book, Message, fleet_app, served
from gateway.records import json_line
from gateway.setup import Setup
from gateway.units import NS_PER_S
from gateway.weighing.flow import Identity
from gateway.workbench.simulated_drives import demo_drive, frames_of

ROUND_S: Final = 1800.0  # chosen: from the start of one drive to the start of the next
APART_S: Final = 240.0  # chosen: one van starts that much before the next
PAUSE_S: Final = 0.2  # chosen: between two looks for records that are due


def fleet_demo(n_vans: int, setup: Setup, port: int, speed: float, *, once: bool) -> None:
    """Runs the demo until Ctrl-C; with ``once`` it ends when each van has driven once, and prints the page's lines.

    The vans' records go straight to the subscriber's database, without a broker. Their first drives have
    just ended when this begins, further ones come at ``speed`` times real time.
    """
    began_s, began = time.time(), time.monotonic()

    def clock_s() -> float:
        return began_s + speed * (time.monotonic() - began)

    with TemporaryDirectory(prefix="springscale-fleet-") as folder:
        book = Book(str(Path(folder) / "fleet.sqlite"), clock_s)
        with closing(book), served(fleet_app(book), "127.0.0.1", 0 if once else port) as at:
            if not once:
                click.echo(f"Fleet: http://127.0.0.1:{at}/fleet   (Ctrl-C ends)")
                click.echo(f"Vans appear as their drives are simulated; later ones run {speed:g} times real time.")
            vans = [_Van(k, setup, began_s - ROUND_S - APART_S * k) for k in range(n_vans)]
            while True:
                for van in vans:
                    book.write(list(van.records_until(clock_s())))
                if once:
                    break
                time.sleep(PAUSE_S)
            click.echo("".join(f"{line.model_dump_json()}\n" for line in book.fleet().items), nl=False)


class _Van:
    """One of the demonstration's vans: drives, weighs, watches its limits."""

    def __init__(self, number: int, setup: Setup, start_s: float) -> None:
        self._id = f"van-{number + 1}"
        self._setup = replace(setup, identity=Identity(self._id, None))
        self._watch = AlarmWatch(AlarmRules(), self._id)
        self._drives = (
            (number + 1 + 2 * k, round((start_s + k * ROUND_S) * NS_PER_S)) for k in count()
        )  # seeds choose the loads
        self._waiting: deque[tuple[int, Message]] = deque()

    def records_until(self, now_s: float) -> Iterator[Message]:
        """The van's records up to that time; simulates the next drive if none are waiting."""
        if not self._waiting:
            self._waiting.extend(self._driven(*next(self._drives)))
        while self._waiting and self._waiting[0][0] <= now_s * NS_PER_S:
            yield self._waiting.popleft()[1]

    def _driven(self, seed: int, start_ns: int) -> Iterator[tuple[int, Message]]:
        """A drive through the pipeline of the service: (when, record)."""
        yield start_ns, self._message("status", {"state": "online", "vehicle_id": self._id})
        flow = self._setup.flow(BatchSettings())
        motion = Decoder(self._setup.signal_map).decode(frames_of(demo_drive(seed, start_ns)))
        calibrated = self._setup.calibrated
        for estimate in [*flow.feed(motion), *flow.flush()]:
            if estimate.is_provisional or estimate.is_remainder:
                continue
            yield estimate.t_end_ns, self._message("estimates", estimate_to_json(estimate))
            if calibrated is not None:
                for alarm in self._watch.weigh(estimate, calibrated.vehicle, calibrated.unsprung):
                    yield estimate.t_end_ns, self._message("alarms", alarm_to_json(alarm))

    def _message(self, kind: str, record: dict[str, Any]) -> Message:
        return Message(f"springscale/{self._id}/{kind}", json_line(record).encode())
