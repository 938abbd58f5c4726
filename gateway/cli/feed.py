"""springscale feed: sensors without a CAN bus onto one."""

import math
import signal
import threading
import time
from pathlib import Path
from typing import Final

import click

from gateway.bus.feeder import AXES, Feeder, FeedState, Gpsd, IioDevice, find_devices, turned
from gateway.cli import options
from gateway.cli.options import NumberRange, Told, prints
from gateway.cli.progress import StatusLine
from gateway.errors import ConfigurationError
from gateway.service.notify import Notifier
from gateway.units import STANDARD_GRAVITY_MPS2

GPSD: Final = "127.0.0.1:2947"
MOST_OFF_MPS2: Final = 2.0  # chosen: of gravity: a mount tilted by 37 degrees, as batches allow
SETTLED: Final = 1000  # chosen: samples after which the mean of gravity is believed
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
    feeder = Feeder(
        interface, channel, devices, _gpsd(gps, gps_device), lambda text: click.echo(f"feed: {text}", err=True)
    )
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: feeder.stop())
    if for_s is not None:
        timer = threading.Timer(for_s, feeder.stop)
        timer.daemon = True
        timer.start()
    ticker = _Ticker(devices)
    with StatusLine() as ticker.status:
        feeder.run(ticker.tick)
    return _json(feeder.state), _sentence(feeder.state)


def _gpsd(told: str, device: str | None) -> Gpsd | None:
    if not told:
        return None
    host, _, port = told.rpartition(":")
    if not host or not port.isdecimal():
        raise ConfigurationError(f"--gpsd {told}: not HOST:PORT, such as {GPSD}")
    return Gpsd(host.strip("[]"), int(port), device)


class _Ticker:
    """Reports its state to systemd and to people."""

    def __init__(self, devices: list[IioDevice]) -> None:
        self.status = StatusLine()
        self._notifier = Notifier()
        self._has_imu = bool(devices)
        self._is_ready = False
        self._has_warned = False

    def tick(self, state: FeedState) -> None:
        if not self._is_ready:
            self._notifier.send(READY="1")
            self._is_ready = True
        self._notifier.send(STATUS=_sentence(state))
        if not self._has_imu or not state.last_sample_s or time.monotonic() - state.last_sample_s < SILENT_S:
            self._notifier.send(WATCHDOG="1")
        self.status.show(_sentence(state))
        self._warn_of_gravity(state)

    def _warn_of_gravity(self, state: FeedState) -> None:
        """Warns once if the axis that should point up does not show gravity."""
        is_settled = max(state.n_samples.values(), default=0) > SETTLED and math.isfinite(state.gravity_mps2)
        if self._has_warned or not is_settled:
            return
        self._has_warned = True
        if abs(state.gravity_mps2 - STANDARD_GRAVITY_MPS2) > MOST_OFF_MPS2:
            click.echo(
                f"feed: the axis that should be up reads {state.gravity_mps2:.1f} m/s2 and not 9.8: name it by --up, "
                "and the one that points ahead by --forward",
                err=True,
            )


def _sentence(state: FeedState) -> str:
    samples = ", ".join(f"{n} samples of {name}" for name, n in state.n_samples.items()) or "no sample"
    lost = sum(state.n_lost.values())
    others = "".join(f", {n} reports of {device} left out" for device, n in state.n_left_out.items())
    return (
        f"{samples}, {state.n_fixes} fixes{others}, {state.n_sent} frames sent, {lost} samples lost, "
        f"{state.n_dropped} dropped"
    )


def _json(state: FeedState) -> dict[str, object]:
    gravity = state.gravity_mps2 if math.isfinite(state.gravity_mps2) else None
    return {
        "samples": state.n_samples,
        "lost": state.n_lost,
        "fixes": state.n_fixes,
        "left_out": state.n_left_out,
        "sent": state.n_sent,
        "dropped": state.n_dropped,
        "gravity_mps2": gravity,
    }
