"""springscale replay: a log onto a bus."""

from pathlib import Path

import click

from gateway.bus.frames import Speed
from gateway.bus.logs import LogReport
from gateway.bus.sink import replay as send_log
from gateway.cli import options
from gateway.cli.options import FILE, Told, prints
from gateway.cli.progress import StatusLine
from gateway.errors import LogUnreadableError


@click.command("replay")
@click.argument("log", type=FILE)
@options.interface
@options.channel
@click.option("--from-channel", default=None, help="send the frames of this channel of the log only [default: all]")
@options.speed
@prints
def replay(log: Path, interface: str, channel: str, from_channel: str | None, speed: Speed) -> Told:
    """Send every data frame of LOG to a bus, paced by its time stamps."""
    with StatusLine() as status:
        report = send_log(
            log,
            interface,
            channel,
            from_channel=from_channel,
            speed=speed,
            on_progress=lambda n_sent, recorded_s: status.show(f"{recorded_s:.0f} s of the log, {n_sent} frames sent"),
        )
    _require_sent(report, from_channel)
    return {"sent": report.wanted, **report.to_json()}, "\n".join(
        [f"{log}: {report.wanted} frames sent", *report.remarks()]
    )


def _require_sent(report: LogReport, from_channel: str | None) -> None:
    """Raise LogUnreadableError, saying why, if nothing was sent."""
    if report.wanted:
        return
    if from_channel is not None and report.other_channel:
        seen = ", ".join(sorted(report.channels))
        raise LogUnreadableError(f"{report.path}: has no frame of {from_channel}; --from-channel may name {seen}")
    report.require_frames()
