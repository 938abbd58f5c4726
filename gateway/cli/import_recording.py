"""springscale import: a phone's recording becomes a log."""

import math
from collections.abc import Iterator
from pathlib import Path

import click

from gateway.bus.feed import AXES
from gateway.cli.options import FILE, Told, prints
from gateway.offline.phone import Imported
from gateway.offline.phone import import_recording as import_from


@click.command("import")
@click.argument("recording", type=FILE)
@click.argument("output", type=FILE)
@click.option(
    "--forward",
    type=click.Choice(list(AXES)),
    default=None,
    help="the phone's axis that points ahead; y is its top edge [default: found from braking and bends]",
)
@click.option("--no-position", "is_without_position", is_flag=True, help="leave latitude and longitude out")
@prints
def import_recording(recording: Path, output: Path, forward: str | None, is_without_position: bool) -> Told:
    """Make a log OUTPUT (.log or .log.gz) of RECORDING, a zip or folder that Sensor Logger or phyphox exported.

    Turns the phone's axes to the vehicle's, and writes the signal map and database of the log beside it. Prints faults
    of the phone's recording, and how to mend them.
    """
    found, written = import_from(recording, output, forward, with_position=not is_without_position)
    record = {**found.to_json(), "written": [str(path) for path in written]}
    return record, "\n".join([*_text(found), *(f"Written: {path}" for path in written)])


def _text(found: Imported) -> Iterator[str]:
    told = found.to_json()
    yield f"{told['app']}, {told['device']}: {found.duration_s:.0f} s taken from {told['t_start']}"
    yield (
        f"Accelerometer {told['accelerometer_hz']:.1f} Hz, gyroscope {told['gyroscope_hz']:.1f} Hz, "
        f"{told['fixes']} fixes, speed {told['speed_delay_s']:.1f} s late"
    )
    yield f"Axes: {_axes(found)}; the sign by the {found.sign_from}"
    for remark in found.remarks:
        yield f"Note: {remark.text}"


def _axes(found: Imported) -> str:
    """Which of the phone's axes are nearest to forward and up, with the probability."""
    names = []
    for what, row in (("ahead", found.axes.to_vehicle[0]), ("up", found.axes.to_vehicle[2])):
        nearest = max(AXES, key=lambda name: float(AXES[name] @ row))
        names.append(f"the phone's {nearest} points {what}")
    is_named = math.isnan(found.axes.fit)
    return " and ".join(names) + (", as named" if is_named else f" (braking and bends agree by {found.axes.fit:.2f})")
