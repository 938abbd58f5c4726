"""Options of the commands that send to a bus: where, and how fast."""

import math
from typing import Any

import click

from gateway.bus.sink import Speed

interface = click.option("--interface", required=True, help="python-can's name: socketcan, virtual, udp_multicast, ...")
channel = click.option("--channel", required=True, help="of that interface: can0, vcan0, ...")


class SpeedFactor(click.ParamType[Speed]):
    """2.5 -> 2.5; max -> "max"."""

    name = "speed"

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str:
        """As the help shows it."""
        return "NUMBER|max"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Speed:
        """Raises a usage error for anything but a positive number or max."""
        if value == "max":
            return "max"
        try:
            factor = float(value)
        except ValueError:
            factor = math.nan
        if not 0.0 < factor < math.inf:
            self.fail(f"{value!r} is neither a number above 0 nor max", param, ctx)
        return factor


speed = click.option(
    "--speed",
    type=SpeedFactor(),
    default=1.0,
    show_default=True,
    help="2 is twice as fast as the time stamps, max as fast as the bus takes it",
)
