"""springscale bounds: how well anyone could weigh."""

import click

from gateway.cli.options import as_json
from gateway.core.cross_spectrum.ideal_drive import Drive
from gateway.offline.bounds import limits, limits_table
from gateway.records import json_line


@click.command("bounds")
@click.option("--duration-s", type=click.FloatRange(min=20.0), default=300.0, show_default=True, help="driving seen")
@click.option("--speed-kmh", type=click.FloatRange(10.0, 200.0), default=50.0, show_default=True, help="steady speed")
@as_json
def bounds(duration_s: float, speed_kmh: float, as_json: bool) -> None:
    """Cramer-Rao bounds of payload and front share for the paper's van on its road, by what is seen and known."""
    found = limits(Drive(duration_s, speed_kmh / 3.6))
    if not as_json:
        click.echo(limits_table(found), nl=False)
        return
    rows = [
        {
            "seen": str(one.seen),
            "vehicle_known": one.is_vehicle_known,
            "disturbance": one.disturbance,
            "payload_std_kg": one.bound.payload_std_kg,
            "front_share_std_pct": one.bound.front_share_std_pct,
        }
        for one in found
    ]
    click.echo(json_line({"duration_s": duration_s, "speed_kmh": speed_kmh, "bounds": rows}))
