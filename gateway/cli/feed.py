"""springscale feed: sensors without a CAN bus onto one."""

import math
import signal
import threading
import time
from pathlib import Path
from typing import Final

import click

from gateway.bus.feeder import AXES, Feeder, Gpsd, IioDevice, find_devices, turned
from gateway.cli import options
from gateway.cli.options import NumberRange, Told, prints
from gateway.cli.progress import StatusLine
from gateway.errors import ConfigurationError
from gateway.service.notify import Notifier

GPSD: Final = "127.0.0.1:2947"
SILENT_S: Final = 10.0  # chosen: without a sample for so long systemd's watchdog is not fed, and the feeder restarts


@click.command("feed")
@options.interface
@options.channel
@click.option(
    "--iio",
    "names",
    multiple=True,
    help="device such as iio:device0, repeatable [default: the first accelerometer and the first gyroscope]",
)
@click.option("--forward", type=click.Choice(list(AXES)), default="x", show_default=True, help="the IMU's axis ahead")
@click.option("--up", type=click.Choice(list(AXES)), default="z", show_default=True, help="the IMU's axis up")
@click.option("--rate-hz", type=NumberRange(40.0, 1000.0), default=100.0, show_default=True, help="of the IMU")
@click.option("--gpsd", "gps", default=GPSD, show_default=True, help="HOST:PORT; empty: no receiver")
@click.option(
    "--gps-device", default=None, help="receiver of several at gpsd, such as /dev/ttyUSB0 [default: the first]"
)
@click.option("--for-s", type=NumberRange(0.1), default=None, help="so many seconds [default: until Ctrl-C]")
@click.option("--sysfs", type=options.FILE, default=Path("/sys/bus/iio/devices"), hidden=True)
@click.option("--nodes", type=options.FILE, default=Path("/dev"), hidden=True)
@prints
def feed(
    interface: str,
    channel: str,
    names: tuple[str, ...],
    forward: str,
    up: str,
    rate_hz: float,
    gps: str,
    gps_device: str | None,
    for_s: float | None,
    sysfs: Path,
    nodes: Path,
) -> Told:
    """Send an inertial unit of Linux IIO and a satellite receiver behind gpsd onto a CAN interface.

    The frames are those of the signal map springscale:reference, with a sample counter in each of the IMU's, so that
    the receiver restores the sensor's clock. Runs under systemd (Type=notify, watchdog).
    """
    turn = turned(forward, up)
    chosen = [IioDevice(sysfs / name, turn, rate_hz, nodes) for name in names]
    devices = chosen or list(find_devices(turn, rate_hz, sysfs, nodes))
    if not devices and not gps:
        raise ConfigurationError(f"{sysfs}: has no inertial unit with a buffer, and --gpsd is empty: nothing to send")
    host, _, port = gps.rpartition(":")
    if gps and not (host and port.isdecimal()):
        raise ConfigurationError(f"--gpsd {gps}: not HOST:PORT, such as {GPSD}")
    receiver = Gpsd(host.strip("[]"), int(port), gps_device) if gps else None
    feeder = Feeder(interface, channel, devices, receiver, lambda text: click.echo(f"feed: {text}", err=True))
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: feeder.stop())
    if for_s is not None:
        timer = threading.Timer(for_s, feeder.stop)
        timer.daemon = True
        timer.start()
    notifier = Notifier()
    with StatusLine() as line:

        def tick() -> None:
            notifier.send(READY="1")
            notifier.send_status(_sentence(feeder))
            if not feeder.last_sample_s or time.monotonic() - feeder.last_sample_s < SILENT_S:
                notifier.send(WATCHDOG="1")
            line.show(_sentence(feeder))

        feeder.run(tick)
    told = {
        "samples": {device.name: device.n_samples for device in devices},
        "lost": {device.name: device.numbering.n_lost for device in devices},
        "fixes": feeder.n_fixes,
        "sent": feeder.n_sent,
        "dropped": feeder.n_dropped,
        "gravity_mps2": feeder.gravity_mps2 if math.isfinite(feeder.gravity_mps2) else None,
    }
    return told, _sentence(feeder)


def _sentence(feeder: Feeder) -> str:
    samples = ", ".join(f"{device.n_samples} samples of {device.name}" for device in feeder.devices) or "no sample"
    n_lost = sum(device.numbering.n_lost for device in feeder.devices)
    counts = f"{feeder.n_fixes} fixes, {feeder.n_sent} frames sent, {n_lost} samples lost, {feeder.n_dropped} dropped"
    return f"{samples}, {counts}"
