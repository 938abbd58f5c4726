"""springscale simulate: drives of a simulated vehicle, as logs or onto a bus."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from gateway.bus.frames import Speed
from gateway.cli import options
from gateway.cli.options import FILE, NumberRange, Told, prints
from gateway.cli.progress import StatusLine, counted
from gateway.sim.vans import VANS
from gateway.workbench.simulated_campaigns import PLANS
from gateway.workbench.simulated_drives import SENSORS_OF_MAP, bench_of, write_campaign
from gateway.workbench.simulated_drives import stream as send_drives

_BENCH = (
    click.argument("kind", type=click.Choice(list(PLANS))),
    click.option("--vehicle", type=click.Choice(list(VANS)), default="paper_van", show_default=True),
    click.option(
        "--map",
        "map_name",
        type=click.Choice(list(SENSORS_OF_MAP)),
        default="reference",
        show_default=True,
        help="shipped signal map that the sensors send by",
    ),
    click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True),
    click.option(
        "--longest-s",
        type=NumberRange(min=0.0, min_open=True),
        default=math.inf,
        help="drive no load longer than this [default: as the plan has it]",
    ),
    click.option(
        "--sensor-left-m",
        type=NumberRange(-1.0, 1.0),
        help="the inertial unit's place left of the centre line [default: as the map's sensors sit]",
    ),
    click.option(
        "--loads-off-m",
        type=NumberRange(0.0, 1.0),
        default=0.0,
        help="place every load at random within this distance of the centre line [default: as the plan has it]",
    ),
    click.option(
        "--unrelated",
        "n_unrelated",
        type=click.IntRange(0, 400),
        default=0,
        show_default=True,
        help="other identifiers that share the bus",
    ),
)


def _takes_bench(command: Callable[..., None]) -> Callable[..., None]:
    """Adds the argument and options that both commands share: what is simulated."""
    for decorate in reversed(_BENCH):
        command = decorate(command)
    return command


@click.group("simulate")
def simulate() -> None:
    """Simulated drives, as logs or onto a bus."""


@simulate.command("campaign")
@_takes_bench
@click.argument("directory", type=FILE)
@click.option("--workers", type=click.IntRange(min=1), default=1, show_default=True, help="processes that simulate")
@prints
def campaign(directory: Path, workers: int, **bench_options: Any) -> Told:
    """Write a campaign of this KIND to DIRECTORY: campaign.toml, signal map, one log a drive, truth.csv."""
    bench = bench_of(**bench_options)
    with counted("driving") as on_drive:
        path = write_campaign(bench, directory, workers=workers, on_drive=on_drive)
    return {"campaign": str(path), "n_drives": len(bench.plan().drives)}, str(path)


@simulate.command("stream")
@_takes_bench
@options.interface
@options.channel
@options.speed
@prints
def stream(interface: str, channel: str, speed: Speed, **bench_options: Any) -> Told:
    """Send the drives of this KIND to a bus, one after the other."""
    with StatusLine() as status:
        n_sent = send_drives(
            bench_of(**bench_options),
            interface,
            channel,
            speed=speed,
            on_progress=lambda n_sent, recorded_s: status.show(f"{recorded_s:.0f} s driven, {n_sent} frames sent"),
        )
    return {"sent": n_sent}, f"{n_sent} frames sent"
