"""springscale demo: the whole service on a simulated drive, with no hardware and no configuration."""

import json
import threading
from importlib.resources import as_file, files
from itertools import count, takewhile
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final, Literal

import click

from gateway.bus.sink import BusSink, replay_frames
from gateway.cli.estimate import sentence
from gateway.cli.options import NumberRange
from gateway.config import BusSection, Settings, StoreSection, VehicleSection, WebSection
from gateway.log import set_up_log
from gateway.records import iso_utc, json_line
from gateway.service.gateway import Gateway
from gateway.setup import setup_of
from gateway.sim.scenario import START_NS, Truth
from gateway.store import Store
from gateway.units import NS_PER_S
from gateway.web.routes.weights import KnownLoadTold
from gateway.workbench.simulated_drives import demo_drive, frames_of

CHANNEL: Final = "springscale-demo"
ROUND_NS: Final = 1800 * NS_PER_S  # chosen: from the start of one drive to the start of the next
N_QUICK_ROUNDS: Final = 1  # chosen: driven at full speed, so that there is a history to look at


VAN: Final = VehicleSection(
    id="demo-van", gross_limit_kg=1750.0, front_axle_limit_kg=900.0, rear_axle_limit_kg=950.0
)  # of the three loads, the heaviest is too much


@click.command("demo")
@click.option("--once", is_flag=True, help="end after the first drives' estimates and print them")
@click.option("--json", "as_json", is_flag=True, help="print estimates as JSON lines")
@click.option("--port", type=click.IntRange(0, 65535), default=8000, show_default=True, help="port of the dashboard")
@click.option("--speed", type=NumberRange(min=1.0), default=30.0, show_default=True, help="times real time")
@click.option("--fleet", type=click.IntRange(1, 50), help="so many vans instead of one, on the page of a fleet")
def demo(once: bool, as_json: bool, port: int, speed: float, fleet: int | None) -> None:
    """A van drives empty, stops, is loaded with 270 kg and drives on; watch the service weigh it.

    The first drive runs at full speed, further ones with other loads follow at the requested speed.
    """
    set_up_log("warning", under_journald=False)
    with TemporaryDirectory(prefix="springscale-demo-") as folder, as_file(files("gateway") / "demo") as shipped:
        settings = Settings(
            signals="springscale:reference",
            calibration=shipped / "paper_van.json",
            vehicle=VAN,
            bus=BusSection(interface="virtual", channel=CHANNEL),
            web=WebSection(port=0 if once else port),
            store=StoreSection(directory=Path(folder)),
        )
        if fleet is not None:
            from gateway.cli.demo_fleet import fleet_demo  # noqa: PLC0415 - an extra

            fleet_demo(fleet, setup_of(settings), port, speed, once=once)
            return
        driver = _Driver(speed, is_endless=not once)
        try:
            Gateway(settings, setup_of(settings), on_started=driver.start, known_loads=driver.known_loads).run()
        finally:
            driver.end()
        if driver.fault is not None:
            raise driver.fault
        if once:
            _print_estimates(Path(folder), as_json)


class _Driver:
    """Sends the demonstration drives to the bus from a thread of its own."""

    def __init__(self, speed: float, *, is_endless: bool) -> None:
        self._stop = threading.Event()
        self._speed = speed
        self._is_endless = is_endless
        self._thread: threading.Thread | None = None
        self._n_sent = 0
        self._known_loads: tuple[KnownLoadTold, ...] = ()
        self.fault: Exception | None = None  # what ended the driving

    def known_loads(self) -> tuple[KnownLoadTold, ...]:
        """The actual loads so far, for the dashboard to compare with; from any thread."""
        return self._known_loads

    def start(self, gateway: Gateway) -> None:
        """Begin to drive; called once the service is ready."""
        if self._is_endless:
            click.echo(f"Dashboard: {gateway.url}   (Ctrl-C ends)")
            click.echo(f"It fills once the first drive is simulated; later ones run {self._speed:g} times real time.")
        self._thread = threading.Thread(target=self._drive, args=(gateway,), name="demo-drive", daemon=True)
        self._thread.start()

    def end(self) -> None:
        self._stop.set()
        if self._thread is not None:
            self._thread.join(5.0)

    def _drive(self, gateway: Gateway) -> None:
        try:
            with BusSink("virtual", CHANNEL) as sink:
                for seed in takewhile(self._goes_on, count(1)):
                    self._drive_once(seed, sink)
                self._wait_until_taken(gateway)
        except Exception as fault:  # noqa: BLE001 - raised again where the service has ended
            self.fault = fault
        finally:
            if not self._stop.is_set():
                gateway.request_stop()

    def _goes_on(self, seed: int) -> bool:
        return not self._stop.is_set() and (self._is_endless or seed <= N_QUICK_ROUNDS)

    def _drive_once(self, seed: int, sink: BusSink) -> None:
        driven = demo_drive(seed, START_NS + (seed - 1) * ROUND_NS)
        self._known_loads += _told(driven.truth)
        speed: float | Literal["max"] = "max" if seed <= N_QUICK_ROUNDS else self._speed
        self._n_sent += replay_frames([frames_of(driven)], sink, speed, None, self._stop)

    def _wait_until_taken(self, gateway: Gateway) -> None:
        """Waits until the service has worked through every frame that was sent: it maps them all."""
        while gateway.source.counts().frames < self._n_sent or not gateway.has_caught_up:
            if self._stop.wait(0.05):
                return


def _told(truth: Truth) -> tuple[KnownLoadTold, ...]:
    steps = zip(truth.t_ns.tolist(), truth.payload_kg.tolist(), truth.front_share_pct.tolist(), strict=True)
    return tuple(KnownLoadTold(t_start=iso_utc(t_ns), payload_kg=kg, front_share_pct=pct) for t_ns, kg, pct in steps)


def _print_estimates(folder: Path, as_json: bool) -> None:
    store = Store.open(folder)
    try:
        records: list[dict[str, Any]] = [json.loads(text) for text in store.reader().estimates().items]
    finally:
        store.close()
    for record in records:
        click.echo(json_line(record) if as_json else sentence(record))
